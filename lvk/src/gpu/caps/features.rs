//! The device features that shaders and pipelines may rely on.

use std::ffi::CStr;

use ash::vk;

use super::extension_features::ExtensionFeatures;

/// Features of a device: either as reported, or the subset that the library enables.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Features {
    pub(crate) core: vk::PhysicalDeviceFeatures,
    pub(crate) v11: vk::PhysicalDeviceVulkan11Features<'static>,
    pub(crate) v12: vk::PhysicalDeviceVulkan12Features<'static>,
    pub(crate) v13: vk::PhysicalDeviceVulkan13Features<'static>,
    pub(crate) ext: ExtensionFeatures,
    /// The extension that reads the clocks of device and host together.
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

/// Subgroup capabilities of a device.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Subgroups {
    pub(crate) operations: vk::SubgroupFeatureFlags,
    pub(crate) stages: vk::ShaderStageFlags,
    /// True if quad operations work in more stages than fragment and compute.
    pub(crate) quads_everywhere: bool,
}

impl Features {
    /// Removes the ray tracing features that are not to be enabled.
    pub(crate) fn limit_ray_tracing(&mut self, pipeline: bool, query: bool) {
        let ext = &mut self.ext;
        ext.ray_tracing.ray_tracing_pipeline &= vk::Bool32::from(pipeline);
        ext.ray_tracing.ray_tracing_pipeline_trace_rays_indirect &= vk::Bool32::from(pipeline);
        ext.ray_tracing.ray_traversal_primitive_culling &= vk::Bool32::from(pipeline);
        ext.ray_query.ray_query &= vk::Bool32::from(query);
        ext.position_fetch.ray_tracing_position_fetch &= vk::Bool32::from(pipeline || query);
        let structures = vk::Bool32::from(pipeline || query);
        ext.structures.acceleration_structure &= structures;
        ext.structures.descriptor_binding_acceleration_structure_update_after_bind &= structures;
    }

    /// Removes mesh shaders if `on` is false or the device has no task shaders.
    pub(crate) fn limit_mesh_shaders(&mut self, on: bool) {
        let mesh = &mut self.ext.mesh;
        if !on || mesh.mesh_shader & mesh.task_shader == vk::FALSE {
            *mesh = vk::PhysicalDeviceMeshShaderFeaturesEXT::default();
        }
    }

    /// Returns the extensions of the enabled features, except those of the optional features.
    pub(crate) fn extensions(&self) -> impl Iterator<Item = &'static CStr> {
        let ext = &self.ext;
        let clocks = match self.calibration {
            Calibration::Khr => Some(ash::khr::calibrated_timestamps::NAME),
            Calibration::Ext => Some(ash::ext::calibrated_timestamps::NAME),
            Calibration::None => None,
        };
        let by_feature = [
            (ext.structures.acceleration_structure, ash::khr::acceleration_structure::NAME),
            (ext.structures.acceleration_structure, ash::khr::deferred_host_operations::NAME),
            (ext.ray_tracing.ray_tracing_pipeline, ash::khr::ray_tracing_pipeline::NAME),
            (ext.ray_query.ray_query, ash::khr::ray_query::NAME),
            (ext.position_fetch.ray_tracing_position_fetch, ash::khr::ray_tracing_position_fetch::NAME),
            (ext.mesh.mesh_shader, ash::ext::mesh_shader::NAME),
        ];
        by_feature.into_iter().filter(|(on, _)| *on == vk::TRUE).map(|(_, name)| name).chain(clocks)
    }
}

pub(crate) type FeatureField = fn(&mut Features) -> &mut vk::Bool32;

/// Features that the library requires.
#[rustfmt::skip]
pub(super) const NEEDED: [(FeatureField, &str); 19] = [
    (|f| &mut f.core.shader_storage_image_write_without_format, "shaderStorageImageWriteWithoutFormat"),
    (|f| &mut f.core.shader_sampled_image_array_dynamic_indexing, "shaderSampledImageArrayDynamicIndexing"),
    (|f| &mut f.core.shader_storage_image_array_dynamic_indexing, "shaderStorageImageArrayDynamicIndexing"),
    (|f| &mut f.core.fragment_stores_and_atomics, "fragmentStoresAndAtomics"),
    (|f| &mut f.core.independent_blend, "independentBlend"),
    (|f| &mut f.v12.buffer_device_address, "bufferDeviceAddress"),
    (|f| &mut f.v12.timeline_semaphore, "timelineSemaphore"),
    (|f| &mut f.v12.host_query_reset, "hostQueryReset"),
    (|f| &mut f.v12.scalar_block_layout, "scalarBlockLayout"),
    (|f| &mut f.v12.runtime_descriptor_array, "runtimeDescriptorArray"),
    (|f| &mut f.v12.descriptor_binding_partially_bound, "descriptorBindingPartiallyBound"),
    (|f| &mut f.v12.descriptor_binding_update_unused_while_pending, "descriptorBindingUpdateUnusedWhilePending"),
    (|f| &mut f.v12.descriptor_binding_sampled_image_update_after_bind, "descriptorBindingSampledImageUpdateAfterBind"),
    (|f| &mut f.v12.descriptor_binding_storage_image_update_after_bind, "descriptorBindingStorageImageUpdateAfterBind"),
    (|f| &mut f.v12.shader_sampled_image_array_non_uniform_indexing, "shaderSampledImageArrayNonUniformIndexing"),
    (|f| &mut f.v12.shader_storage_image_array_non_uniform_indexing, "shaderStorageImageArrayNonUniformIndexing"),
    (|f| &mut f.v13.synchronization2, "synchronization2"),
    (|f| &mut f.v13.dynamic_rendering, "dynamicRendering"),
    (|f| &mut f.v13.maintenance4, "maintenance4"),
];

/// Returns the names of required features that the device lacks.
pub(crate) fn missing_required(found: &Features) -> Vec<String> {
    let mut found = *found;
    let lacking = NEEDED.iter().filter(|(field, _)| *field(&mut found) == vk::FALSE);
    lacking.map(|(_, name)| (*name).to_owned()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ray_tracing_that_is_off_takes_its_culling_along() {
        let on = vk::TRUE;
        let mut features = Features::default();
        features.ext.ray_tracing.ray_tracing_pipeline = on;
        features.ext.ray_tracing.ray_traversal_primitive_culling = on;
        features.ext.ray_query.ray_query = on;
        features.limit_ray_tracing(false, true);
        let ext = &features.ext;
        assert_eq!(ext.ray_tracing.ray_tracing_pipeline, vk::FALSE);
        assert_eq!(ext.ray_tracing.ray_traversal_primitive_culling, vk::FALSE);
        assert_eq!(ext.ray_query.ray_query, vk::TRUE);
    }

    #[test]
    fn positions_are_fetched_by_either_kind_of_ray_tracing() {
        for (pipeline, query) in [(false, false), (false, true), (true, false), (true, true)] {
            let mut features = Features::default();
            features.ext.position_fetch.ray_tracing_position_fetch = vk::TRUE;
            features.limit_ray_tracing(pipeline, query);
            assert_eq!(features.ext.position_fetch.ray_tracing_position_fetch == vk::TRUE, pipeline || query);
        }
    }

    #[test]
    fn mesh_shaders_without_tasks_do_not_count() {
        let mut features = Features::default();
        (features.ext.mesh.mesh_shader, features.ext.mesh.multiview_mesh_shader) = (vk::TRUE, vk::TRUE);
        features.limit_mesh_shaders(true);
        assert_eq!((features.ext.mesh.mesh_shader, features.ext.mesh.multiview_mesh_shader), (0, 0));
    }
}
