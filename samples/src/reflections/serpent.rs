//! The animated character: a serpent that swims through the air around the basin, a skin over a chain of bones.

use std::f32::consts::TAU;

use bytemuck::{Pod, Zeroable};
use glam::{Affine3A, Mat3A, Vec3, Vec3A};
use lvk::transform_rows;

use crate::shapes::Mesh;

/// Bones of the chain, from the neck to the tip of the tail.
const BONE_COUNT: usize = 40;
/// Distance from bone to bone, in scene units.
const BONE_LENGTH: f32 = 0.22;
/// Length of the body.
const LENGTH: f32 = BONE_LENGTH * (BONE_COUNT - 1) as f32;
/// Middle of the path, in scene units.
const MIDDLE: Vec3 = Vec3::new(0.0, 1.5, -8.2);
/// Half of the path's extent across and along the hall.
const REACH: [f32; 2] = [2.5, 6.6];

/// A vertex at rest (`RestVertex` in `shaders/reflections/skin.comp.glsl`).
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct RestVertex {
    pub(super) position: [f32; 3],
    pub(super) normal: [f32; 3],
    /// First and second bone.
    pub(super) bones: [u16; 2],
    /// Weight of the second bone.
    pub(super) weight: f32,
}

/// A mesh for each material; at rest the serpent lies along z, its head at 0 and its tail towards +z.
pub(super) struct Skin {
    /// Back, belly, fins and horns, eyes.
    pub(super) parts: [Mesh; 4],
}

impl Skin {
    pub(super) fn new() -> Self {
        let body = |from: f32, to: f32, segments| {
            Mesh::default().grid(segments, 180, move |u, v| {
                let (sine, cosine) = (from + (to - from) * u).to_radians().sin_cos();
                let along = LENGTH * v;
                let girth = girth(along);
                Vec3::new(girth * cosine, 0.92 * girth * sine, along)
            })
        };
        let head = Vec3::new(0.0, 0.1, -0.26);
        let mut back = body(215.0, -35.0, 20).ball(head, Vec3::new(0.34, 0.27, 0.46), 24).ball(
            head + Vec3::new(0.0, -0.02, -0.3),
            Vec3::new(0.16, 0.11, 0.26),
            20,
        );
        let belly =
            body(325.0, 215.0, 10).ball(head + Vec3::new(0.0, -0.11, -0.2), Vec3::new(0.15, 0.07, 0.32), 16);
        let mut eyes = Mesh::default();
        let mut fins = Mesh::default();
        for side in [-1.0, 1.0] {
            eyes = eyes.ball(head + Vec3::new(0.23 * side, 0.13, -0.28), Vec3::splat(0.065), 24);
            let pupil = head + Vec3::new(0.278 * side, 0.137, -0.295);
            back = back.ball(pupil, Vec3::new(0.02, 0.046, 0.016), 12);
            fins = fins.ball(head + Vec3::new(0.17 * side, 0.27, 0.26), Vec3::new(0.045, 0.06, 0.4), 12);
        }
        for number in 0..26 {
            let along = 0.5 + number as f32 * 0.29;
            let size = 0.45 + 0.55 * (std::f32::consts::PI * along / LENGTH).sin();
            let place = Vec3::new(0.0, 0.9 * girth(along), along);
            fins = fins.ball(place, Vec3::new(0.018, 0.2 * size, 0.13 * size), 10);
        }
        Self { parts: [back, belly, fins, eyes] }
    }

    /// The vertices of all parts, one after the other.
    pub(super) fn rest_vertices(&self) -> Vec<RestVertex> {
        self.parts
            .iter()
            .flat_map(|part| &part.vertices)
            .map(|v| {
                let place = (v.position.z / BONE_LENGTH).clamp(0.0, (BONE_COUNT - 1) as f32);
                let first = (place as u16).min(BONE_COUNT as u16 - 2);
                RestVertex {
                    position: v.position.to_array(),
                    normal: v.normal.to_array(),
                    bones: [first, first + 1],
                    weight: place - f32::from(first),
                }
            })
            .collect()
    }
}

/// Transforms of the bones at `phase` of the round, 0 to 1, in which the serpent swims around the basin once: from the
/// mesh at rest to the world, 3 rows of 4 columns each.
pub(super) fn bones(phase: f32) -> Vec<[f32; 12]> {
    let mut parameter = -0.3 - TAU * phase;
    let mut bones = Vec::with_capacity(BONE_COUNT);
    for bone in 0..BONE_COUNT {
        let speed = velocity(parameter, phase);
        bones.push(transform_rows(&bone_transform(parameter, phase, bone as f32 * BONE_LENGTH)));
        parameter += BONE_LENGTH / speed.length();
    }
    bones
}

fn bone_transform(parameter: f32, phase: f32, along: f32) -> Affine3A {
    let forward = Vec3A::from(-velocity(parameter, phase).normalize());
    let right = forward.cross(Vec3A::Y).normalize();
    let frame = Mat3A::from_cols(right, right.cross(forward), -forward);
    let to_joint = Affine3A::from_translation(Vec3::new(0.0, 0.0, -along));
    Affine3A { matrix3: frame, translation: path(parameter, phase).into() } * to_joint
}

/// The serpent's middle line: a ring around the basin that undulates.
fn path(parameter: f32, phase: f32) -> Vec3 {
    let (sine, cosine) = parameter.sin_cos();
    let sway = 0.28 * (7.0 * parameter + 2.0 * TAU * phase).sin();
    let rise = 0.45 * (3.0 * parameter).sin() + 0.06 * (8.0 * parameter + 3.0 * TAU * phase).cos();
    MIDDLE + Vec3::new((REACH[0] + sway) * sine, rise, REACH[1] * cosine)
}

fn velocity(parameter: f32, phase: f32) -> Vec3 {
    const STEP: f32 = 1e-2;
    (path(parameter + STEP, phase) - path(parameter - STEP, phase)) / (2.0 * STEP)
}

fn girth(along: f32) -> f32 {
    let share = (along / LENGTH).clamp(0.0, 1.0);
    let tail = (1.0 - share).powf(0.6);
    0.02 + (0.21 + 0.11 * (std::f32::consts::PI * (share * 1.6).min(1.0)).sin()) * tail
}

#[cfg(test)]
mod tests {
    use super::*;

    fn joints(phase: f32) -> Vec<Vec3> {
        let joint = |(bone, rows): (usize, &[f32; 12])| {
            let along = bone as f32 * BONE_LENGTH;
            let at = |row: usize| rows[4 * row + 2] * along + rows[4 * row + 3];
            Vec3::new(at(0), at(1), at(2))
        };
        bones(phase).iter().enumerate().map(joint).collect()
    }

    #[test]
    fn bones_hang_together_and_move() {
        for phase in (0..50).map(|step| step as f32 / 50.0) {
            let joints = joints(phase);
            for pair in joints.windows(2) {
                let length = pair[0].distance(pair[1]);
                assert!((length - BONE_LENGTH).abs() < 0.1 * BONE_LENGTH, "{phase}: {length}");
            }
            assert!(joints.iter().all(|joint| joint.y > 0.6), "above water and floor");
        }
        assert_ne!(bones(0.0), bones(1.0 / 240.0));
    }

    #[test]
    fn a_round_has_no_seam() {
        let way = |from: f32, to: f32| {
            let (from, to) = (joints(from), joints(to));
            from.iter().zip(&to).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max)
        };
        assert!(way(1.0, 0.0) < 1e-3, "{}", way(1.0, 0.0));
        let (step, last) = (way(0.0, 1.0 / 240.0), way(239.0 / 240.0, 0.0));
        assert!(step > 0.05 && (last - step).abs() < 0.2 * step, "{step} {last}");
    }

    #[test]
    fn weights_are_shares_between_neighbouring_bones() {
        for vertex in Skin::new().rest_vertices() {
            assert_eq!(vertex.bones[1], vertex.bones[0] + 1);
            assert!(usize::from(vertex.bones[1]) < BONE_COUNT && (0.0..=1.0).contains(&vertex.weight));
        }
    }
}
