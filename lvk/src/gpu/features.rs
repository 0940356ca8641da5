//! The device features that shaders and pipelines may count on.

use ash::vk;

/// Features of a device: as found, or those of them that the library turns on.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Features {
    pub(crate) core: vk::PhysicalDeviceFeatures,
    pub(crate) v11: vk::PhysicalDeviceVulkan11Features<'static>,
    pub(crate) v12: vk::PhysicalDeviceVulkan12Features<'static>,
    pub(crate) v13: vk::PhysicalDeviceVulkan13Features<'static>,
    /// `VK_EXT_shader_atomic_float`; nothing is on where the device lacks the extension.
    pub(crate) float_atomics: vk::PhysicalDeviceShaderAtomicFloatFeaturesEXT<'static>,
    pub(crate) ray_tracing_pipeline: vk::Bool32,
    pub(crate) trace_indirect: vk::Bool32,
    pub(crate) primitive_culling: vk::Bool32,
    pub(crate) ray_query: vk::Bool32,
    /// `VK_KHR_ray_tracing_position_fetch`.
    pub(crate) position_fetch: vk::Bool32,
    /// `VK_EXT_mesh_shader`, with both its stages.
    pub(crate) mesh_shader: vk::Bool32,
    /// Pipeline statistics count task and mesh shaders.
    pub(crate) mesh_shader_queries: vk::Bool32,
    /// Which extension reads the clocks of device and host together.
    pub(crate) calibration: Calibration,
    pub(crate) subgroups: Subgroups,
}

/// Extensions that read the clocks of device and host together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum Calibration {
    #[default]
    None,
    /// `VK_EXT_calibrated_timestamps`.
    Ext,
    /// `VK_KHR_calibrated_timestamps`.
    Khr,
}

/// What subgroups of a device can do.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Subgroups {
    pub(crate) operations: vk::SubgroupFeatureFlags,
    pub(crate) stages: vk::ShaderStageFlags,
    /// Quad operations work in more stages than fragment and compute.
    pub(crate) quads_everywhere: bool,
}

impl Features {
    /// Those of the features found that the library turns on.
    pub(crate) fn wanted(found: &Self) -> Self {
        Self {
            core: wanted_core(&found.core),
            v11: wanted_1_1(&found.v11),
            v12: wanted_1_2(&found.v12),
            v13: wanted_1_3(&found.v13),
            float_atomics: wanted_float_atomics(&found.float_atomics),
            ..*found
        }
    }

    /// Without the ray tracing that is not to be turned on.
    pub(crate) fn limit_ray_tracing(&mut self, pipeline: bool, query: bool) {
        self.ray_tracing_pipeline &= vk::Bool32::from(pipeline);
        self.trace_indirect &= vk::Bool32::from(pipeline);
        self.primitive_culling &= vk::Bool32::from(pipeline);
        self.ray_query &= vk::Bool32::from(query);
        self.position_fetch &= vk::Bool32::from(pipeline || query);
    }

    /// Whether anything of `VK_EXT_shader_atomic_float` is on.
    pub(crate) fn has_float_atomics(&self) -> bool {
        let on = &self.float_atomics;
        on.shader_buffer_float32_atomics | on.shader_shared_float32_atomics | on.shader_image_float32_atomics
            == vk::TRUE
    }
}

/// The names of features that the library cannot do without and the device lacks.
pub(crate) fn missing(found: &Features) -> Vec<String> {
    let Features { core, v12, v13, .. } = found;
    let needed = [
        (core.shader_storage_image_write_without_format, "shaderStorageImageWriteWithoutFormat"),
        (core.shader_sampled_image_array_dynamic_indexing, "shaderSampledImageArrayDynamicIndexing"),
        (core.shader_storage_image_array_dynamic_indexing, "shaderStorageImageArrayDynamicIndexing"),
        (core.fragment_stores_and_atomics, "fragmentStoresAndAtomics"),
        (core.independent_blend, "independentBlend"),
        (v12.buffer_device_address, "bufferDeviceAddress"),
        (v12.timeline_semaphore, "timelineSemaphore"),
        (v12.host_query_reset, "hostQueryReset"),
        (v12.scalar_block_layout, "scalarBlockLayout"),
        (v12.runtime_descriptor_array, "runtimeDescriptorArray"),
        (v12.descriptor_binding_partially_bound, "descriptorBindingPartiallyBound"),
        (v12.descriptor_binding_update_unused_while_pending, "descriptorBindingUpdateUnusedWhilePending"),
        (
            v12.descriptor_binding_sampled_image_update_after_bind,
            "descriptorBindingSampledImageUpdateAfterBind",
        ),
        (
            v12.descriptor_binding_storage_image_update_after_bind,
            "descriptorBindingStorageImageUpdateAfterBind",
        ),
        (v12.shader_sampled_image_array_non_uniform_indexing, "shaderSampledImageArrayNonUniformIndexing"),
        (v12.shader_storage_image_array_non_uniform_indexing, "shaderStorageImageArrayNonUniformIndexing"),
        (v13.synchronization2, "synchronization2"),
        (v13.dynamic_rendering, "dynamicRendering"),
        (v13.maintenance4, "maintenance4"),
    ];
    needed.iter().filter(|(on, _)| *on == vk::FALSE).map(|(_, name)| (*name).to_owned()).collect()
}

fn wanted_core(found: &vk::PhysicalDeviceFeatures) -> vk::PhysicalDeviceFeatures {
    vk::PhysicalDeviceFeatures {
        robust_buffer_access: found.robust_buffer_access,
        full_draw_index_uint32: found.full_draw_index_uint32,
        image_cube_array: found.image_cube_array,
        independent_blend: found.independent_blend,
        geometry_shader: found.geometry_shader,
        tessellation_shader: found.tessellation_shader,
        sample_rate_shading: found.sample_rate_shading,
        dual_src_blend: found.dual_src_blend,
        multi_draw_indirect: found.multi_draw_indirect,
        occlusion_query_precise: found.occlusion_query_precise,
        pipeline_statistics_query: found.pipeline_statistics_query,
        draw_indirect_first_instance: found.draw_indirect_first_instance,
        depth_clamp: found.depth_clamp,
        fill_mode_non_solid: found.fill_mode_non_solid,
        sampler_anisotropy: found.sampler_anisotropy,
        texture_compression_bc: found.texture_compression_bc,
        vertex_pipeline_stores_and_atomics: found.vertex_pipeline_stores_and_atomics,
        fragment_stores_and_atomics: found.fragment_stores_and_atomics,
        shader_tessellation_and_geometry_point_size: found.shader_tessellation_and_geometry_point_size,
        shader_image_gather_extended: found.shader_image_gather_extended,
        shader_storage_image_extended_formats: found.shader_storage_image_extended_formats,
        shader_storage_image_read_without_format: found.shader_storage_image_read_without_format,
        shader_storage_image_write_without_format: found.shader_storage_image_write_without_format,
        shader_sampled_image_array_dynamic_indexing: found.shader_sampled_image_array_dynamic_indexing,
        shader_storage_image_array_dynamic_indexing: found.shader_storage_image_array_dynamic_indexing,
        shader_clip_distance: found.shader_clip_distance,
        shader_cull_distance: found.shader_cull_distance,
        shader_float64: found.shader_float64,
        shader_int64: found.shader_int64,
        shader_int16: found.shader_int16,
        shader_resource_min_lod: found.shader_resource_min_lod,
        ..Default::default()
    }
}

fn wanted_1_1(found: &vk::PhysicalDeviceVulkan11Features<'_>) -> vk::PhysicalDeviceVulkan11Features<'static> {
    vk::PhysicalDeviceVulkan11Features {
        storage_buffer16_bit_access: found.storage_buffer16_bit_access,
        uniform_and_storage_buffer16_bit_access: found.uniform_and_storage_buffer16_bit_access,
        storage_push_constant16: found.storage_push_constant16,
        storage_input_output16: found.storage_input_output16,
        variable_pointers_storage_buffer: found.variable_pointers_storage_buffer,
        variable_pointers: found.variable_pointers,
        shader_draw_parameters: found.shader_draw_parameters,
        ..Default::default()
    }
}

fn wanted_1_2(found: &vk::PhysicalDeviceVulkan12Features<'_>) -> vk::PhysicalDeviceVulkan12Features<'static> {
    vk::PhysicalDeviceVulkan12Features {
        storage_buffer8_bit_access: found.storage_buffer8_bit_access,
        uniform_and_storage_buffer8_bit_access: found.uniform_and_storage_buffer8_bit_access,
        storage_push_constant8: found.storage_push_constant8,
        shader_buffer_int64_atomics: found.shader_buffer_int64_atomics,
        shader_shared_int64_atomics: found.shader_shared_int64_atomics,
        shader_float16: found.shader_float16,
        shader_int8: found.shader_int8,
        descriptor_indexing: found.descriptor_indexing,
        shader_sampled_image_array_non_uniform_indexing: found
            .shader_sampled_image_array_non_uniform_indexing,
        shader_storage_image_array_non_uniform_indexing: found
            .shader_storage_image_array_non_uniform_indexing,
        descriptor_binding_sampled_image_update_after_bind: found
            .descriptor_binding_sampled_image_update_after_bind,
        descriptor_binding_storage_image_update_after_bind: found
            .descriptor_binding_storage_image_update_after_bind,
        descriptor_binding_update_unused_while_pending: found.descriptor_binding_update_unused_while_pending,
        descriptor_binding_partially_bound: found.descriptor_binding_partially_bound,
        runtime_descriptor_array: found.runtime_descriptor_array,
        scalar_block_layout: found.scalar_block_layout,
        shader_subgroup_extended_types: found.shader_subgroup_extended_types,
        host_query_reset: found.host_query_reset,
        timeline_semaphore: found.timeline_semaphore,
        buffer_device_address: found.buffer_device_address,
        vulkan_memory_model: found.vulkan_memory_model,
        vulkan_memory_model_device_scope: found.vulkan_memory_model_device_scope,
        ..Default::default()
    }
}

/// Shaders of SPIR-V 1.6 end an invocation by `OpTerminateInvocation`, which no capability announces.
fn wanted_1_3(found: &vk::PhysicalDeviceVulkan13Features<'_>) -> vk::PhysicalDeviceVulkan13Features<'static> {
    vk::PhysicalDeviceVulkan13Features {
        shader_demote_to_helper_invocation: found.shader_demote_to_helper_invocation,
        shader_terminate_invocation: found.shader_terminate_invocation,
        shader_zero_initialize_workgroup_memory: found.shader_zero_initialize_workgroup_memory,
        shader_integer_dot_product: found.shader_integer_dot_product,
        synchronization2: found.synchronization2,
        dynamic_rendering: found.dynamic_rendering,
        maintenance4: found.maintenance4,
        ..Default::default()
    }
}

fn wanted_float_atomics(
    found: &vk::PhysicalDeviceShaderAtomicFloatFeaturesEXT<'_>,
) -> vk::PhysicalDeviceShaderAtomicFloatFeaturesEXT<'static> {
    vk::PhysicalDeviceShaderAtomicFloatFeaturesEXT {
        shader_buffer_float32_atomics: found.shader_buffer_float32_atomics,
        shader_buffer_float32_atomic_add: found.shader_buffer_float32_atomic_add,
        shader_shared_float32_atomics: found.shader_shared_float32_atomics,
        shader_shared_float32_atomic_add: found.shader_shared_float32_atomic_add,
        shader_image_float32_atomics: found.shader_image_float32_atomics,
        shader_image_float32_atomic_add: found.shader_image_float32_atomic_add,
        ..Default::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ray_tracing_that_is_off_takes_its_culling_along() {
        let on = vk::TRUE;
        let mut features =
            Features { ray_tracing_pipeline: on, primitive_culling: on, ray_query: on, ..Default::default() };
        features.limit_ray_tracing(false, true);
        assert_eq!(
            (features.ray_tracing_pipeline, features.primitive_culling, features.ray_query),
            (0, 0, 1)
        );
    }

    #[test]
    fn positions_are_fetched_by_either_kind_of_ray_tracing() {
        for (pipeline, query) in [(false, false), (false, true), (true, false), (true, true)] {
            let mut features = Features { position_fetch: vk::TRUE, ..Default::default() };
            features.limit_ray_tracing(pipeline, query);
            assert_eq!(features.position_fetch == vk::TRUE, pipeline || query);
        }
    }

    #[test]
    fn only_what_is_found_is_wanted() {
        let mut found = Features::default();
        found.core.shader_int64 = vk::TRUE;
        found.core.sparse_binding = vk::TRUE;
        found.v12.shader_float16 = vk::TRUE;
        let wanted = Features::wanted(&found);
        assert_eq!((wanted.core.shader_int64, wanted.core.sparse_binding), (vk::TRUE, vk::FALSE));
        assert_eq!((wanted.v12.shader_float16, wanted.v12.shader_int8), (vk::TRUE, vk::FALSE));
        assert!(missing(&found).contains(&"bufferDeviceAddress".to_owned()));
    }
}
