//! The features of a device that the library enables.

use ash::vk;

use super::features::{FeatureField, Features, NEEDED};
use super::optional_features::{FeatureSet, OptionalFeature};

impl Features {
    /// Returns the subset of the reported features that the library enables: required features, features
    /// guaranteed by Vulkan 1.3, the optional features of the set, ray tracing and mesh shaders.
    pub(crate) fn supported_subset(found: &Self, optional: FeatureSet) -> Self {
        let mut wanted = Self { subgroups: found.subgroups, ..Self::default() };
        if optional.contains(OptionalFeature::CalibratedTimestamps) {
            wanted.calibration = found.calibration;
        }
        let mut source = *found;
        for field in NEEDED.iter().map(|(field, _)| field).chain(&PROMISED).chain(&APART) {
            *field(&mut wanted) = *field(&mut source);
        }
        optional.enable(&mut wanted, found);
        wanted
    }
}

impl Features {
    /// Enables the features that `other` enables, of all that the library ever enables.
    pub(crate) fn enable_all(&mut self, other: &Self) {
        let mut other = *other;
        for field in every_field().filter(|field| *field(&mut other) == vk::TRUE) {
            *field(self) = vk::TRUE;
        }
    }
}

/// Returns every feature that the library ever enables.
pub(crate) fn every_field() -> impl Iterator<Item = FeatureField> {
    let needed = NEEDED.iter().map(|(field, _)| *field);
    needed.chain(PROMISED).chain(APART).chain(OptionalFeature::fields())
}

/// Features that every Vulkan 1.3 device has. Shaders of SPIR-V 1.6 end an invocation by
/// `OpTerminateInvocation`, which needs no capability.
const PROMISED: [FeatureField; 9] = [
    |f| &mut f.core.robust_buffer_access,
    |f| &mut f.v12.descriptor_indexing,
    |f| &mut f.v12.shader_subgroup_extended_types,
    |f| &mut f.v12.vulkan_memory_model,
    |f| &mut f.v12.vulkan_memory_model_device_scope,
    |f| &mut f.v13.shader_demote_to_helper_invocation,
    |f| &mut f.v13.shader_terminate_invocation,
    |f| &mut f.v13.shader_zero_initialize_workgroup_memory,
    |f| &mut f.v13.shader_integer_dot_product,
];

/// Ray tracing and mesh shaders, which have separate flags.
const APART: [FeatureField; 9] = [
    |f| &mut f.ext.structures.acceleration_structure,
    |f| &mut f.ext.structures.descriptor_binding_acceleration_structure_update_after_bind,
    |f| &mut f.ext.ray_tracing.ray_tracing_pipeline,
    |f| &mut f.ext.ray_tracing.ray_tracing_pipeline_trace_rays_indirect,
    |f| &mut f.ext.ray_tracing.ray_traversal_primitive_culling,
    |f| &mut f.ext.ray_query.ray_query,
    |f| &mut f.ext.position_fetch.ray_tracing_position_fetch,
    |f| &mut f.ext.mesh.mesh_shader,
    |f| &mut f.ext.mesh.task_shader,
];

#[cfg(test)]
mod tests {
    use super::super::features::missing_required;
    use super::*;

    #[test]
    fn only_supported_features_are_enabled() {
        let mut found = Features::default();
        found.core.shader_int64 = vk::TRUE;
        found.core.sparse_binding = vk::TRUE;
        found.v12.shader_float16 = vk::TRUE;
        found.v13.dynamic_rendering = vk::TRUE;
        let wanted = Features::supported_subset(&found, FeatureSet::ALL);
        assert_eq!((wanted.core.shader_int64, wanted.core.sparse_binding), (vk::TRUE, vk::FALSE));
        assert_eq!((wanted.v12.shader_float16, wanted.v12.shader_int8), (vk::TRUE, vk::FALSE));
        let without = FeatureSet::ALL.without([OptionalFeature::Int64].into_iter().collect());
        let wanted = Features::supported_subset(&found, without);
        assert_eq!((wanted.core.shader_int64, wanted.v13.dynamic_rendering), (vk::FALSE, vk::TRUE));
        assert!(missing_required(&found).contains(&"bufferDeviceAddress".to_owned()));
    }
}
