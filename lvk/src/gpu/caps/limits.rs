//! Numeric limits of the device.

use ash::vk;

use super::descriptor_limits::{DescriptorLimits, ReservedDescriptors};
use super::mesh_limits::MeshLimits;
use super::resolve_modes::DepthResolveLimits;
use super::shading_rate::ShadingRateLimits;
use super::subgroup_limits::SubgroupLimits;

/// Number of TLAS descriptors that the library requests. Fewer if the device allows fewer.
const WANTED_TLAS: u32 = 256;

/// Limits of the device. The name of each field gives its unit.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Limits {
    /// Maximum absolute level-of-detail bias of a sampler (`maxSamplerLodBias`).
    pub max_lod_bias: f32,
    /// Maximum number of samplers with a custom border colour (`maxCustomBorderColorSamplers`).
    pub max_custom_borders: u32,
    /// Maximum length of a 1D texture, in texels (`maxImageDimension1D`).
    pub max_texture_1d: u32,
    /// Maximum width and height of a 2D texture, in texels (`maxImageDimension2D`).
    pub max_texture_2d: u32,
    /// Maximum width, height and depth of a 3D texture, in texels (`maxImageDimension3D`).
    pub max_texture_3d: u32,
    /// Maximum width and height of a cube texture, in texels (`maxImageDimensionCube`).
    pub max_texture_cube: u32,
    /// Maximum number of array layers of a texture (`maxImageArrayLayers`).
    pub max_texture_layers: u32,
    /// Supported sample counts of colour targets, as a sum: 5 means 1 and 4 (`framebufferColorSampleCounts`).
    pub color_samples: u32,
    /// Supported sample counts of depth targets, as a sum (`framebufferDepthSampleCounts`).
    pub depth_samples: u32,
    /// Maximum size of a buffer in bytes (`maxBufferSize`, rounded down to a multiple of 4).
    pub max_buffer_bytes: u64,
    /// Maximum memory of one buffer or texture, in bytes (`maxMemoryAllocationSize`).
    pub max_allocation_bytes: u64,
    /// Maximum range of one storage buffer descriptor in bytes (`maxStorageBufferRange`).
    pub max_storage_buffer_range: u64,
    /// Maximum size of push constants in bytes (`maxPushConstantsSize`).
    pub max_push_constant_bytes: u32,
    /// Maximum number of colour targets of a render pass (`maxColorAttachments`).
    pub max_color_targets: u32,
    /// Maximum number of input attachments: targets of a pass that its own fragment shaders read
    /// (`maxPerStageDescriptorInputAttachments`). Depth is the first, the colour targets follow in their
    /// order, and stencil is the tenth. 0 without
    /// [`OptionalFeature::LocalRead`](crate::OptionalFeature::LocalRead).
    pub max_input_attachments: u32,
    /// Maximum width and height of a render target, in pixels (`maxFramebufferWidth`,
    /// `maxFramebufferHeight`).
    pub max_target_size: [u32; 2],
    /// Maximum number of layers of a render pass (`maxFramebufferLayers`).
    pub max_target_layers: u32,
    /// Maximum number of views of a multiview render pass (`maxMultiviewViewCount`).
    pub max_views: u32,
    /// Support for resolving multisampled depth and stencil.
    pub depth_resolve: DepthResolveLimits,
    /// Limits of fragment shading rates.
    pub shading_rate: ShadingRateLimits,
    /// Maximum number of vertices of a patch, before and after the tessellation control stage
    /// (`maxTessellationPatchSize`).
    pub max_patch_points: u32,
    /// Alignment of vertex strides in bytes (`minVertexInputBindingStrideAlignment`). Strides are multiples of
    /// it; it is 1 on devices without `VK_KHR_portability_subset`.
    pub vertex_stride_alignment: u32,
    /// Minimum and maximum width of lines in pixels (`lineWidthRange`).
    pub line_width: [f32; 2],
    /// Maximum workgroups of a dispatch along each axis (`maxComputeWorkGroupCount`).
    pub max_dispatch_workgroups: [u32; 3],
    /// Maximum size of a compute workgroup along each axis, in invocations (`maxComputeWorkGroupSize`).
    pub max_workgroup_size: [u32; 3],
    /// Maximum invocations of a compute workgroup (`maxComputeWorkGroupInvocations`).
    pub max_workgroup_invocations: u32,
    /// Maximum shared memory of a compute workgroup in bytes (`maxComputeSharedMemorySize`), counted by
    /// std430 rules.
    pub max_shared_bytes: u32,
    /// Maximum number of draws of one indirect command (`maxDrawIndirectCount`).
    pub max_indirect_draws: u32,
    /// Maximum width and height of a viewport in pixels (`maxViewportDimensions`).
    pub max_viewport: [u32; 2],
    /// Minimum and maximum viewport coordinates in pixels, along both axes (`viewportBoundsRange`).
    pub viewport_bounds: [f32; 2],
    /// Duration of one timestamp tick in nanoseconds (`timestampPeriod`); 0 if the queue has no timestamps.
    pub timestamp_period_ns: f32,
    /// Valid bits of a timestamp (`timestampValidBits`).
    pub timestamp_bits: u32,
    /// Maximum number of elements of `kTextures2D[]` and of the storage images. It follows from the
    /// descriptor limits of the device and is at most 1,048,576. Y'CbCr textures
    /// ([`ContextDesc::yuv`](crate::ContextDesc::yuv)) reduce it.
    pub max_bindless_textures: u32,
    /// Maximum number of elements of `kSamplers[]`. Y'CbCr textures reduce it if the device allows few
    /// samplers.
    pub max_bindless_samplers: u32,
    /// Maximum number of elements of `kTLAS[]`.
    pub max_bindless_tlas: u32,
    /// Alignment of scratch addresses in bytes (`minAccelerationStructureScratchOffsetAlignment`).
    pub scratch_alignment: u32,
    /// Maximum number of geometries in a BLAS (`maxGeometryCount`).
    pub max_blas_geometries: u64,
    /// Maximum number of primitives in a BLAS (`maxPrimitiveCount`).
    pub max_blas_primitives: u64,
    /// Maximum size of one acceleration structure in bytes: `maxBufferSize`, or `maxStorageBufferRange` on
    /// drivers that are known to fail beyond it.
    pub max_accel_structure_bytes: u64,
    /// Maximum scratch memory in bytes for the build of one acceleration structure, bounded like
    /// [`max_accel_structure_bytes`](Self::max_accel_structure_bytes).
    pub max_accel_scratch_bytes: u64,
    /// Maximum number of instances in a TLAS (`maxInstanceCount`).
    pub max_tlas_instances: u64,
    /// Maximum recursion depth of `traceRayEXT` (`maxRayRecursionDepth`); 31 if pipelines are lowered.
    pub max_ray_recursion: u32,
    /// Maximum number of invocations of one trace command (`maxRayDispatchInvocationCount`); 2<sup>31</sup> if pipelines
    /// are lowered.
    pub max_trace_invocations: u32,
    /// Maximum size of hit attributes in bytes (`maxRayHitAttributeSize`); 32 if pipelines are lowered.
    pub max_hit_attribute_bytes: u32,
    /// Size of a shader group handle in bytes (`shaderGroupHandleSize`); 0 if pipelines are lowered, whose tables hold
    /// records only.
    pub sbt_handle_bytes: u32,
    /// Alignment of shader group handles in bytes (`shaderGroupHandleAlignment`).
    pub sbt_handle_alignment: u32,
    /// Alignment of shader binding table regions in bytes (`shaderGroupBaseAlignment`).
    pub sbt_base_alignment: u32,
    /// Maximum stride of a shader binding table in bytes (`maxShaderGroupStride`).
    pub sbt_max_stride: u32,
    /// Limits of subgroups.
    pub subgroup: SubgroupLimits,
    /// Limits of task and mesh shaders.
    pub mesh: MeshLimits,
    /// Limits of opacity micromaps; 0 without
    /// [`OptionalFeature::OpacityMicromaps`](crate::OptionalFeature::OpacityMicromaps).
    pub micromap: MicromapLimits,
    /// True if the device reorders invocations where a shader asks for it
    /// (`rayTracingInvocationReorderReorderingHint`). A device with one of the features may accept the calls and
    /// ignore them.
    pub reorders_invocations: bool,
}

/// Limits of opacity micromaps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct MicromapLimits {
    /// Maximum subdivision level of maps with two states (`maxOpacity2StateSubdivisionLevel`).
    pub max_two_state_level: u32,
    /// Maximum subdivision level of maps with four states (`maxOpacity4StateSubdivisionLevel`).
    pub max_four_state_level: u32,
}

impl Limits {
    /// Converts the limits reported by the device. Limits of other structures of properties are left at their defaults.
    pub(crate) fn from_properties(
        plain: &vk::PhysicalDeviceLimits,
        v12: &vk::PhysicalDeviceVulkan12Properties<'_>,
        v13: &vk::PhysicalDeviceVulkan13Properties<'_>,
        accel: &vk::PhysicalDeviceAccelerationStructurePropertiesKHR<'_>,
        pipeline: &vk::PhysicalDeviceRayTracingPipelinePropertiesKHR<'_>,
    ) -> Self {
        let buffer_bytes = max_buffer_bytes(v13.max_buffer_size);
        let accel_bytes = max_accel_bytes(v12.driver_id, plain.max_storage_buffer_range, buffer_bytes);
        let mut limits = Self {
            max_lod_bias: plain.max_sampler_lod_bias,
            max_texture_1d: plain.max_image_dimension1_d,
            max_texture_2d: plain.max_image_dimension2_d,
            max_texture_3d: plain.max_image_dimension3_d,
            max_texture_cube: plain.max_image_dimension_cube,
            max_texture_layers: plain.max_image_array_layers,
            color_samples: plain.framebuffer_color_sample_counts.as_raw(),
            depth_samples: plain.framebuffer_depth_sample_counts.as_raw(),
            max_buffer_bytes: buffer_bytes,
            max_storage_buffer_range: plain.max_storage_buffer_range.into(),
            max_push_constant_bytes: plain.max_push_constants_size,
            max_color_targets: plain.max_color_attachments.min(8),
            max_input_attachments: plain
                .max_per_stage_descriptor_input_attachments
                .min(plain.max_descriptor_set_input_attachments)
                .min(10),
            max_target_size: [plain.max_framebuffer_width, plain.max_framebuffer_height],
            max_target_layers: plain.max_framebuffer_layers,
            depth_resolve: DepthResolveLimits::from_properties(v12),
            max_patch_points: plain.max_tessellation_patch_size,
            vertex_stride_alignment: 1,
            line_width: plain.line_width_range,
            max_dispatch_workgroups: plain.max_compute_work_group_count,
            max_workgroup_size: plain.max_compute_work_group_size,
            max_workgroup_invocations: plain.max_compute_work_group_invocations,
            max_shared_bytes: plain.max_compute_shared_memory_size,
            max_indirect_draws: plain.max_draw_indirect_count,
            max_viewport: plain.max_viewport_dimensions,
            viewport_bounds: plain.viewport_bounds_range,
            timestamp_period_ns: plain.timestamp_period,
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
            ..Self::default()
        };
        size_bindless(&mut limits, v12, accel);
        limits
    }

    /// Replaces the limits of the device's ray tracing pipelines by those of lowered pipelines.
    pub(crate) fn set_lowered_pipelines(&mut self) {
        self.max_ray_recursion = lowered::MAX_RECURSION;
        self.max_trace_invocations = lowered::MAX_RAYS;
        self.max_hit_attribute_bytes = lowered::MAX_HIT_ATTRIBUTE_BYTES;
        self.sbt_handle_bytes = 0;
        self.sbt_handle_alignment = lowered::RECORD_ALIGNMENT;
        self.sbt_base_alignment = lowered::RECORD_ALIGNMENT;
        self.sbt_max_stride = lowered::MAX_STRIDE;
    }

    /// Adds the limits of acceleration structures that the library builds itself. They apply only if the
    /// device builds none.
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

/// Limits of pipelines that are lowered to compute shaders.
pub(crate) mod lowered {
    pub(crate) const MAX_RECURSION: u32 = 31;
    /// Deepest nesting of callable shaders.
    pub(crate) const MAX_CALLABLE_DEPTH: u32 = 31;
    /// The least that devices with ray tracing pipelines support.
    pub(crate) const MAX_HIT_ATTRIBUTE_BYTES: u32 = 32;
    /// Alignment of records in bytes; the largest alignment of a member of a record is 16.
    pub(crate) const RECORD_ALIGNMENT: u32 = 16;
    /// Most rays of a launch. Shaders count invocations in 32 bits, and a launch may have more invocations than rays.
    pub(crate) const MAX_RAYS: u32 = 1 << 31;
    /// Largest distance of records in bytes, as of devices with ray tracing pipelines.
    pub(crate) const MAX_STRIDE: u32 = 4096;
}

/// Maximum values that node and leaf references can encode; see `accel::software::layout`.
mod software {
    pub(crate) const MAX_GEOMETRIES: u64 = 1 << 24;
    pub(crate) const MAX_PRIMITIVES: u64 = 1 << 27;
}

/// Returns the maximum size of a buffer in bytes. Buffers are created with a multiple of 4 bytes, which must not exceed the
/// device's own limit, `u32::MAX` on lavapipe.
fn max_buffer_bytes(of_device: u64) -> u64 {
    of_device - of_device % 4
}

/// Returns the maximum size of an acceleration structure or its scratch, in bytes. Builds with Arm's own
/// driver fail if either exceeds the range of a storage buffer, although Vulkan has no such limit.
fn max_accel_bytes(driver: vk::DriverId, storage_range: u32, buffer_bytes: u64) -> u64 {
    if driver == vk::DriverId::ARM_PROPRIETARY {
        buffer_bytes.min(storage_range.into())
    } else {
        buffer_bytes
    }
}

/// Computes the array sizes of the bindless set, without Y'CbCr conversions.
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
    fn sizes_within_the_limit_stay_within_it_when_they_are_rounded_up() {
        for of_device in [u64::from(u32::MAX), 1 << 30, u64::MAX, u64::MAX - 3, 7] {
            let most = max_buffer_bytes(of_device);
            assert!(most.next_multiple_of(4) <= of_device && of_device - most < 4, "{of_device}");
        }
    }

    #[test]
    fn only_arms_driver_bounds_structures_by_the_storage_range() {
        let (range, buffer) = (1 << 28, 1 << 40);
        assert_eq!(max_accel_bytes(vk::DriverId::ARM_PROPRIETARY, range, buffer), 1 << 28);
        assert_eq!(max_accel_bytes(vk::DriverId::ARM_PROPRIETARY, range, 1 << 20), 1 << 20);
        assert_eq!(max_accel_bytes(vk::DriverId::NVIDIA_PROPRIETARY, range, buffer), buffer);
        assert_eq!(max_accel_bytes(vk::DriverId::MESA_PANVK, range, buffer), buffer);
    }
}
