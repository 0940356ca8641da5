//! Transforms of the triangles: a large one that turns, and two rings around it that turn against each other.

use std::f32::consts::TAU;
use std::iter::{once, repeat_n};

use glam::{Affine3A, Quat, Vec3};

/// Triangles of a ring, how far from the middle, how large, and how often it goes round in a round of the animation.
struct Ring {
    count: u32,
    radius: f32,
    size: f32,
    turns: f32,
}

const RINGS: [Ring; 2] = [
    Ring { count: 12, radius: 1.0, size: 0.2, turns: 1.0 },
    Ring { count: 24, radius: 1.42, size: 0.15, turns: -1.0 },
];

/// Corners of a triangle around the origin that points up, at distance 1.
pub(super) const CORNERS: [[f32; 3]; 3] = [[-0.866, -0.5, 0.0], [0.866, -0.5, 0.0], [0.0, 1.0, 0.0]];

/// Groups of triangles: the one in the middle, and each ring.
pub(super) const GROUPS: usize = 1 + RINGS.len();

/// The group of each triangle, in the order of [`places`].
pub(super) fn groups() -> impl Iterator<Item = usize> {
    let rings = (1..).zip(&RINGS).flat_map(|(group, ring)| repeat_n(group, ring.count as usize));
    once(0).chain(rings)
}

/// Transform of each triangle at `phase` of the animation's round, 0 to 1.
pub(super) fn places(phase: f32) -> Vec<Affine3A> {
    let middle = Affine3A::from_scale_rotation_translation(
        Vec3::splat(0.72),
        Quat::from_rotation_y(TAU * (phase + 0.08)),
        Vec3::ZERO,
    );
    let rings = RINGS.iter().flat_map(|ring| (0..ring.count).map(|number| on_ring(ring, number, phase)));
    once(middle).chain(rings).collect()
}

/// Points outwards, and turns about that direction too.
fn on_ring(ring: &Ring, number: u32, phase: f32) -> Affine3A {
    let share = number as f32 / ring.count as f32;
    Affine3A::from_rotation_z(TAU * (share + ring.turns * phase))
        * Affine3A::from_translation(Vec3::Y * ring.radius)
        * Affine3A::from_rotation_y(TAU * (2.0 * share + phase))
        * Affine3A::from_scale(Vec3::splat(ring.size))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_round_ends_where_it_began() {
        for (first, last) in places(0.0).iter().zip(places(1.0)) {
            assert!(first.abs_diff_eq(last, 1e-5), "{first} {last}");
        }
        assert!(!places(0.0)[5].abs_diff_eq(places(0.3)[5], 0.1));
    }

    #[test]
    fn each_triangle_has_its_group() {
        let counts = [1, 12, 24];
        let of = |group| groups().filter(|other| *other == group).count();
        assert_eq!(std::array::from_fn::<_, GROUPS, _>(of), counts);
        assert_eq!(groups().count(), places(0.0).len());
        for (group, place) in groups().zip(places(0.2)) {
            let from_middle = place.translation.length();
            let radius = [0.0, RINGS[0].radius, RINGS[1].radius][group];
            assert!((from_middle - radius).abs() < 1e-5, "{group}: {from_middle}");
        }
    }

    #[test]
    fn triangles_do_not_touch() {
        let all = places(0.37);
        for (number, one) in all.iter().enumerate() {
            let size = one.matrix3.y_axis.length();
            for other in &all[..number] {
                let apart = one.translation.distance(other.translation);
                assert!(apart > size + other.matrix3.y_axis.length(), "{number}: {apart}");
            }
        }
    }
}
