//! The feature structures of extensions, in one chain for the feature query and for device creation.

use std::ffi::CStr;

use ash::vk;

use super::invocation_reorder::{INVOCATION_REORDER_EXT, InvocationReorderFeatures};

/// Features of extensions. All are false for extensions that the device lacks.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct ExtensionFeatures {
    pub(crate) structures: vk::PhysicalDeviceAccelerationStructureFeaturesKHR<'static>,
    pub(crate) ray_tracing: vk::PhysicalDeviceRayTracingPipelineFeaturesKHR<'static>,
    pub(crate) ray_query: vk::PhysicalDeviceRayQueryFeaturesKHR<'static>,
    pub(crate) position_fetch: vk::PhysicalDeviceRayTracingPositionFetchFeaturesKHR<'static>,
    pub(crate) mesh: vk::PhysicalDeviceMeshShaderFeaturesEXT<'static>,
    pub(crate) float_atomics: vk::PhysicalDeviceShaderAtomicFloatFeaturesEXT<'static>,
    pub(crate) local_read: vk::PhysicalDeviceDynamicRenderingLocalReadFeaturesKHR<'static>,
    pub(crate) shading_rate: vk::PhysicalDeviceFragmentShadingRateFeaturesKHR<'static>,
    pub(crate) barycentrics: vk::PhysicalDeviceFragmentShaderBarycentricFeaturesKHR<'static>,
    pub(crate) index_uint8: vk::PhysicalDeviceIndexTypeUint8FeaturesKHR<'static>,
    pub(crate) border_color: vk::PhysicalDeviceCustomBorderColorFeaturesEXT<'static>,
    pub(crate) host_image_copy: vk::PhysicalDeviceHostImageCopyFeaturesEXT<'static>,
    pub(crate) maintenance5: vk::PhysicalDeviceMaintenance5FeaturesKHR<'static>,
    pub(crate) graphics_library: vk::PhysicalDeviceGraphicsPipelineLibraryFeaturesEXT<'static>,
    pub(crate) fault: vk::PhysicalDeviceFaultFeaturesEXT<'static>,
    pub(crate) invocation_reorder: InvocationReorderFeatures,
    pub(crate) invocation_reorder_nv: vk::PhysicalDeviceRayTracingInvocationReorderFeaturesNV<'static>,
    pub(crate) ray_tracing_maintenance1: vk::PhysicalDeviceRayTracingMaintenance1FeaturesKHR<'static>,
    pub(crate) micromaps: vk::PhysicalDeviceOpacityMicromapFeaturesEXT<'static>,
    pub(crate) swapchain_maintenance1: vk::PhysicalDeviceSwapchainMaintenance1FeaturesEXT<'static>,
    /// All true on devices without `VK_KHR_portability_subset`.
    pub(crate) portability: vk::PhysicalDevicePortabilitySubsetFeaturesKHR<'static>,
    /// Extensions without feature structures: true if the device has them.
    pub(crate) calibrated_timestamps: vk::Bool32,
    pub(crate) memory_budget: vk::Bool32,
    pub(crate) swapchain: vk::Bool32,
    pub(crate) hdr_metadata: vk::Bool32,
    pub(crate) external_memory_fd: vk::Bool32,
    pub(crate) external_memory_dma_buf: vk::Bool32,
    pub(crate) external_semaphore_fd: vk::Bool32,
    pub(crate) drm_format_modifier: vk::Bool32,
}

impl ExtensionFeatures {
    /// Appends to `all` the structures of the extensions for which `has` returns true; Vulkan forbids any
    /// others.
    pub(crate) fn append_to_chain<'a>(
        &'a mut self,
        mut all: vk::PhysicalDeviceFeatures2<'a>,
        has: &dyn Fn(&CStr) -> bool,
    ) -> vk::PhysicalDeviceFeatures2<'a> {
        if has(ash::khr::acceleration_structure::NAME) {
            all = all.push_next(&mut self.structures);
        }
        if has(ash::khr::ray_tracing_pipeline::NAME) {
            all = all.push_next(&mut self.ray_tracing);
        }
        if has(ash::khr::ray_query::NAME) {
            all = all.push_next(&mut self.ray_query);
        }
        if has(ash::khr::ray_tracing_position_fetch::NAME) {
            all = all.push_next(&mut self.position_fetch);
        }
        if has(ash::ext::mesh_shader::NAME) {
            all = all.push_next(&mut self.mesh);
        }
        if has(ash::ext::shader_atomic_float::NAME) {
            all = all.push_next(&mut self.float_atomics);
        }
        if has(ash::khr::dynamic_rendering_local_read::NAME) {
            all = all.push_next(&mut self.local_read);
        }
        if has(ash::khr::fragment_shading_rate::NAME) {
            all = all.push_next(&mut self.shading_rate);
        }
        if has(ash::khr::fragment_shader_barycentric::NAME) {
            all = all.push_next(&mut self.barycentrics);
        }
        if has(ash::khr::index_type_uint8::NAME) {
            all = all.push_next(&mut self.index_uint8);
        }
        if has(ash::ext::custom_border_color::NAME) {
            all = all.push_next(&mut self.border_color);
        }
        if has(ash::ext::host_image_copy::NAME) {
            all = all.push_next(&mut self.host_image_copy);
        }
        if has(ash::khr::maintenance5::NAME) {
            all = all.push_next(&mut self.maintenance5);
        }
        if has(ash::ext::graphics_pipeline_library::NAME) {
            all = all.push_next(&mut self.graphics_library);
        }
        if has(ash::ext::device_fault::NAME) {
            all = all.push_next(&mut self.fault);
        }
        if has(INVOCATION_REORDER_EXT) {
            all = all.push_next(&mut self.invocation_reorder);
        }
        if has(ash::nv::ray_tracing_invocation_reorder::NAME) {
            all = all.push_next(&mut self.invocation_reorder_nv);
        }
        if has(ash::khr::ray_tracing_maintenance1::NAME) {
            all = all.push_next(&mut self.ray_tracing_maintenance1);
        }
        if has(ash::ext::opacity_micromap::NAME) {
            all = all.push_next(&mut self.micromaps);
        }
        if has(ash::ext::swapchain_maintenance1::NAME) {
            all = all.push_next(&mut self.swapchain_maintenance1);
        }
        if has(ash::khr::portability_subset::NAME) {
            all = all.push_next(&mut self.portability);
        }
        all
    }

    /// Sets all features that Vulkan promises on devices without `VK_KHR_portability_subset`.
    pub(crate) fn promise_portability(&mut self) {
        self.portability = vk::PhysicalDevicePortabilitySubsetFeaturesKHR::default()
            .constant_alpha_color_blend_factors(true)
            .events(true)
            .image_view_format_reinterpretation(true)
            .image_view_format_swizzle(true)
            .image_view2_d_on3_d_image(true)
            .multisample_array_image(true)
            .mutable_comparison_samplers(true)
            .point_polygons(true)
            .sampler_mip_lod_bias(true)
            .separate_stencil_mask_ref(true)
            .shader_sample_rate_interpolation_functions(true)
            .tessellation_isolines(true)
            .tessellation_point_mode(true)
            .triangle_fans(true)
            .vertex_attribute_access_beyond_stride(true);
    }

    /// Records which extensions without feature structures are available.
    pub(crate) fn set_featureless_extensions(&mut self, has: &dyn Fn(&CStr) -> bool) {
        let clocks = has(ash::khr::calibrated_timestamps::NAME) || has(ash::ext::calibrated_timestamps::NAME);
        self.calibrated_timestamps = clocks.into();
        self.memory_budget = has(ash::ext::memory_budget::NAME).into();
        self.swapchain = has(ash::khr::swapchain::NAME).into();
        self.hdr_metadata = has(ash::ext::hdr_metadata::NAME).into();
        self.external_memory_fd = has(ash::khr::external_memory_fd::NAME).into();
        self.external_memory_dma_buf = has(ash::ext::external_memory_dma_buf::NAME).into();
        self.external_semaphore_fd = has(ash::khr::external_semaphore_fd::NAME).into();
        self.drm_format_modifier = has(ash::ext::image_drm_format_modifier::NAME).into();
    }
}
