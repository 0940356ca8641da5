//! What the device allows, in numbers.

use ash::vk;

use super::descriptor_limits::{DescriptorLimits, ReservedDescriptors};
use super::mesh_limits::MeshLimits;
use super::resolve_modes::{DepthResolveLimits, ResolveModes};
use super::shading_rate::ShadingRateLimits;

/// Top-level structures the library asks for where the device allows more.
const WANTED_TLAS: u32 = 256;

/// Limits of the device, in the unit of each name.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Limits {
    /// Most that the level of detail of a sampler can be biased, in either direction (`maxSamplerLodBias`).
    pub max_lod_bias: f32,
    /// Most samplers with a border colour of their own (`maxCustomBorderColorSamplers`).
    pub max_custom_borders: u32,
    /// Longest row, in texels (`maxImageDimension1D`).
    pub max_texture_1d: u32,
    /// Widest 2D texture, in texels a side (`maxImageDimension2D`).
    pub max_texture_2d: u32,
    /// Widest and deepest volume, in texels a side (`maxImageDimension3D`).
    pub max_texture_3d: u32,
    /// Widest cube texture, in texels a side (`maxImageDimensionCube`).
    pub max_texture_cube: u32,
    /// Most layers of a texture (`maxImageArrayLayers`).
    pub max_texture_layers: u32,
    /// Numbers of samples a pixel that colour targets may have, added up: 5 is 1 and 4 (`framebufferColorSampleCounts`).
    pub color_samples: u32,
    /// Those that depth targets may have (`framebufferDepthSampleCounts`).
    pub depth_samples: u32,
    /// Largest buffer in bytes (`maxBufferSize`).
    pub max_buffer_bytes: u64,
    /// Most memory of one buffer or texture, in bytes (`maxMemoryAllocationSize`).
    pub max_allocation_bytes: u64,
    /// Most bytes a shader reaches through one storage buffer descriptor (`maxStorageBufferRange`).
    pub max_storage_buffer_range: u64,
    /// Push constants in bytes (`maxPushConstantsSize`).
    pub max_push_constant_bytes: u32,
    /// Most colour targets of a render pass (`maxColorAttachments`).
    pub max_color_targets: u32,
    /// Targets of a pass that its own fragment shaders can read: of these, depth is the first, and colour targets follow in
    /// their order; stencil is the tenth (`maxPerStageDescriptorInputAttachments`). 0 without
    /// [`OptionalFeature::LocalRead`](crate::OptionalFeature::LocalRead).
    pub max_input_attachments: u32,
    /// Largest width and height of a texture that render passes draw to, in pixels (`maxFramebufferWidth`,
    /// `maxFramebufferHeight`).
    pub max_target_size: [u32; 2],
    /// Most layers of a render pass (`maxFramebufferLayers`).
    pub max_target_layers: u32,
    /// Most views of a render pass that draws several at once (`maxMultiviewViewCount`).
    pub max_views: u32,
    /// How multisampled depth and stencil can be resolved.
    pub depth_resolve: DepthResolveLimits,
    /// Of fragments of several pixels.
    pub shading_rate: ShadingRateLimits,
    /// Most vertices of a patch, before and behind the tessellation control stage (`maxTessellationPatchSize`).
    pub max_patch_points: u32,
    /// Least and greatest width of lines in pixels (`lineWidthRange`).
    pub line_width: [f32; 2],
    /// Most workgroups of a dispatch for each axis (`maxComputeWorkGroupCount`).
    pub max_dispatch_groups: [u32; 3],
    /// Most invocations of a workgroup for each axis (`maxComputeWorkGroupSize`).
    pub max_group_size: [u32; 3],
    /// Most invocations of a workgroup altogether (`maxComputeWorkGroupInvocations`).
    pub max_group_invocations: u32,
    /// Most bytes that the invocations of a compute workgroup share (`maxComputeSharedMemorySize`), counted by the rules of
    /// std430.
    pub max_shared_bytes: u32,
    /// Most draws of one indirect call (`maxDrawIndirectCount`).
    pub max_indirect_draws: u32,
    /// Largest width and height of a viewport in pixels (`maxViewportDimensions`).
    pub max_viewport: [u32; 2],
    /// Where viewports may begin and end in pixels, along both axes (`viewportBoundsRange`).
    pub viewport_bounds: [f32; 2],
    /// Nanoseconds of one tick of a timestamp (`timestampPeriod`); 0 where the queue has none.
    pub timestamp_period_ns: f32,
    /// Bits of a timestamp that count (`timestampValidBits`).
    pub timestamp_bits: u32,
    /// Most elements of `kTextures2D[]` and the storage images: what the device's limits of descriptors leave, and no
    /// more than 1,048,576. Textures in Y'CbCr ([`ContextDesc::yuv`](crate::ContextDesc::yuv)) take some of it.
    pub max_bindless_textures: u32,
    /// Most elements of `kSamplers[]`. Textures in Y'CbCr take of it where samplers are few.
    pub max_bindless_samplers: u32,
    /// Most elements of `kTLAS[]`.
    pub max_bindless_tlas: u32,
    /// Alignment of scratch addresses in bytes (`minAccelerationStructureScratchOffsetAlignment`).
    pub scratch_alignment: u32,
    /// Most geometries in a BLAS (`maxGeometryCount`).
    pub max_blas_geometries: u64,
    /// Most primitives in a BLAS (`maxPrimitiveCount`).
    pub max_blas_primitives: u64,
    /// Most bytes of one acceleration structure: `maxBufferSize`, or `maxStorageBufferRange` on drivers that are known
    /// to fail beyond it.
    pub max_accel_structure_bytes: u64,
    /// Most bytes of scratch for the build of one acceleration structure; bounded as
    /// [`max_accel_structure_bytes`](Self::max_accel_structure_bytes) is.
    pub max_accel_scratch_bytes: u64,
    /// Most instances in a TLAS (`maxInstanceCount`).
    pub max_tlas_instances: u64,
    /// Deepest recursion of `traceRayEXT` (`maxRayRecursionDepth`).
    pub max_ray_recursion: u32,
    /// Most invocations of one trace (`maxRayDispatchInvocationCount`).
    pub max_trace_invocations: u32,
    /// Largest hit attributes in bytes (`maxRayHitAttributeSize`).
    pub max_hit_attribute_bytes: u32,
    /// Bytes of a shader group handle (`shaderGroupHandleSize`).
    pub sbt_handle_bytes: u32,
    /// Alignment of handles in bytes (`shaderGroupHandleAlignment`).
    pub sbt_handle_alignment: u32,
    /// Alignment of shader binding table regions in bytes (`shaderGroupBaseAlignment`).
    pub sbt_base_alignment: u32,
    /// Largest stride of a shader binding table in bytes (`maxShaderGroupStride`).
    pub sbt_max_stride: u32,
    /// Of task and mesh shaders.
    pub mesh: MeshLimits,
}

impl Limits {
    /// As the device says them.
    pub(crate) fn from_properties(
        plain: &vk::PhysicalDeviceLimits,
        v12: &vk::PhysicalDeviceVulkan12Properties<'_>,
        v13: &vk::PhysicalDeviceVulkan13Properties<'_>,
        accel: &vk::PhysicalDeviceAccelerationStructurePropertiesKHR<'_>,
        pipeline: &vk::PhysicalDeviceRayTracingPipelinePropertiesKHR<'_>,
    ) -> Self {
        let accel_bytes = max_accel_bytes(v12.driver_id, plain.max_storage_buffer_range, v13.max_buffer_size);
        let mut limits = Self {
            max_lod_bias: plain.max_sampler_lod_bias,
            max_custom_borders: 0,
            max_texture_1d: plain.max_image_dimension1_d,
            max_texture_2d: plain.max_image_dimension2_d,
            max_texture_3d: plain.max_image_dimension3_d,
            max_texture_cube: plain.max_image_dimension_cube,
            max_texture_layers: plain.max_image_array_layers,
            color_samples: plain.framebuffer_color_sample_counts.as_raw(),
            depth_samples: plain.framebuffer_depth_sample_counts.as_raw(),
            max_buffer_bytes: v13.max_buffer_size,
            max_allocation_bytes: 0,
            max_storage_buffer_range: plain.max_storage_buffer_range.into(),
            max_push_constant_bytes: plain.max_push_constants_size,
            max_color_targets: plain.max_color_attachments.min(8),
            max_input_attachments: plain
                .max_per_stage_descriptor_input_attachments
                .min(plain.max_descriptor_set_input_attachments)
                .min(10),
            max_target_size: [plain.max_framebuffer_width, plain.max_framebuffer_height],
            max_target_layers: plain.max_framebuffer_layers,
            max_views: 0,
            depth_resolve: DepthResolveLimits {
                depth: ResolveModes::from_bits_truncate(v12.supported_depth_resolve_modes.as_raw()),
                stencil: ResolveModes::from_bits_truncate(v12.supported_stencil_resolve_modes.as_raw()),
                one_alone: v12.independent_resolve_none == vk::TRUE,
                different: v12.independent_resolve == vk::TRUE,
            },
            shading_rate: ShadingRateLimits::default(),
            max_patch_points: plain.max_tessellation_patch_size,
            line_width: plain.line_width_range,
            max_dispatch_groups: plain.max_compute_work_group_count,
            max_group_size: plain.max_compute_work_group_size,
            max_group_invocations: plain.max_compute_work_group_invocations,
            max_shared_bytes: plain.max_compute_shared_memory_size,
            max_indirect_draws: plain.max_draw_indirect_count,
            max_viewport: plain.max_viewport_dimensions,
            viewport_bounds: plain.viewport_bounds_range,
            timestamp_period_ns: plain.timestamp_period,
            timestamp_bits: 0,
            max_bindless_textures: 0,
            max_bindless_samplers: 0,
            max_bindless_tlas: 0,
            scratch_alignment: accel.min_acceleration_structure_scratch_offset_alignment.max(1),
            max_blas_geometries: accel.max_geometry_count,
            max_blas_primitives: accel.max_primitive_count,
            max_accel_structure_bytes: accel_bytes,
            max_accel_scratch_bytes: accel_bytes,
            max_tlas_instances: accel.max_instance_count,
            max_ray_recursion: pipeline.max_ray_recursion_depth,
            max_trace_invocations: pipeline.max_ray_dispatch_invocation_count,
            max_hit_attribute_bytes: pipeline.max_ray_hit_attribute_size,
            sbt_handle_bytes: pipeline.shader_group_handle_size,
            sbt_handle_alignment: pipeline.shader_group_handle_alignment.max(1),
            sbt_base_alignment: pipeline.shader_group_base_alignment.max(1),
            sbt_max_stride: pipeline.max_shader_group_stride,
            mesh: MeshLimits::default(),
        };
        size_bindless(&mut limits, v12, accel);
        limits
    }

    /// Of structures the library builds itself; without any of the device's own they are the only ones.
    pub(crate) fn enable_software_structures(&mut self, beside_hardware: bool) {
        if beside_hardware {
            return;
        }
        self.max_bindless_tlas = WANTED_TLAS;
        self.max_blas_geometries = software::MAX_GEOMETRIES;
        self.max_blas_primitives = software::MAX_PRIMITIVES;
        self.max_tlas_instances = software::MAX_PRIMITIVES;
        self.max_accel_structure_bytes = self.max_buffer_bytes;
        self.max_accel_scratch_bytes = self.max_buffer_bytes;
    }
}

/// Bounds of what references to nodes and leaves can name; see `accel::software::layout`.
mod software {
    pub(crate) const MAX_GEOMETRIES: u64 = 1 << 24;
    pub(crate) const MAX_PRIMITIVES: u64 = 1 << 27;
}

/// Most bytes of an acceleration structure or of its scratch. Builds on Arm's own driver fail where either is beyond
/// the range of a storage buffer, though Vulkan knows no such limit.
fn max_accel_bytes(driver: vk::DriverId, storage_range: u32, buffer_bytes: u64) -> u64 {
    if driver == vk::DriverId::ARM_PROPRIETARY {
        buffer_bytes.min(storage_range.into())
    } else {
        buffer_bytes
    }
}

/// Sizes the arrays of the one descriptor set, as they are without conversions of Y'CbCr.
fn size_bindless(
    limits: &mut Limits,
    v12: &vk::PhysicalDeviceVulkan12Properties<'_>,
    accel: &vk::PhysicalDeviceAccelerationStructurePropertiesKHR<'_>,
) {
    limits.max_bindless_tlas = WANTED_TLAS
        .min(accel.max_per_stage_descriptor_update_after_bind_acceleration_structures)
        .min(accel.max_descriptor_set_update_after_bind_acceleration_structures);
    let others = ReservedDescriptors {
        in_set: limits.max_bindless_tlas + 1,
        targets: limits.max_color_targets + limits.max_input_attachments,
    };
    let room = DescriptorLimits::from_properties(v12).budget(&others, 0);
    limits.max_bindless_samplers = room.samplers;
    limits.max_bindless_textures = room.textures;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_arms_driver_bounds_structures_by_the_storage_range() {
        let (range, buffer) = (1 << 28, 1 << 40);
        assert_eq!(max_accel_bytes(vk::DriverId::ARM_PROPRIETARY, range, buffer), 1 << 28);
        assert_eq!(max_accel_bytes(vk::DriverId::ARM_PROPRIETARY, range, 1 << 20), 1 << 20);
        assert_eq!(max_accel_bytes(vk::DriverId::NVIDIA_PROPRIETARY, range, buffer), buffer);
        assert_eq!(max_accel_bytes(vk::DriverId::MESA_PANVK, range, buffer), buffer);
    }
}
