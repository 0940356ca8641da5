//! The constants that every shader of the sample reads, laid out as `shaders/hybrid_oit/frame.glsl` has them.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use super::scene::{Motion, OitScene};
use crate::scene::GpuCamera;

/// Addresses of the buffers (the middle of `Frame`).
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Addresses {
    pub(super) motions: u64,
    pub(super) spheres: u64,
    pub(super) faces: u64,
    pub(super) positions: u64,
    pub(super) blocks: u64,
    pub(super) boxes: u64,
    pub(super) records: u64,
    pub(super) heads: u64,
    pub(super) node_count: u64,
    pub(super) nodes: u64,
    pub(super) glass_light: u64,
}

/// Counts and bindless indices (the tail of `Frame`).
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Numbers {
    pub(super) ball_count: u32,
    pub(super) glass_count: u32,
    pub(super) block_count: u32,
    pub(super) node_capacity: u32,
    pub(super) shadow_rays: u32,
    pub(super) supersampling: u32,
    pub(super) tlas: u32,
    pub(super) gbuffer_position: u32,
    pub(super) gbuffer_surface: u32,
    pub(super) shadow_image: u32,
    pub(super) shadow_texture: u32,
    pub(super) output: u32,
}

/// The whole block (`Frame` in `shaders/hybrid_oit/frame.glsl`).
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct FrameConstants {
    camera: GpuCamera,
    sun_direction: [f32; 3],
    sun_radius: f32,
    sun_color: [f32; 3],
    offset_extent: f32,
    addresses: Addresses,
    numbers: Numbers,
}

/// The push constants: where the block is, and the time in seconds.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Push {
    pub(super) frame: u64,
    pub(super) time: f32,
    pub(super) padding: u32,
}

/// Motion and colour of a sphere (`Motion` in the shaders).
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(super) struct GpuMotion {
    anchor: [f32; 3],
    radius: f32,
    color: [f32; 3],
    height: f32,
    orbit: [f32; 2],
    orbit_rate: f32,
    orbit_phase: f32,
    height_phase: f32,
    height_rate: f32,
}

/// Distance of the near plane in scene units.
const NEAR_PLANE: f32 = 0.1;
/// Coordinates near the origin are as exact as those of this size: that of the things around it.
const OFFSET_EXTENT: f32 = 1.0;

impl FrameConstants {
    /// The constants for a raster of `extent` samples.
    pub(super) fn new(scene: &OitScene, extent: [u32; 2], addresses: Addresses, numbers: Numbers) -> Self {
        Self {
            camera: GpuCamera::new(&scene.camera, extent[0], extent[1], NEAR_PLANE),
            sun_direction: scene.sun.direction.normalize_or(Vec3::Y).to_array(),
            sun_radius: scene.sun.radius,
            sun_color: scene.sun.color.to_array(),
            offset_extent: OFFSET_EXTENT,
            addresses,
            numbers,
        }
    }
}

impl GpuMotion {
    fn new(motion: &Motion, radius: f32, color: Vec3) -> Self {
        Self {
            anchor: motion.anchor.to_array(),
            radius,
            color: color.to_array(),
            height: motion.height,
            orbit: motion.orbit.to_array(),
            orbit_rate: motion.orbit_rate,
            orbit_phase: motion.orbit_phase,
            height_phase: motion.height_phase,
            height_rate: motion.height_rate,
        }
    }

    /// Returns the data of all spheres: balls first, then glass.
    pub(super) fn of_scene(scene: &OitScene) -> Vec<Self> {
        let balls = scene.balls.iter().map(|ball| Self::new(&ball.motion, ball.radius, ball.albedo));
        let glass =
            scene.glass.iter().map(|glass| Self::new(&glass.motion, glass.radius, glass.absorption()));
        balls.chain(glass).collect()
    }
}

#[cfg(test)]
mod tests {
    use std::mem::offset_of;

    use super::*;

    #[test]
    fn the_layout_is_the_shaders_scalar_one() {
        assert_eq!(size_of::<GpuMotion>(), 56);
        assert_eq!(size_of::<Push>(), 16);
        assert_eq!(offset_of!(FrameConstants, addresses), 128);
        assert_eq!(offset_of!(FrameConstants, numbers), 216);
        assert_eq!(size_of::<FrameConstants>(), 264);
    }
}
