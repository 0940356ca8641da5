//! The constants that every shader of the sample reads, laid out as `shaders/hybrid/frame.glsl` has them.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use lvk::BlockLayout;

use crate::scene::{Ambient, DirectionalLight, GpuCamera, Scene};

/// A scene's largest coordinate over the extent that rounding errors near the origin are measured by.
const OFFSET_SHARE: f32 = 8.0;

lvk::shader_struct! {
    /// Addresses of a scene's arrays (`Scene` in `shaders/common/scene_buffers.glsl`).
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct SceneAddresses {
        pub(super) positions: u64,
        pub(super) normals: u64,
        pub(super) texcoords: u64,
        pub(super) triangles: u64,
        pub(super) triangle_infos: u64,
        pub(super) materials: u64,
        pub(super) colors: [u32; 2],
    }
}

lvk::shader_struct! {
    /// A light (`Light` in `shaders/common/scene_buffers.glsl`).
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(super) struct GpuLight {
        position: [f32; 3],
        is_distant: f32,
        color: [f32; 3],
        reach: f32,
    }
}

lvk::shader_struct! {
    /// Lights and the like, which do not change with the camera.
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct Lighting {
        lights: [GpuLight; 2],
        ambient_above: [f32; 3],
        light_count: u32,
        ambient_below: [f32; 3],
        offset_extent: f32,
    }
}

impl Lighting {
    /// The lamp and, where there is one, the sun of `scene`.
    pub(crate) fn new(scene: &Scene) -> Self {
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

    /// The sun alone, in a world whose largest coordinate is `farthest`.
    pub(crate) fn sunlit(sun: &DirectionalLight, ambient: &Ambient, farthest: f32) -> Self {
        let mut lights = [GpuLight::zeroed(); 2];
        lights[0] = GpuLight { position: sun.direction, is_distant: 1.0, color: sun.color, reach: 1.0 };
        Self {
            lights,
            ambient_above: ambient.above,
            light_count: 1,
            ambient_below: ambient.below,
            offset_extent: farthest / OFFSET_SHARE,
        }
    }

    /// Number of lights.
    pub(crate) fn light_count(&self) -> u32 {
        self.light_count
    }

    /// Keeps no more than the first `count` lights.
    pub(crate) fn with_lights(self, count: u32) -> Self {
        Self { light_count: self.light_count.min(count), ..self }
    }

    /// Puts the lamp somewhere else.
    pub(super) fn move_lamp(&mut self, position: [f32; 3]) {
        self.lights[0].position = position;
    }
}

lvk::shader_struct! {
    /// The members of `Frame` that samples share which trace rays in a lit scene (`shaders/common/scene_frame.glsl`).
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct SceneFrame {
        pub(crate) camera: GpuCamera,
        pub(crate) scene: SceneAddresses,
        pub(crate) lighting: Lighting,
        pub(crate) tlas: u32,
        pub(crate) sky: u32,
        pub(crate) surface_sampler: u32,
        pub(crate) sky_sampler: u32,
    }
}

lvk::shader_struct! {
    /// Bindless indices (the tail of `Frame` in `shaders/hybrid/frame.glsl`).
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(super) struct Indices {
        pub(super) tlas: u32,
        pub(super) sky: u32,
        pub(super) surface_sampler: u32,
        pub(super) sky_sampler: u32,
        pub(super) output as output_image: u32,
        pub(super) gbuffer_position: u32,
        pub(super) gbuffer_surface: u32,
        pub(super) gbuffer_albedo: u32,
    }
}

lvk::shader_struct! {
    /// Addresses and indices of the visibility pass (`Visibility` in `shaders/hybrid/visibility.glsl`).
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(super) struct VisibilityAddresses {
        pub(super) words: u64,
        pub(super) set_triangles: u64,
        pub(super) tiles: u64,
        pub(super) survivor_bits: u64,
        pub(super) survivor_counts: u64,
        pub(super) survivor_indices: u64,
        pub(super) survivors: u64,
        pub(super) draw: u64,
        pub(super) image: u32,
        pub(super) triangle_count: u32,
        pub(super) set_capacity: u32,
        pub(super) tile_capacity: u32,
    }
}

lvk::shader_struct! {
    /// Addresses of the queue of mirrors and glass (`ReflectivePixels` in `shaders/hybrid/reflective_pixels.glsl`).
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(super) struct ReflectivePixelAddresses {
        pub(super) head: u64,
        pub(super) pixels: u64,
    }
}

lvk::shader_struct! {
    /// The whole block (`Frame` in `shaders/hybrid/frame.glsl`).
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(super) struct FrameConstants {
        pub(super) camera: GpuCamera,
        pub(super) scene: SceneAddresses,
        pub(super) lighting: Lighting,
        pub(super) indices: Indices,
        pub(super) visibility: VisibilityAddresses,
        pub(super) bounces: ReflectivePixelAddresses,
        pub(super) order: u64,
        pub(super) sums: u64,
        pub(super) sample_number: u32,
        pub(super) sample_count: u32,
        pub(super) padding: [u32; 2],
    }
}

lvk::shader_struct! {
    /// The push constants: where the block is, and which rows of the image, or pixels in their order, to render.
    #[derive(Debug, Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(super) struct Push {
        pub(super) frame: u64,
        pub(super) first: u32,
        pub(super) end: u32,
    }
}

/// The layouts of both, for every pipeline of the sample.
pub(super) const LAYOUTS: &[BlockLayout] =
    &[BlockLayout::push_constants::<Push>(), BlockLayout::buffer_reference::<FrameConstants>("Frame")];

/// Distance of the near plane in scene units: small against the scene, but not so small that depth suffers.
pub(crate) fn near_plane(scene: &Scene) -> f32 {
    let (low, high) = scene.bounds();
    (Vec3::from(high).distance(Vec3::from(low)) * 1e-4).max(f32::MIN_POSITIVE)
}

/// The extent in scene units that a hit point's rounding error is measured by near the origin, where its own
/// coordinates say nothing about those of the triangle.
fn offset_extent(scene: &Scene) -> f32 {
    let (low, high) = scene.bounds();
    let largest = low.iter().chain(&high).fold(0.0_f32, |largest, c| largest.max(c.abs()));
    largest / OFFSET_SHARE
}
