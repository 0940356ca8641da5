//! The constants that every shader of the sample reads, laid out as `shaders/rtx_ao/frame.glsl` has them.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use crate::scene::{GpuCamera, Scene};

/// Radius of the sun's disc at distance 1: four times the real one's.
const SUN_SPREAD: f32 = 0.018;
/// Sunlight of scenes that have no sun.
const NO_SUN: ([f32; 3], [f32; 3]) = ([0.0, 1.0, 0.0], [0.0; 3]);

/// `Frame`.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(super) struct FrameConstants {
    pub(super) camera: GpuCamera,
    pub(super) bodies: u64,
    pub(super) sums: u64,
    pub(super) light: Lighting,
    pub(super) image: u32,
    pub(super) sampler: u32,
    pub(super) targets: TargetIndices,
    pub(super) pass: u32,
    pub(super) rays: u32,
    pub(super) lift: f32,
    pub(super) padding: u32,
}

/// The lights of a scene, and its TLAS.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Lighting {
    to_sun: [f32; 3],
    sun_spread: f32,
    sun_color: [f32; 3],
    radius: f32,
    ambient_above: [f32; 3],
    tlas: u32,
    ambient_below: [f32; 3],
}

/// Descriptor slots of the targets as textures; 0 for targets that a path does not draw.
#[derive(Clone, Copy, Default, Pod, Zeroable)]
#[repr(C)]
pub(super) struct TargetIndices {
    pub(super) albedo: u32,
    pub(super) light: u32,
    pub(super) position: u32,
    pub(super) normal: u32,
    pub(super) geometric: u32,
}

/// Push constants of a draw.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Push {
    pub(super) frame: u64,
    pub(super) body: u32,
    pub(super) padding: u32,
}

impl Push {
    pub(super) fn new(frame: u64, body: u32) -> Self {
        Self { frame, body, padding: 0 }
    }
}

impl Lighting {
    pub(super) fn radius(&self) -> f32 {
        self.radius
    }

    pub(super) fn new(scene: &Scene, radius: f32, tlas: u32) -> Self {
        let (to_sun, sun_color) = scene.sun.as_ref().map_or(NO_SUN, |sun| (sun.direction, sun.color));
        Self {
            to_sun: Vec3::from(to_sun).normalize_or(Vec3::Y).into(),
            sun_spread: SUN_SPREAD,
            sun_color,
            radius,
            ambient_above: scene.ambient.above,
            tlas,
            ambient_below: scene.ambient.below,
        }
    }
}

const _: () = assert!(std::mem::offset_of!(FrameConstants, image) == 172);
