//! The constants that every shader of the sample reads, laid out as `shaders/reflections/frame.glsl` has them.

use bytemuck::{Pod, Zeroable};

use super::scene::Light;
use crate::scene::GpuCamera;

/// Lights that the shaders have room for: channels of a texture, beside the one for openness.
const MOST_LIGHTS: usize = 3;
/// Distance of the near plane in scene units.
pub(super) const NEAR_PLANE: f32 = 0.05;

/// `Light` in `shaders/reflections/frame.glsl`.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct LightConstants {
    position: [f32; 3],
    radius: f32,
    color: [f32; 3],
    spread: f32,
}

/// The gpu_scene of the world, and its light: the same in every frame.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct WorldConstants {
    pub(super) materials: u64,
    pub(super) geometries: u64,
    pub(super) instances: u64,
    pub(super) lights: [LightConstants; MOST_LIGHTS],
    pub(super) harmonics: [[f32; 3]; 9],
    pub(super) light_count: u32,
}

/// Bindless indices.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Indices {
    pub(super) tlas: u32,
    pub(super) sky: u32,
    pub(super) sky_sampler: u32,
    pub(super) surface_sampler: u32,
    pub(super) opaque_surface: u32,
    pub(super) opaque_depth: u32,
    pub(super) glass_surface: u32,
    pub(super) glass_depth: u32,
    pub(super) visibility: u32,
    pub(super) smoothed: u32,
    pub(super) penumbra: u32,
    pub(super) reflection: u32,
    pub(super) filtered: u32,
    pub(super) glass_reflection: u32,
    pub(super) composite: u32,
    pub(super) picture: u32,
    pub(super) padding: u32,
}

/// The whole block.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct FrameConstants {
    pub(super) view: GpuCamera,
    pub(super) world: WorldConstants,
    pub(super) frame_number: u32,
    pub(super) sample_number: u32,
    pub(super) phase: f32,
    pub(super) indices: Indices,
}

const _: () = assert!(std::mem::offset_of!(FrameConstants, frame_number) == 328);

/// The push constants of all passes but the skinning.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Push {
    pub(super) frame: u64,
    pub(super) arguments: [u32; 4],
}

/// The lights for the shaders, without those beyond the capacity.
pub(super) fn light_constants(lights: &[Light]) -> ([LightConstants; MOST_LIGHTS], u32) {
    let mut all = [LightConstants::zeroed(); MOST_LIGHTS];
    for (constants, light) in all.iter_mut().zip(lights) {
        let Light { position, radius, color, spread } = *light;
        *constants = LightConstants { position, radius, color, spread };
    }
    (all, lights.len().min(MOST_LIGHTS) as u32)
}

/// An address in two words, as push constants carry it.
pub(super) fn words(address: u64) -> [u32; 2] {
    [address as u32, (address >> 32) as u32]
}
