//! Trees whose every leaf is a triangle.

use std::f32::consts::TAU;

use glam::Vec3;

use crate::scene::Material;
use crate::scene::mesh::Mesh;
use crate::scene::noise::lattice;

/// Parameters of a kind of tree. Lengths are shares of a tree's height.
pub(super) struct Kind {
    name: &'static str,
    /// Average height in metres.
    pub(super) height: f32,
    crown: Crown,
    /// Radius of the crown.
    spread: f32,
    /// Colour of the leaves, of which some are lighter and some darker.
    leaf: [f32; 3],
    bark: [f32; 3],
}

#[derive(Clone, Copy)]
enum Crown {
    /// Tiers of branches, smaller towards the top.
    Tiers(u32),
    /// Balls of leaves.
    Balls(u32),
}

/// The kinds there are.
pub(super) const KINDS: [Kind; 4] = [
    kind("fir", 5.2, Crown::Tiers(9), 0.21, [[0.035, 0.085, 0.035], [0.16, 0.10, 0.06]]),
    kind("oak", 4.0, Crown::Balls(9), 0.40, [[0.09, 0.17, 0.03], [0.15, 0.12, 0.09]]),
    kind("birch", 4.4, Crown::Balls(6), 0.22, [[0.22, 0.30, 0.05], [0.62, 0.60, 0.56]]),
    kind("maple", 3.6, Crown::Balls(7), 0.34, [[0.42, 0.15, 0.025], [0.17, 0.13, 0.10]]),
];

const fn kind(
    name: &'static str,
    height: f32,
    crown: Crown,
    spread: f32,
    [leaf, bark]: [[f32; 3]; 2],
) -> Kind {
    Kind { name, height, crown, spread, leaf, bark }
}

/// Shades of leaves.
const SHADES: [f32; 3] = [0.7, 1.0, 1.35];
/// Number of the bark's material, behind the shades.
const BARK: u32 = SHADES.len() as u32;
/// Leaves of a tree with leaves a tenth of its radius long.
const FULL: f32 = 3_000.0;

/// A tree around the vertical, a metre high.
pub(super) struct Tree {
    pub(super) name: String,
    pub(super) mesh: Mesh,
    pub(super) materials: Vec<Material>,
}

/// A tree of about this many triangles.
pub(super) fn grow(kind: &Kind, triangles: u32, seed: u32) -> Tree {
    let mut mesh = Mesh::default();
    let sides = (triangles / 100).clamp(3, 32);
    trunk(&mut mesh, kind, sides);
    let leaves = triangles.saturating_sub(2 * sides).max(8);
    let size = kind.spread * 0.3 * (FULL / leaves as f32).cbrt().clamp(0.25, 2.5);
    for leaf in 0..leaves {
        let chance = |which: u32| lattice(leaf as i32, which as i32, 31 + seed);
        let (at, normal) = kind.place_of_leaf(&chance, seed);
        add_leaf(&mut mesh, at, normal, size * (0.7 + 0.6 * chance(8)), &chance);
    }
    let leaf = |shade: &f32| Material::matte("leaf", kind.leaf.map(|c| c * shade));
    let bark = Material::matte("bark", kind.bark);
    let materials = SHADES.iter().map(leaf).chain([bark]).collect();
    Tree { name: kind.name.to_owned(), mesh, materials }
}

fn trunk(mesh: &mut Mesh, kind: &Kind, sides: u32) {
    let top = match kind.crown {
        Crown::Tiers(_) => 0.97,
        Crown::Balls(_) => 0.6,
    };
    for side in 0..=sides {
        let angle = (side % sides) as f32 / sides as f32 * TAU;
        let out = Vec3::new(angle.sin(), 0.0, angle.cos());
        for (radius, y) in [(0.026, 0.0), (0.008, top)] {
            mesh.add_vertex((radius * out + y * Vec3::Y).to_array(), out.to_array(), [0.0; 2]);
        }
    }
    for side in 0..sides {
        let [low, high] = [2 * side, 2 * side + 1];
        mesh.add_triangle([low, low + 2, high + 2], BARK);
        mesh.add_triangle([low, high + 2, high], BARK);
    }
}

impl Kind {
    /// Position of a leaf, and the outward direction there.
    fn place_of_leaf(&self, chance: &impl Fn(u32) -> f32, seed: u32) -> (Vec3, Vec3) {
        let around = TAU * chance(1);
        let out = Vec3::new(around.sin(), 0.0, around.cos());
        match self.crown {
            Crown::Tiers(tiers) => {
                // More leaves where the cone is wide.
                let up = 1.0 - chance(2).sqrt();
                let within = (up * tiers as f32).fract();
                let reach = self.spread * (1.0 - up) * (1.0 - 0.55 * within);
                let radius = reach * (0.35 + 0.65 * chance(3).sqrt());
                let droop = 0.05 * (radius / self.spread);
                let at = radius * out + (0.12 + 0.86 * up - droop) * Vec3::Y;
                (at, (out + 0.6 * Vec3::Y).normalize())
            }
            Crown::Balls(balls) => {
                let ball = (chance(2) * balls as f32) as u32;
                let (middle, radius) = self.ball(ball, balls, seed);
                let y = 2.0 * chance(3) - 1.0;
                let normal = (1.0 - y * y).sqrt() * out + y * Vec3::Y;
                (middle + radius * (0.6 + 0.4 * chance(4)) * normal, normal)
            }
        }
    }

    /// A ball of leaves: one on top, the others around it.
    fn ball(&self, ball: u32, balls: u32, seed: u32) -> (Vec3, f32) {
        let chance = |which| lattice(ball as i32, which, 71 + seed);
        if ball == 0 {
            return (Vec3::new(0.0, 0.76, 0.0), 0.24f32.min(self.spread));
        }
        let around = TAU * (ball as f32 / (balls - 1) as f32 + 0.1 * chance(1));
        let reach = self.spread * (0.45 + 0.25 * chance(2));
        let y = 0.42 + 0.30 * chance(3);
        (Vec3::new(reach * around.sin(), y, reach * around.cos()), self.spread * (0.38 + 0.16 * chance(4)))
    }
}

/// A triangle that leans out of the crown; its normals are those of the crown, so that light falls on it softly.
fn add_leaf(mesh: &mut Mesh, at: Vec3, normal: Vec3, size: f32, chance: &impl Fn(u32) -> f32) {
    let lean = Vec3::new(chance(9) - 0.5, chance(10) - 0.5, chance(11) - 0.5);
    let tip = (normal + 1.6 * lean - 0.25 * Vec3::Y).normalize_or(normal);
    let side = tip.cross(lean + 0.3 * Vec3::X).normalize_or(tip.any_orthonormal_vector());
    let first = mesh.positions.len() as u32;
    for corner in [at - 0.32 * size * side, at + 0.32 * size * side, at + size * tip] {
        mesh.add_vertex(corner.to_array(), normal.to_array(), [0.0; 2]);
    }
    let shade = ((chance(12) * SHADES.len() as f32) as u32).min(BARK - 1);
    mesh.add_triangle([first, first + 1, first + 2], shade);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn trees_are_a_metre_high_and_have_as_many_triangles_as_are_wished_for() {
        for (seed, kind) in (0..).zip(&KINDS) {
            for wished in [50, 4_000] {
                let Tree { mesh, materials, .. } = grow(kind, wished, seed);
                assert_eq!(mesh.triangles.len(), wished as usize, "{}", kind.name);
                assert!(
                    mesh.triangle_materials.iter().all(|material| (*material as usize) < materials.len())
                );
                assert!(mesh.normals.iter().all(|&n| (Vec3::from(n).length() - 1.0).abs() < 1e-3));
            }
            let top = grow(kind, 4_000, seed).mesh.positions.iter().fold(0.0_f32, |top, p| top.max(p[1]));
            assert!((0.9..1.15).contains(&top), "{}: {top}", kind.name);
        }
    }
}
