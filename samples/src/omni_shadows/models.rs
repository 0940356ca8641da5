//! The interior, its furniture, and the place of everything at a frame time.

use std::f32::consts::TAU;
use std::ops::Range;

use bytemuck::{Pod, Zeroable};
use glam::{Affine3A, Quat, Vec3, Vec4};
use lvk::transform_rows;

use super::lattice::lattice;
use crate::scene::Camera;
use crate::shapes::{GpuVertex, Mesh};

/// Half the room's width, its height, half its length.
pub(super) const ROOM: [f32; 3] = [4.2, 4.4, 4.6];
/// The hook of the lamp, and the length of its rope.
const HOOK: Vec3 = Vec3::new(0.0, ROOM[1], -0.9);
const CHAIN: f32 = 2.0;
/// Radius of the lattice.
const LATTICE: f32 = 0.52;
/// Amplitude of the lamp's swing, in radians.
const SWING: f32 = 0.13;
/// Least distance from the lamp to anything that throws shadows (`kNearestBlocker` of `shaders/omni_shadows/shadow.glsl`).
#[cfg(test)]
const NEAREST_BLOCKER: f32 = 0.3;

/// Materials, as `shaders/omni_shadows/frame.glsl` counts them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Material {
    Plaster,
    Tiles,
    Metal,
    Glaze,
    Glow,
}

/// `Instance` in `shaders/omni_shadows/frame.glsl`.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Instance {
    rows: [f32; 12],
    color: [f32; 3],
    material: u32,
}

impl Instance {
    fn place(&self, [x, y, z]: [f32; 3]) -> [f32; 3] {
        [0, 4, 8].map(|row| Vec4::from_slice(&self.rows[row..]).dot(Vec4::new(x, y, z, 1.0)))
    }
}

/// A model and its instances, for one draw call.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Draw {
    /// Numbers of vertices.
    pub(super) corners: Range<u32>,
    pub(super) instances: Range<u32>,
    /// True if it is in the lamp's way.
    pub(super) casts: bool,
}

/// All models, in the order in which [`instances`] places them.
#[derive(Debug, Default)]
pub(super) struct Models {
    pub(super) vertices: Vec<GpuVertex>,
    pub(super) corners: Vec<u32>,
    pub(super) draws: Vec<Draw>,
}

impl Models {
    pub(super) fn new() -> Self {
        let mut models = Self::default();
        for (mesh, count, casts) in [
            (floor(), 1, false),
            (walls(), 1, false),
            (column(), 4, true),
            (plinth(), 2, true),
            (ball(0.34), 1, true),
            (ring(), 1, true),
            (chain(), 1, true),
            (lattice(LATTICE, 0.021, 0.03), 1, true),
            (ball(0.075), 3, true),
            (ball(0.07), 1, false),
        ] {
            models.add(&mesh, count, casts);
        }
        models
    }

    /// Triangles of everything that is drawn.
    pub(super) fn triangle_count(&self) -> u32 {
        self.draws.iter().map(|draw| draw.corners.len() as u32 / 3 * draw.instances.len() as u32).sum()
    }

    /// Number of instances.
    pub(super) fn instance_count(&self) -> u32 {
        self.draws.last().map_or(0, |draw| draw.instances.end)
    }

    /// Corners of all triangles in their places at `phase`, of those in the lamp's way and of the others.
    pub(super) fn triangles(&self, phase: f32) -> [Vec<[[f32; 3]; 3]>; 2] {
        let instances = instances(phase);
        let mut found = [Vec::new(), Vec::new()];
        for draw in &self.draws {
            let corners = &self.corners[draw.corners.start as usize..draw.corners.end as usize];
            for instance in &instances[draw.instances.start as usize..draw.instances.end as usize] {
                let place = |corner: &u32| instance.place(self.vertices[*corner as usize].position);
                let triangles = corners.chunks_exact(3).map(|three| [0, 1, 2].map(|at| place(&three[at])));
                found[usize::from(!draw.casts)].extend(triangles);
            }
        }
        found
    }

    fn add(&mut self, mesh: &Mesh, count: u32, casts: bool) {
        let (base, first, placed) =
            (self.vertices.len() as u32, self.corners.len() as u32, self.instance_count());
        self.vertices.extend(mesh.vertices.iter().map(GpuVertex::from));
        self.corners.extend(mesh.triangles.iter().flatten().map(|corner| base + u32::from(*corner)));
        let corners = first..self.corners.len() as u32;
        self.draws.push(Draw { corners, instances: placed..placed + count, casts });
    }
}

/// Everything in its place at `phase` of a round, 0 to 1, in the order of the models.
pub(super) fn instances(phase: f32) -> Vec<Instance> {
    use Material::{Glaze, Glow, Metal, Plaster, Tiles};
    let stone = [0.52, 0.44, 0.35];
    let mut all =
        vec![unrotated(Vec3::ZERO, [0.4; 3], Tiles), unrotated(Vec3::ZERO, [0.72, 0.55, 0.4], Plaster)];
    for place in [[-2.9, 0.0, -3.2], [2.9, 0.0, -3.2], [-3.3, 0.0, 0.3], [3.3, 0.0, 0.3]] {
        all.push(unrotated(place.into(), stone, Glaze));
    }
    let plinths = [Vec3::new(-1.35, 0.0, -2.5), Vec3::new(1.35, 0.0, -2.5)];
    all.extend(plinths.map(|place| unrotated(place, stone, Glaze)));
    all.push(unrotated(plinths[0] + Vec3::Y * 1.14, [0.05, 0.16, 0.2], Glaze));
    let turning = Quat::from_rotation_y(TAU * phase);
    all.push(placed(plinths[1] + Vec3::Y * 1.22, turning, [0.85, 0.5, 0.22], Metal));
    let hanging = hanging(phase);
    let brass = [0.9, 0.62, 0.26];
    all.push(instance(hanging, brass, Metal));
    let turned = Affine3A::from_rotation_y(TAU / 5.0 * phase);
    let below = Affine3A::from_translation(Vec3::Y * -CHAIN);
    all.push(instance(hanging * below * turned, brass, Metal));
    for number in 0..3 {
        let color = [[0.75, 0.12, 0.06], [0.08, 0.35, 0.4], [0.8, 0.6, 0.15]][number];
        all.push(unrotated(lamp(phase) + orbit(number, phase), color, Glaze));
    }
    all.push(unrotated(lamp(phase), [9.0, 6.6, 4.0], Glow));
    all
}

/// Position of the lamp.
pub(super) fn lamp(phase: f32) -> Vec3 {
    hanging(phase).transform_point3(Vec3::Y * -CHAIN)
}

/// The camera of the animation at `phase` of the round, 0 to 1.
pub(super) fn camera(phase: f32) -> Camera {
    let (sine, cosine) = (TAU * phase).sin_cos();
    let eye = [0.9 + 0.35 * sine, 1.75 + 0.12 * cosine, 4.2];
    Camera::looking_at(eye, [-0.1, 1.95, -1.2], 62.0)
}

/// Returns the transform of things that hang from the hook.
fn hanging(phase: f32) -> Affine3A {
    let (sine, cosine) = (TAU * phase).sin_cos();
    let swing = Quat::from_rotation_z(SWING * sine) * Quat::from_rotation_x(0.4 * SWING * cosine);
    Affine3A::from_rotation_translation(swing, HOOK)
}

/// A ball's way around the lamp: each at its own height and pace, some the other way.
fn orbit(number: usize, phase: f32) -> Vec3 {
    let (rounds, radius, tilt) = [(1.0, 0.86, 0.35), (-1.0, 1.05, -0.5), (2.0, 0.72, 0.15)][number];
    let angle = TAU * (rounds * phase + number as f32 / 3.0 + 0.1);
    radius * (Quat::from_rotation_z(tilt) * Vec3::new(angle.cos(), 0.0, angle.sin()))
}

fn unrotated(place: Vec3, color: [f32; 3], material: Material) -> Instance {
    placed(place, Quat::IDENTITY, color, material)
}

fn placed(place: Vec3, turn: Quat, color: [f32; 3], material: Material) -> Instance {
    instance(Affine3A::from_rotation_translation(turn, place), color, material)
}

fn instance(world_from_model: Affine3A, color: [f32; 3], material: Material) -> Instance {
    Instance { rows: transform_rows(&world_from_model), color, material: material as u32 }
}

fn floor() -> Mesh {
    let [half, _, length] = ROOM;
    Mesh::default().quad(Vec3::new(-half, 0.0, -length), Vec3::Z * 2.0 * length, Vec3::X * 2.0 * half, 1.0)
}

/// Walls and ceiling, seen from inside.
fn walls() -> Mesh {
    let [half, height, length] = ROOM;
    let [x, y, z] = [Vec3::X * 2.0 * half, Vec3::Y * height, Vec3::Z * 2.0 * length];
    let low = Vec3::new(-half, 0.0, -length);
    Mesh::default()
        .quad(low, x, y, 1.0)
        .quad(low + z, y, x, 1.0)
        .quad(low, y, z, 1.0)
        .quad(low + x, z, y, 1.0)
        .quad(low + y, x, z, 1.0)
}

fn column() -> Mesh {
    let shaft = (0..=8).map(|part| {
        let height = part as f32 / 8.0;
        [0.24 - 0.05 * height * height, 0.32 + 3.5 * height]
    });
    let foot = [[0.0, 0.0], [0.38, 0.0], [0.38, 0.16], [0.33, 0.22], [0.33, 0.26], [0.25, 0.32]];
    let head = [[0.22, 3.86], [0.25, 3.9], [0.25, 3.94], [0.34, 4.14], [0.34, ROOM[1]]];
    let profile: Vec<_> = foot.into_iter().chain(shaft).chain(head).collect();
    Mesh::default().lathe(&profile, 28)
}

fn plinth() -> Mesh {
    Mesh::default()
        .cuboid([-0.42, 0.0, -0.42], [0.42, 0.1, 0.42], 1.0)
        .cuboid([-0.33, 0.1, -0.33], [0.33, 0.72, 0.33], 1.0)
        .cuboid([-0.4, 0.72, -0.4], [0.4, 0.8, 0.4], 1.0)
}

fn ball(radius: f32) -> Mesh {
    Mesh::default().ball(Vec3::ZERO, Vec3::splat(radius), 32)
}

/// Upright.
fn ring() -> Mesh {
    Mesh::default().grid(48, 20, |u, v| {
        let ((sine, cosine), (across, away)) = ((TAU * u).sin_cos(), (TAU * v).sin_cos());
        Vec3::new(cosine, sine, 0.0) * (0.31 + 0.09 * away) + Vec3::Z * (0.09 * across)
    })
}

/// Returns the rod from the hook to the lattice, with a plate at its upper end.
fn chain() -> Mesh {
    let end = LATTICE - CHAIN;
    Mesh::default().lathe(
        &[[0.0, end - 0.03], [0.05, end], [0.014, end + 0.05], [0.014, -0.08], [0.12, -0.03], [0.12, 0.0]],
        20,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_instance_has_its_model() {
        let models = Models::new();
        for phase in [0.0, 0.3, 0.99] {
            assert_eq!(instances(phase).len() as u32, models.instance_count());
        }
        assert!(models.corners.iter().all(|corner| (*corner as usize) < models.vertices.len()));
    }

    #[test]
    fn a_round_has_no_seam() {
        let (first, last) = (instances(0.0), instances(1.0));
        for (number, (first, last)) in first.iter().zip(&last).enumerate() {
            // But for the lattice, which looks the same a fifth of a turn on.
            if number != 11 {
                let far = |(a, b): (&f32, &f32)| (a - b).abs() > 1e-4;
                let moved = first.rows.iter().zip(&last.rows).any(far);
                assert!(!moved, "{number}: {first:?} {last:?}");
            }
        }
    }

    #[test]
    fn objects_keep_away_from_the_lamp_and_inside_the_walls() {
        for phase in [0.0, 0.2, 0.4, 0.6, 0.8] {
            let [casters, _] = Models::new().triangles(phase);
            for at in casters.into_iter().flatten().map(Vec3::from) {
                assert!(at.distance(lamp(phase)) > NEAREST_BLOCKER, "{at}");
                assert!(at.x.abs() < ROOM[0] && at.y < ROOM[1] + 0.05 && at.z.abs() < ROOM[2], "{at}");
            }
        }
    }
}
