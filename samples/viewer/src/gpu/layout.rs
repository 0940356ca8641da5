//! Structs that shaders read, laid out as `shaders/viewer/frame.glsl` has them.

use bytemuck::{Pod, Zeroable};
use lvk::BlockLayout;
use lvk_samples::scene::GpuCamera;

/// Index of a texture slot that is not there (`kNoTexture`).
pub(crate) const NO_TEXTURE: u32 = u32::MAX;

/// Surfaces of a path at most that update the radiance cache (`kMostUpdates`).
const MOST_UPDATES: usize = 4;

/// A bit of flags, if it is set.
pub(crate) fn flag_if(is_set: bool, flag: u32) -> u32 {
    if is_set { flag } else { 0 }
}

/// Bits of `Geometry.flags`.
pub(crate) mod geometry_flag {
    /// Positions are `Snorm16x4`.
    pub(crate) const QUANTISED: u32 = 1;
    pub(crate) const SINGLE_SIDED: u32 = 2;
    pub(crate) const MIXED_SIDES: u32 = 4;
}

/// Bits of `Material.flags`.
pub(crate) mod material_flag {
    pub(crate) const ALPHA_MASK: u32 = 1;
    pub(crate) const ALPHA_BLEND: u32 = 2;
    pub(crate) const UNLIT: u32 = 8;
    pub(crate) const THIN: u32 = 16;
    pub(crate) const TANGENTS: u32 = 32;
    pub(crate) const EXTENSIONS: u32 = 64;
}

/// Places in `Material.slots`.
pub(crate) mod slot {
    pub(crate) const BASE_COLOR: usize = 0;
    pub(crate) const METAL_ROUGH: usize = 1;
    pub(crate) const NORMAL: usize = 2;
    pub(crate) const EMISSION: usize = 3;
    pub(crate) const TRANSMISSION: usize = 4;
    pub(crate) const SPECULAR: usize = 5;
    pub(crate) const SPECULAR_COLOR: usize = 6;
    pub(crate) const COAT: usize = 7;
    pub(crate) const COAT_ROUGHNESS: usize = 8;
    pub(crate) const SHEEN_COLOR: usize = 9;
    pub(crate) const SHEEN_ROUGHNESS: usize = 10;
    pub(crate) const COAT_NORMAL: usize = 11;
    pub(crate) const ANISOTROPY: usize = 12;
    pub(crate) const FILM: usize = 13;
    pub(crate) const FILM_THICKNESS: usize = 14;
    pub(crate) const COUNT: usize = 15;
}

/// Values of `Light.kind`.
pub(crate) mod light_kind {
    pub(crate) const DISC: u32 = 0;
    pub(crate) const POINT: u32 = 1;
    pub(crate) const SPOT: u32 = 2;
}

lvk::shader_struct! {
    /// `Instance`.
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct GpuInstance {
        pub(crate) rows: [f32; 12],
        pub(crate) normal_columns: [f32; 9],
        pub(crate) first_geometry: u32,
    }

    /// `Geometry`.
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct GpuGeometry {
        pub(crate) positions: u64,
        pub(crate) positions_before: u64,
        pub(crate) attributes: u64,
        pub(crate) indices: u64,
        pub(crate) material: u32,
        pub(crate) flags: u32,
        pub(crate) emission_weight: f32,
        pub(crate) _padding: u32,
    }

    /// `MeshRun`.
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct GpuMeshRun {
        pub(crate) middle: [f32; 3],
        pub(crate) first_instance: u32,
        pub(crate) extent: [f32; 3],
        pub(crate) instance_count: u32,
        pub(crate) first_draw: u32,
        pub(crate) draw_count: u32,
    }

    /// `Emitter`.
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct GpuEmitter {
        pub(crate) instance: u32,
        pub(crate) geometry: u32,
        pub(crate) primitive: u32,
        pub(crate) chance: f32,
    }

    /// `Attributes`.
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct GpuAttributes {
        pub(crate) normal: u32,
        pub(crate) tangent: u32,
        pub(crate) texcoords: [[f32; 2]; 2],
        pub(crate) color: u32,
    }

    /// `TextureSlot`.
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct GpuTextureSlot {
        pub(crate) tex: u32,
        pub(crate) sampler as smp: u32,
        pub(crate) set: u32,
        pub(crate) image: u32,
        pub(crate) first_mip: u32,
        pub(crate) extent: [u32; 2],
        pub(crate) columns: [f32; 4],
        pub(crate) offset: [f32; 2],
    }

    /// `Material`.
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct GpuMaterial {
        pub(crate) base_color: [f32; 4],
        pub(crate) emission: [f32; 3],
        pub(crate) metalness: f32,
        pub(crate) extinction: [f32; 3],
        pub(crate) roughness: f32,
        pub(crate) specular_color: [f32; 3],
        pub(crate) specular: f32,
        pub(crate) sheen_color: [f32; 3],
        pub(crate) sheen_roughness: f32,
        pub(crate) transmission: f32,
        pub(crate) ior: f32,
        pub(crate) alpha_cutoff: f32,
        pub(crate) normal_scale: f32,
        pub(crate) coat: f32,
        pub(crate) coat_roughness: f32,
        pub(crate) coat_normal_scale: f32,
        pub(crate) anisotropy: f32,
        pub(crate) anisotropy_direction: [f32; 2],
        pub(crate) film: f32,
        pub(crate) film_ior: f32,
        pub(crate) film_thickness: [f32; 2],
        pub(crate) flags: u32,
        pub(crate) slots: [u32; slot::COUNT],
    }

    /// `Light`.
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct GpuLight {
        pub(crate) position: [f32; 3],
        pub(crate) kind: u32,
        pub(crate) color: [f32; 3],
        pub(crate) probability: f32,
        pub(crate) direction: [f32; 3],
        pub(crate) cone: f32,
        pub(crate) cos_inner: f32,
        pub(crate) range: f32,
    }

    /// `Path`.
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct GpuPath {
        pub(crate) origin: [f32; 3],
        pub(crate) direction: [f32; 3],
        pub(crate) density: f32,
        pub(crate) from: [f32; 3],
        pub(crate) extinction: [f32; 3],
        pub(crate) squeezed: f32,
        pub(crate) spread: f32,
        pub(crate) width: f32,
        pub(crate) bounce: u32,
        pub(crate) ray_count: u32,
        pub(crate) throughput: [f32; 3],
        pub(crate) radiance: [f32; 3],
    }

    /// `StoredPath`.
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct GpuStoredPath {
        pub(crate) path: GpuPath,
        pub(crate) pair: u32,
    }

    /// `CacheCell`.
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct GpuCacheCell {
        pub(crate) mean: [f32; 3],
        pub(crate) samples: f32,
        pub(crate) idle: u32,
    }

    /// `CacheUpdate`.
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct GpuCacheUpdate {
        pub(crate) entry: u32,
        pub(crate) light: [f32; 3],
        pub(crate) factor: [f32; 3],
    }

    /// `UpdatingPath`.
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct GpuUpdatingPath {
        pub(crate) count: u32,
        pub(crate) updates: [GpuCacheUpdate; MOST_UPDATES],
    }

    /// `Frame`: addresses of the radiance cache.
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct CacheAddresses {
        pub(crate) keys as cacheKeys: u64,
        pub(crate) sums as cacheSums: u64,
        pub(crate) cells as cacheCells: u64,
        pub(crate) updating_paths: u64,
    }

    /// `Frame`: what culling reads and writes.
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct CullingConstants {
        pub(crate) runs: u64,
        pub(crate) visible: u64,
        pub(crate) draw_arguments: u64,
        pub(crate) drawn_counts: u64,
        pub(crate) was_visible: u64,
    }

    /// `VisibleTargets`.
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct VisibleTargets {
        pub(crate) triangles: u32,
        pub(crate) depth: u32,
    }

    /// `Frame`: visible surfaces.
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct VisibilityConstants {
        pub(crate) visible1: VisibleTargets,
        pub(crate) visible2: VisibleTargets,
        pub(crate) pyramid: u64,
    }

    /// `Frame`: what leads to the scene, the same in every frame.
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct SceneConstants {
        pub(crate) instances: u64,
        pub(crate) rows_before: u64,
        pub(crate) geometries: u64,
        pub(crate) materials: u64,
        pub(crate) slots: u64,
        pub(crate) lights: u64,
        pub(crate) emitters: u64,
        pub(crate) sky_rows: u64,
        pub(crate) sky_columns: u64,
        pub(crate) sky: u64,
        pub(crate) albedos: u64,
        pub(crate) culling: CullingConstants,
    }

    /// `Frame`: light.
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct LightConstants {
        pub(crate) light_count: u32,
        pub(crate) disc_count: u32,
        pub(crate) sky_probability: f32,
        pub(crate) sky_size: [u32; 2],
    }

    /// `Frame`: light of triangles.
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct EmissionConstants {
        pub(crate) emitter_count: u32,
        pub(crate) emitter_probability: f32,
        pub(crate) emitter_power: f32,
    }

    /// `Frame`: the ambient term.
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct AmbientConstants {
        pub(crate) lamp_irradiance: [f32; 3],
        pub(crate) unoccluded_irradiance: [f32; 3],
        pub(crate) box_min: [f32; 3],
        pub(crate) box_max: [f32; 3],
    }

    /// `Frame`.
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct FrameConstants {
        pub(crate) camera: GpuCamera,
        pub(crate) scene: SceneConstants,
        pub(crate) sums: u64,
        pub(crate) light: LightConstants,
        pub(crate) tlas: u32,
        pub(crate) image: u32,
        pub(crate) sample_number: u32,
        pub(crate) pixel_count: u32,
        pub(crate) max_bounces: u32,
        pub(crate) exposure: f32,
        pub(crate) offset_extent: f32,
        pub(crate) tone_mapping: u32,
        pub(crate) frame_number: u32,
        pub(crate) seen: GpuCamera,
        pub(crate) seen_before: GpuCamera,
        pub(crate) visibility: VisibilityConstants,
        pub(crate) planes: u64,
        pub(crate) path_lists: u64,
        pub(crate) paths: u64,
        pub(crate) cache: CacheAddresses,
        pub(crate) wanted_mips: u64,
        pub(crate) ambient_sums: u64,
        pub(crate) still_count: u32,
        pub(crate) view: u32,
        pub(crate) scene_moves: u32,
        pub(crate) emission: EmissionConstants,
        pub(crate) cache_buckets: u32,
        pub(crate) cell_share: f32,
        pub(crate) ambient: AmbientConstants,
        pub(crate) occlusion_distance: f32,
        pub(crate) light_turns: u32,
    }

    /// `PushConstants`.
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct Push {
        pub(crate) frame: u64,
        pub(crate) argument: u32,
        pub(crate) _padding: u32,
    }

    /// `PushConstants` of a draw.
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct DrawPush {
        pub(crate) frame: u64,
        pub(crate) argument: u32,
        pub(crate) first_visible: u32,
    }
}

/// Value of `Push::argument` of `cull.comp.glsl`: the instances that are left.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub(crate) enum CullingStep {
    /// All in the frustum.
    Frustum = 0,
    /// Those of them that the frame before has found visible.
    LastVisible = 1,
    /// Those of the others that the depth pyramid does not hide.
    Pyramid = 2,
}

impl VisibleTargets {
    /// Those of a pass that is not there.
    pub(crate) const NONE: Self = Self { triangles: NO_TEXTURE, depth: NO_TEXTURE };
}

impl VisibilityConstants {
    /// Those without a rasteriser.
    pub(crate) const NONE: Self =
        Self { visible1: VisibleTargets::NONE, visible2: VisibleTargets::NONE, pyramid: 0 };
}

/// Value of `DrawPush::first_visible` without culling.
pub(crate) const ALL_INSTANCES: u32 = u32::MAX;

/// Layouts that the pipeline of the radiance cache compares with its shader.
pub(crate) const CACHE_LAYOUTS: &[BlockLayout] = &[
    BlockLayout::buffer_reference::<FrameConstants>("Frame"),
    BlockLayout::buffer_reference::<GpuCacheCell>("CellArray"),
];

/// The layout that pipelines compare with their shaders which read the frame alone.
pub(crate) const FRAME_LAYOUT: &[BlockLayout] = &[BlockLayout::buffer_reference::<FrameConstants>("Frame")];

/// Layouts that the pipeline of culling compares with its shader.
pub(crate) const CULLING_LAYOUTS: &[BlockLayout] = &[
    BlockLayout::buffer_reference::<FrameConstants>("Frame"),
    BlockLayout::buffer_reference::<GpuInstance>("InstanceArray"),
    BlockLayout::buffer_reference::<GpuMeshRun>("MeshRunArray"),
];

/// Layouts that pipelines compare with their shaders which read the scene.
pub(crate) const SCENE_LAYOUTS: &[BlockLayout] = &[
    BlockLayout::buffer_reference::<FrameConstants>("Frame"),
    BlockLayout::buffer_reference::<GpuInstance>("InstanceArray"),
    BlockLayout::buffer_reference::<GpuGeometry>("GeometryArray"),
    BlockLayout::buffer_reference::<GpuAttributes>("AttributesArray"),
    BlockLayout::buffer_reference::<GpuTextureSlot>("SlotArray"),
    BlockLayout::buffer_reference::<GpuMaterial>("MaterialArray"),
    BlockLayout::buffer_reference::<GpuLight>("LightArray"),
    BlockLayout::buffer_reference::<GpuEmitter>("EmitterArray"),
    BlockLayout::buffer_reference::<GpuStoredPath>("StoredPathArray"),
    BlockLayout::buffer_reference::<GpuCacheCell>("CellArray"),
    BlockLayout::buffer_reference::<GpuUpdatingPath>("UpdatingPathArray"),
];
