//! Trees whose every leaf is a quad.

use std::f32::consts::TAU;

use glam::Vec3;

use super::random::Random;
use super::solid::Solid;
use super::surfaces::Surface;

/// Kinds of trees.
pub(super) const KINDS: usize = 8;
/// Leaves of a tree.
const LEAVES: usize = 2_000;

/// A tree that stands on the origin.
pub(super) fn tree(kind: usize, seed: u64) -> Solid {
    let mut random = Random::new(seed, 0x2000 + kind as u64);
    let mut solid = Solid::default();
    let (height, spread) = (random.within(7.0..10.5), random.within(2.0..3.1));
    let fork = random.within(0.30..0.38) * height;
    let lean = Vec3::new(random.within(-0.2..0.2), fork, random.within(-0.2..0.2));
    solid.ring(Surface::Bark, [Vec3::ZERO, lean], [0.26, 0.17], 14);
    let top = Vec3::new(lean.x, 0.86 * height, lean.z);
    solid.ring(Surface::Bark, [lean, top], [0.17, 0.03], 12);
    let count = 9 + random.below(5);
    let clusters: Vec<(Vec3, f32)> = (0..count)
        .map(|number| {
            let angle = TAU * (number as f32 * 0.618 + random.within(0.0..0.1));
            let share = (number as f32 + 0.5) / count as f32;
            let reach = spread * (1.0 - 0.75 * share) * random.within(0.6..0.8);
            let up = fork + (height - fork) * (0.18 + 0.68 * share);
            let middle = Vec3::new(lean.x + reach * angle.cos(), up, lean.z + reach * angle.sin());
            let from = lean + (top - lean) * (0.75 * share);
            branch(&mut solid, from, middle, &mut random);
            (middle, spread * random.within(0.42..0.6) * (1.0 - 0.25 * share))
        })
        .collect();
    let green = [Surface::Leaf, Surface::DarkLeaf, Surface::LightLeaf][kind % 3];
    for _ in 0..LEAVES {
        let (middle, radius) = clusters[random.below(clusters.len())];
        leaf(&mut solid, (middle, radius), green, &mut random);
    }
    solid
}

/// A branch and two twigs.
fn branch(solid: &mut Solid, from: Vec3, to: Vec3, random: &mut Random) {
    solid.ring(Surface::Bark, [from, to], [0.07, 0.025], 8);
    for _ in 0..2 {
        let start = from.lerp(to, random.within(0.4..0.8));
        solid.ring(Surface::Bark, [start, start + 0.7 * direction(random)], [0.025, 0.008], 5);
    }
}

/// A leaf near the hull of a ball, which faces outwards more or less, so that crowns are shaded as balls are.
fn leaf(solid: &mut Solid, (middle, radius): (Vec3, f32), green: Surface, random: &mut Random) {
    let out = direction(random);
    let at = middle + out * Vec3::new(1.0, 0.8, 1.0) * radius * random.unit().powf(0.3);
    let normal = (out + 0.7 * direction(random)).normalize_or(Vec3::Y);
    let turn = direction(random);
    let along = normal.cross(turn).normalize_or(normal.any_orthonormal_vector());
    let (u, v) = (along * random.within(0.20..0.34), normal.cross(along) * random.within(0.13..0.20));
    let surface = if random.chance(0.75) { green } else { Surface::Leaf };
    solid.quad_with_normal(surface, [at - u, at - v, at + v, at + u], normal);
}

fn direction(random: &mut Random) -> Vec3 {
    let (y, angle) = (random.within(-1.0..1.0), random.within(0.0..TAU));
    let radius = (1.0 - y * y).max(0.0).sqrt();
    Vec3::new(radius * angle.cos(), y, radius * angle.sin())
}
