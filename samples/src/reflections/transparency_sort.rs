//! Sorts transparent surfaces for blending.

use glam::{Affine3A, Vec3};

/// A flat transparent surface in the world: a pane, or a body of water seen from above.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SortBounds {
    corners: [Vec3; 8],
    centre: Vec3,
    normal: Vec3,
}

impl SortBounds {
    /// Bounds of a model between `low` and `high`, thinnest across its plane, transformed by `to_world`.
    pub(super) fn new(low: Vec3, high: Vec3, to_world: &Affine3A) -> Self {
        let axis = Vec3::AXES[(high - low).min_position()];
        let corner = |number: usize| {
            let pick = |bit: usize, low: f32, high: f32| if number & bit == 0 { low } else { high };
            Vec3::new(pick(1, low.x, high.x), pick(2, low.y, high.y), pick(4, low.z, high.z))
        };
        Self {
            corners: std::array::from_fn(|number| to_world.transform_point3(corner(number))),
            centre: to_world.transform_point3(0.5 * (low + high)),
            normal: to_world.transform_vector3(axis).normalize_or_zero(),
        }
    }

    /// True if this layer can lie before `other` as seen from `eye`. It cannot where the plane of one of them parts
    /// them in the other order.
    fn can_hide(&self, other: &Self, eye: Vec3) -> bool {
        let is_beyond = other.sides(self.corners, eye).all(|side| side <= EPSILON);
        let is_nearer = self.sides(other.corners, eye).all(|side| side >= -EPSILON);
        !is_beyond && !is_nearer
    }

    /// Distances of points from the plane, in scene units: above 0 on the side of `eye`.
    fn sides(&self, points: [Vec3; 8], eye: Vec3) -> impl Iterator<Item = f32> {
        let side = self.normal.dot(eye - self.centre).signum();
        points.into_iter().map(move |point| side * self.normal.dot(point - self.centre))
    }
}

/// Tolerance for surfaces that touch.
const EPSILON: f32 = 1e-4;

/// Numbers of the layers, farthest first as seen from `eye`: none can hide one that comes after it. So the order is
/// right for every pixel, unless layers pass through each other or hide each other in a ring; those follow the distance
/// of their middles.
pub(super) fn farthest_first(layers: &[SortBounds], eye: Vec3) -> Vec<usize> {
    let distance = |number: &usize| layers[*number].centre.distance_squared(eye);
    let mut left: Vec<usize> = (0..layers.len()).collect();
    left.sort_by(|a, b| distance(b).total_cmp(&distance(a)));
    let mut order = Vec::with_capacity(layers.len());
    while !left.is_empty() {
        let hides_none = |number: &usize| {
            left.iter().all(|other| other == number || !layers[*number].can_hide(&layers[*other], eye))
        };
        let place = left.iter().position(hides_none).unwrap_or(0);
        order.push(left.remove(place));
    }
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A pane of two by two units that faces z, around `centre`.
    fn pane(centre: [f32; 3]) -> SortBounds {
        let half = Vec3::new(1.0, 1.0, 0.0);
        SortBounds::new(-half, half, &Affine3A::from_translation(centre.into()))
    }

    /// Water of ten by ten units at height 0 around `x`, `z`.
    fn water(x: f32, z: f32) -> SortBounds {
        let half = Vec3::new(5.0, 0.0, 5.0);
        SortBounds::new(-half, half, &Affine3A::from_translation(Vec3::new(x, 0.0, z)))
    }

    #[test]
    fn panes_in_a_line_are_sorted_from_either_end() {
        let panes = [pane([0.0, 0.0, -6.0]), pane([0.2, 0.0, -2.0]), pane([0.0, 0.1, -4.0])];
        assert_eq!(farthest_first(&panes, Vec3::ZERO), [0, 2, 1]);
        assert_eq!(farthest_first(&panes, Vec3::new(0.0, 0.0, -9.0)), [1, 2, 0]);
    }

    #[test]
    fn planes_decide_where_distances_of_middles_would_be_wrong() {
        // The middle of the water is nearer than the pane, which all the same stands before its far end.
        let (water, pane) = (water(0.0, -4.0), pane([0.0, 1.5, -6.0]));
        let eye = Vec3::new(0.0, 1.6, 0.0);
        assert!(water.centre.distance(eye) < pane.centre.distance(eye));
        assert_eq!(farthest_first(&[pane, water], eye), [1, 0]);
        assert_eq!(farthest_first(&[water, pane], eye), [0, 1]);
    }

    #[test]
    fn the_order_does_not_depend_on_that_of_the_list() {
        let layers = [pane([0.0, 1.5, -3.0]), water(0.0, -6.0), pane([0.4, 1.5, -7.0])];
        for eye in [[0.0, 1.0, 0.0], [1.0, 2.0, -12.0], [8.0, 1.0, -5.0]].map(Vec3::from) {
            let name = |list: [usize; 3]| -> Vec<usize> {
                let chosen = list.map(|number| layers[number]);
                farthest_first(&chosen, eye).into_iter().map(|place| list[place]).collect()
            };
            let expected = name([0, 1, 2]);
            for list in [[0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
                assert_eq!(name(list), expected, "{eye}");
            }
        }
    }

    #[test]
    fn layers_that_cannot_be_ordered_all_come() {
        let quarter = |centre: [f32; 3]| {
            let half = Vec3::new(0.0, 1.0, 1.0);
            SortBounds::new(-half, half, &Affine3A::from_translation(centre.into()))
        };
        let crossing = [pane([0.0, 0.0, -3.0]), quarter([0.0, 0.0, -3.1])];
        let mut order = farthest_first(&crossing, Vec3::new(2.0, 0.0, 3.0));
        order.sort_unstable();
        assert_eq!(order, [0, 1]);
        assert_eq!(farthest_first(&[], Vec3::ZERO), [0; 0]);
    }
}
