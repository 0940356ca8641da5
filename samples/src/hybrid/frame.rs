//! The constants that every shader of the sample reads, laid out as `shaders/hybrid/frame.glsl` has them.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use crate::scene::{Camera, Scene};

/// Bytes by which the shaders know a camera (`shaders/common/camera.glsl`).
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct GpuCamera {
    eye: [f32; 3],
    near_plane: f32,
    forward: [f32; 3],
    pixel_spread: f32,
    right: [f32; 3],
    width: u32,
    down: [f32; 3],
    height: u32,
    clip_right: [f32; 3],
    padding0: f32,
    clip_down: [f32; 3],
    padding1: f32,
}

impl GpuCamera {
    /// The camera of a picture of `width` times `height` pixels. `near_plane` is in scene units.
    pub(crate) fn new(camera: &Camera, width: u32, height: u32, near_plane: f32) -> Self {
        let [right, up, forward] = camera.frame().map(Vec3::from);
        let half_height = (0.5 * camera.vertical_fov_degrees.to_radians()).tan();
        let right = right * (half_height * width as f32 / height as f32);
        let down = -up * half_height;
        Self {
            eye: camera.eye,
            near_plane,
            forward: forward.to_array(),
            pixel_spread: 2.0 * half_height / height as f32,
            right: right.to_array(),
            width,
            down: down.to_array(),
            height,
            clip_right: (right / right.length_squared()).to_array(),
            padding0: 0.0,
            clip_down: (down / down.length_squared()).to_array(),
            padding1: 0.0,
        }
    }
}

/// Addresses of a scene's arrays (`Scene` in `shaders/common/scene_buffers.glsl`).
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct SceneAddresses {
    pub(super) positions: u64,
    pub(super) normals: u64,
    pub(super) texcoords: u64,
    pub(super) triangles: u64,
    pub(super) triangle_infos: u64,
    pub(super) materials: u64,
}

/// A light (`Light` in `shaders/common/scene_buffers.glsl`).
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct GpuLight {
    position: [f32; 3],
    is_distant: f32,
    color: [f32; 3],
    reach: f32,
}

/// Lights and the like, which do not change with the camera.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Lighting {
    lights: [GpuLight; 2],
    ambient_above: [f32; 3],
    light_count: u32,
    ambient_below: [f32; 3],
    offset_extent: f32,
}

impl Lighting {
    /// The lamp and, where there is one, the sun of `scene`.
    pub(super) fn new(scene: &Scene) -> Self {
        let lamp = &scene.light;
        let mut lights = [GpuLight::zeroed(); 2];
        lights[0] =
            GpuLight { position: lamp.position, is_distant: 0.0, color: lamp.color, reach: lamp.reach };
        if let Some(sun) = &scene.sun {
            lights[1] = GpuLight { position: sun.direction, is_distant: 1.0, color: sun.color, reach: 1.0 };
        }
        Self {
            lights,
            ambient_above: scene.ambient.above,
            light_count: 1 + u32::from(scene.sun.is_some()),
            ambient_below: scene.ambient.below,
            offset_extent: offset_extent(scene),
        }
    }

    /// Puts the lamp somewhere else.
    pub(super) fn move_lamp(&mut self, position: [f32; 3]) {
        self.lights[0].position = position;
    }
}

/// Bindless indices (the tail of `Frame` in `shaders/hybrid/frame.glsl`).
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Indices {
    pub(super) tlas: u32,
    pub(super) sky: u32,
    pub(super) surface_sampler: u32,
    pub(super) sky_sampler: u32,
    pub(super) output: u32,
    pub(super) gbuffer_position: u32,
    pub(super) gbuffer_surface: u32,
    pub(super) gbuffer_albedo: u32,
}

/// Addresses and indices of the visibility pass (`Visibility` in `shaders/hybrid/visibility.glsl`).
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct VisibilityPlaces {
    pub(super) words: u64,
    pub(super) tile_queue: u64,
    pub(super) survivor_bits: u64,
    pub(super) survivor_counts: u64,
    pub(super) survivor_indices: u64,
    pub(super) survivors: u64,
    pub(super) draw: u64,
    pub(super) image: u32,
    pub(super) triangle_count: u32,
}

/// The whole block (`Frame` in `shaders/hybrid/frame.glsl`).
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct FrameConstants {
    pub(super) camera: GpuCamera,
    pub(super) scene: SceneAddresses,
    pub(super) lighting: Lighting,
    pub(super) indices: Indices,
    pub(super) visibility: VisibilityPlaces,
}

/// The push constants: where the block is, and which rows of the image to render.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Push {
    pub(super) frame: u64,
    pub(super) first_row: u32,
    pub(super) end_row: u32,
}

/// Distance of the near plane in scene units: small against the scene, but not so small that depth suffers.
pub(super) fn near_plane(scene: &Scene) -> f32 {
    let (low, high) = scene.bounds();
    (Vec3::from(high).distance(Vec3::from(low)) * 1e-4).max(f32::MIN_POSITIVE)
}

/// The extent in scene units that a hit point's rounding error is measured by near the origin, where its own
/// coordinates say nothing about those of the triangle.
fn offset_extent(scene: &Scene) -> f32 {
    let (low, high) = scene.bounds();
    let largest = low.iter().chain(&high).fold(0.0_f32, |largest, c| largest.max(c.abs()));
    largest / 8.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Camera {
        Camera::looking_at([1.0, 2.0, 3.0], [4.0, 1.0, -2.0], 60.0)
    }

    fn direction(camera: &GpuCamera, ndc: [f32; 2]) -> Vec3 {
        Vec3::from(camera.forward) + ndc[0] * Vec3::from(camera.right) + ndc[1] * Vec3::from(camera.down)
    }

    #[test]
    fn rays_and_clip_space_agree() {
        let gpu = GpuCamera::new(&camera(), 1280, 720, 0.1);
        for ndc in [[0.0, 0.0], [0.7, -0.3], [-1.0, 1.0]] {
            let offset = 3.5 * direction(&gpu, ndc);
            let w = offset.dot(Vec3::from(gpu.forward));
            assert!((offset.dot(Vec3::from(gpu.clip_right)) / w - ndc[0]).abs() < 1e-5);
            assert!((offset.dot(Vec3::from(gpu.clip_down)) / w - ndc[1]).abs() < 1e-5);
        }
    }

    #[test]
    fn rays_and_the_scenes_own_matrices_agree() {
        let gpu = GpuCamera::new(&camera(), 1280, 720, 0.1);
        let clip_from_world =
            camera().clip_from_view(1280.0 / 720.0, 0.1, 100.0) * camera().view_from_world();
        let point = Vec3::from(camera().eye) + 7.0 * direction(&gpu, [0.4, -0.8]);
        let clip = clip_from_world.project_point3(point);
        assert!((clip.x - 0.4).abs() < 1e-4 && (clip.y + 0.8).abs() < 1e-4, "{clip}");
    }

    #[test]
    fn the_layout_is_the_shaders_scalar_one() {
        assert_eq!(size_of::<GpuCamera>(), 96);
        assert_eq!(std::mem::offset_of!(FrameConstants, lighting), 144);
        assert_eq!(std::mem::offset_of!(FrameConstants, indices), 240);
        assert_eq!(std::mem::offset_of!(FrameConstants, visibility), 272);
        assert_eq!(size_of::<VisibilityPlaces>(), 64);
        assert_eq!(size_of::<Push>(), 16);
    }
}
