//! Checks that the device's features allow a module's SPIR-V capabilities.

use ::spirv::Capability as C;
use ash::vk;

use super::atomics::{Atomic, AtomicStorage};
use crate::error::{Error, Result};
use crate::gpu::caps::features::Features;
use crate::shader::{Reflection, ShaderStage};

/// Capabilities that every supported device allows: they need no feature, or a feature that the library requires.
const FREE: [C; 18] = [
    C::Matrix,
    C::Shader,
    C::Sampled1D,
    C::Image1D,
    C::SampledBuffer,
    C::ImageBuffer,
    C::ImageQuery,
    C::DerivativeControl,
    C::DeviceGroup,
    C::GroupNonUniform,
    C::ShaderNonUniform,
    C::RuntimeDescriptorArray,
    C::SampledImageArrayDynamicIndexing,
    C::StorageImageArrayDynamicIndexing,
    C::SampledImageArrayNonUniformIndexing,
    C::StorageImageArrayNonUniformIndexing,
    C::StorageImageWriteWithoutFormat,
    C::PhysicalStorageBufferAddresses,
];

/// The capability `ShaderInvocationReorderEXT`, which the crate `spirv` 0.3 lacks.
const SHADER_INVOCATION_REORDER_EXT: u32 = 5388;

/// A capability, a function that returns true if it is allowed, and the name of the feature that allows it.
type CapabilityRow = (C, fn(&Features) -> vk::Bool32, &'static str);

#[rustfmt::skip]
const BY_FEATURE: [CapabilityRow; 54] = [
    (C::Geometry, |f| f.core.geometry_shader, "geometryShader"),
    (C::Tessellation, |f| f.core.tessellation_shader, "tessellationShader"),
    (C::GeometryPointSize, point_size, "shaderTessellationAndGeometryPointSize"),
    (C::TessellationPointSize, point_size, "shaderTessellationAndGeometryPointSize"),
    (C::Float16, |f| f.v12.shader_float16, "shaderFloat16"),
    (C::Float64, |f| f.core.shader_float64, "shaderFloat64"),
    (C::Int8, |f| f.v12.shader_int8, "shaderInt8"),
    (C::Int16, |f| f.core.shader_int16, "shaderInt16"),
    (C::Int64, |f| f.core.shader_int64, "shaderInt64"),
    (C::Int64Atomics, int64_atomics, "shaderBufferInt64Atomics"),
    (C::AtomicFloat32AddEXT, float_add, "shaderBufferFloat32AtomicAdd"),
    (C::StorageBuffer8BitAccess, |f| f.v12.storage_buffer8_bit_access, "storageBuffer8BitAccess"),
    (C::UniformAndStorageBuffer8BitAccess, |f| f.v12.uniform_and_storage_buffer8_bit_access, "uniformAndStorageBuffer8BitAccess"),
    (C::StoragePushConstant8, |f| f.v12.storage_push_constant8, "storagePushConstant8"),
    (C::StorageBuffer16BitAccess, |f| f.v11.storage_buffer16_bit_access, "storageBuffer16BitAccess"),
    (C::UniformAndStorageBuffer16BitAccess, |f| f.v11.uniform_and_storage_buffer16_bit_access, "uniformAndStorageBuffer16BitAccess"),
    (C::StoragePushConstant16, |f| f.v11.storage_push_constant16, "storagePushConstant16"),
    (C::StorageInputOutput16, |f| f.v11.storage_input_output16, "storageInputOutput16"),
    (C::DrawParameters, |f| f.v11.shader_draw_parameters, "shaderDrawParameters"),
    (C::ClipDistance, |f| f.core.shader_clip_distance, "shaderClipDistance"),
    (C::CullDistance, |f| f.core.shader_cull_distance, "shaderCullDistance"),
    (C::SampleRateShading, |f| f.core.sample_rate_shading, "sampleRateShading"),
    (C::InterpolationFunction, interpolation, "sampleRateShading or shaderSampleRateInterpolationFunctions"),
    (C::ImageGatherExtended, |f| f.core.shader_image_gather_extended, "shaderImageGatherExtended"),
    (C::ImageCubeArray, |f| f.core.image_cube_array, "imageCubeArray"),
    (C::SampledCubeArray, |f| f.core.image_cube_array, "imageCubeArray"),
    (C::StorageImageExtendedFormats, |f| f.core.shader_storage_image_extended_formats, "shaderStorageImageExtendedFormats"),
    (C::StorageImageReadWithoutFormat, |f| f.core.shader_storage_image_read_without_format, "shaderStorageImageReadWithoutFormat"),
    (C::VulkanMemoryModel, |f| f.v12.vulkan_memory_model, "vulkanMemoryModel"),
    (C::VulkanMemoryModelDeviceScope, |f| f.v12.vulkan_memory_model_device_scope, "vulkanMemoryModelDeviceScope"),
    (C::DemoteToHelperInvocation, |f| f.v13.shader_demote_to_helper_invocation, "shaderDemoteToHelperInvocation"),
    (C::DotProduct, dot_product, "shaderIntegerDotProduct"),
    (C::DotProductInputAll, dot_product, "shaderIntegerDotProduct"),
    (C::DotProductInput4x8Bit, dot_product, "shaderIntegerDotProduct"),
    (C::DotProductInput4x8BitPacked, dot_product, "shaderIntegerDotProduct"),
    (C::RayTracingKHR, |f| f.ext.ray_tracing.ray_tracing_pipeline, "rayTracingPipeline"),
    (C::RayQueryKHR, |f| f.ext.ray_query.ray_query, "rayQuery"),
    (C::RayTraversalPrimitiveCullingKHR, |f| f.ext.ray_tracing.ray_traversal_primitive_culling, "rayTraversalPrimitiveCulling"),
    (C::RayCullMaskKHR, |f| f.ext.ray_tracing_maintenance1.ray_tracing_maintenance1, "rayTracingMaintenance1"),
    (C::RayTracingPositionFetchKHR, |f| f.ext.position_fetch.ray_tracing_position_fetch, "rayTracingPositionFetch"),
    (C::RayQueryPositionFetchKHR, |f| f.ext.position_fetch.ray_tracing_position_fetch, "rayTracingPositionFetch"),
    (C::ShaderInvocationReorderNV, |f| f.ext.invocation_reorder_nv.ray_tracing_invocation_reorder, "VK_NV_ray_tracing_invocation_reorder"),
    (C::RayTracingOpacityMicromapEXT, |f| f.ext.micromaps.micromap, "micromap"),
    (C::MeshShadingEXT, |f| f.ext.mesh.mesh_shader, "meshShader"),
    (C::MinLod, |f| f.core.shader_resource_min_lod, "shaderResourceMinLod"),
    (C::VariablePointers, |f| f.v11.variable_pointers, "variablePointers"),
    (C::MultiView, |f| f.v11.multiview, "multiview"),
    (C::InputAttachment, |f| f.ext.local_read.dynamic_rendering_local_read, "dynamicRenderingLocalRead"),
    (C::ShaderLayer, |f| f.v12.shader_output_layer, "shaderOutputLayer"),
    (C::StorageImageMultisample, multisampled_storage, "shaderStorageImageMultisample"),
    (C::ImageMSArray, multisampled_storage, "shaderStorageImageMultisample"),
    (C::FragmentShadingRateKHR, shading_rate, "pipelineFragmentShadingRate"),
    (C::FragmentBarycentricKHR, |f| f.ext.barycentrics.fragment_shader_barycentric, "fragmentShaderBarycentric"),
    (C::VariablePointersStorageBuffer, |f| f.v11.variable_pointers_storage_buffer, "variablePointersStorageBuffer"),
];

const BY_SUBGROUP: [(C, vk::SubgroupFeatureFlags); 7] = [
    (C::GroupNonUniformVote, vk::SubgroupFeatureFlags::VOTE),
    (C::GroupNonUniformArithmetic, vk::SubgroupFeatureFlags::ARITHMETIC),
    (C::GroupNonUniformBallot, vk::SubgroupFeatureFlags::BALLOT),
    (C::GroupNonUniformShuffle, vk::SubgroupFeatureFlags::SHUFFLE),
    (C::GroupNonUniformShuffleRelative, vk::SubgroupFeatureFlags::SHUFFLE_RELATIVE),
    (C::GroupNonUniformClustered, vk::SubgroupFeatureFlags::CLUSTERED),
    (C::GroupNonUniformQuad, vk::SubgroupFeatureFlags::QUAD),
];

/// Fails unless the device has pipelines of this stage.
pub(crate) fn check_stage(name: &str, stage: ShaderStage, features: &Features) -> Result<()> {
    if matches!(stage, ShaderStage::Task | ShaderStage::Mesh) && features.ext.mesh.mesh_shader == vk::FALSE {
        let what = format!("the {} stage of shader '{name}'", stage.name());
        return Err(Error::unsupported(what, feature_message("meshShader")));
    }
    Ok(())
}

/// Fails unless the enabled `features` allow everything that the module needs beside the capabilities in `extra`.
pub(crate) fn check_capabilities(
    name: &str,
    stage: ShaderStage,
    module: &Reflection,
    features: &Features,
    extra: &[u32],
) -> Result<()> {
    let subgroup = |c: &u32| missing_subgroup_support(*c, stage, features);
    for capability in module.capabilities.iter().filter(|capability| !extra.contains(capability)) {
        if let Some(why) = subgroup(capability).or_else(|| missing_capability(*capability, features)) {
            let what = format!("capability {} of shader '{name}'", capability_name(*capability));
            return Err(Error::unsupported(what, why));
        }
    }
    for atomic in &module.atomics {
        if let Some(why) = missing_atomic_support(*atomic, features) {
            return Err(Error::unsupported(format!("{} in shader '{name}'", atomic_name(*atomic)), why));
        }
    }
    Ok(())
}

/// Returns the reason if the capability is not allowed.
fn missing_capability(capability: u32, features: &Features) -> Option<String> {
    let is = |known: C| known as u32 == capability;
    if FREE.into_iter().any(is) || BY_SUBGROUP.iter().any(|row| is(row.0)) {
        return None;
    }
    if capability == SHADER_INVOCATION_REORDER_EXT {
        let allowed = features.ext.invocation_reorder.ray_tracing_invocation_reorder == vk::TRUE;
        return (!allowed).then(|| feature_message("rayTracingInvocationReorder"));
    }
    match BY_FEATURE.iter().find(|row| is(row.0)) {
        Some((_, allowed, _)) if allowed(features) == vk::TRUE => None,
        Some((_, _, feature)) => Some(feature_message(feature)),
        None => Some("lvk turns on no device feature or extension that allows it".to_owned()),
    }
}

fn missing_subgroup_support(capability: u32, stage: ShaderStage, features: &Features) -> Option<String> {
    let row = BY_SUBGROUP.iter().find(|row| row.0 as u32 == capability);
    let operation = match row {
        Some((_, operation)) => *operation,
        None if capability == C::GroupNonUniform as u32 => vk::SubgroupFeatureFlags::BASIC,
        None => return None,
    };
    let subgroups = features.subgroups;
    let is_quad_stage = matches!(stage, ShaderStage::Fragment | ShaderStage::Compute);
    let is_quad = operation == vk::SubgroupFeatureFlags::QUAD;
    if !subgroups.operations.contains(operation) {
        Some(format!(
            "the device has no subgroup operations of kind {operation:?} (subgroupSupportedOperations)"
        ))
    } else if !subgroups.stages.contains(stage.raw()) {
        let stage = stage.name();
        Some(format!("the device has no subgroup operations in the {stage} stage (subgroupSupportedStages)"))
    } else if is_quad && !is_quad_stage && !subgroups.quads_everywhere {
        let stage = stage.name();
        Some(format!(
            "the device has no quad operations in the {stage} stage (subgroupQuadOperationsInAllStages)"
        ))
    } else {
        None
    }
}

fn missing_atomic_support(atomic: Atomic, features: &Features) -> Option<String> {
    let on = &features.ext.float_atomics;
    let (allowed, feature) = match (atomic.is_float, atomic.bits, atomic.place, atomic.is_add) {
        (false, 64, AtomicStorage::Buffer, _) => {
            (features.v12.shader_buffer_int64_atomics, "shaderBufferInt64Atomics")
        }
        (false, 64, AtomicStorage::Shared, _) => {
            (features.v12.shader_shared_int64_atomics, "shaderSharedInt64Atomics")
        }
        (true, 32, AtomicStorage::Buffer, false) => {
            (on.shader_buffer_float32_atomics, "shaderBufferFloat32Atomics")
        }
        (true, 32, AtomicStorage::Buffer, true) => {
            (on.shader_buffer_float32_atomic_add, "shaderBufferFloat32AtomicAdd")
        }
        (true, 32, AtomicStorage::Shared, false) => {
            (on.shader_shared_float32_atomics, "shaderSharedFloat32Atomics")
        }
        (true, 32, AtomicStorage::Shared, true) => {
            (on.shader_shared_float32_atomic_add, "shaderSharedFloat32AtomicAdd")
        }
        (true, 32, AtomicStorage::Image, false) => {
            (on.shader_image_float32_atomics, "shaderImageFloat32Atomics")
        }
        (true, 32, AtomicStorage::Image, true) => {
            (on.shader_image_float32_atomic_add, "shaderImageFloat32AtomicAdd")
        }
        _ => return Some("lvk turns on no device feature that allows them".to_owned()),
    };
    (allowed == vk::FALSE).then(|| feature_message(feature))
}

fn feature_message(feature: &str) -> String {
    format!("the device lacks the feature {feature}, or it was turned off")
}

fn capability_name(capability: u32) -> String {
    C::from_u32(capability).map_or_else(|| format!("number {capability}"), |known| format!("{known:?}"))
}

fn atomic_name(atomic: Atomic) -> String {
    let kind = if atomic.is_float { "float" } else { "integer" };
    let place = match atomic.place {
        AtomicStorage::Buffer => "buffers",
        AtomicStorage::Shared => "shared memory",
        AtomicStorage::Image => "images",
    };
    format!("atomic operations on {}-bit {kind}s in {place}", atomic.bits)
}

fn point_size(features: &Features) -> vk::Bool32 {
    features.core.shader_tessellation_and_geometry_point_size
}

fn multisampled_storage(features: &Features) -> vk::Bool32 {
    features.core.shader_storage_image_multisample
}

/// True if shading rates can be read. Any of the three features is enough, and every device with one of them has this
/// one.
fn shading_rate(features: &Features) -> vk::Bool32 {
    features.ext.shading_rate.pipeline_fragment_shading_rate
}

fn dot_product(features: &Features) -> vk::Bool32 {
    features.v13.shader_integer_dot_product
}

fn interpolation(features: &Features) -> vk::Bool32 {
    features.core.sample_rate_shading & features.ext.portability.shader_sample_rate_interpolation_functions
}

/// True if one storage allows the capability. The operations are checked individually.
fn int64_atomics(features: &Features) -> vk::Bool32 {
    features.v12.shader_buffer_int64_atomics | features.v12.shader_shared_int64_atomics
}

/// See [`int64_atomics`].
fn float_add(features: &Features) -> vk::Bool32 {
    let on = &features.ext.float_atomics;
    on.shader_buffer_float32_atomic_add
        | on.shader_shared_float32_atomic_add
        | on.shader_image_float32_atomic_add
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test")]
    use super::*;
    use crate::gpu::caps::optional_features::FeatureSet;

    fn module(capabilities: &[C]) -> Reflection {
        let capabilities = capabilities.iter().map(|c| *c as u32).collect();
        Reflection { capabilities, ..Reflection::default() }
    }

    /// Returns the text of the error, if there is one.
    fn refusal(stage: ShaderStage, module: &Reflection, features: &Features) -> Option<String> {
        match check_capabilities("test", stage, module, features, &[]) {
            Ok(()) => None,
            Err(error @ Error::Unsupported { .. }) => Some(error.to_string()),
            Err(other) => panic!("{other:?}"),
        }
    }

    fn all_subgroups() -> Features {
        let mut features = Features::default();
        features.subgroups.operations = vk::SubgroupFeatureFlags::from_raw(u32::MAX);
        features.subgroups.stages = vk::ShaderStageFlags::from_raw(u32::MAX);
        features
    }

    #[test]
    fn free_capabilities_need_no_feature() {
        assert_eq!(refusal(ShaderStage::Compute, &module(&FREE), &all_subgroups()), None);
    }

    #[test]
    fn a_missing_feature_is_named_with_the_shader_and_the_capability() {
        for (capability, _, feature) in BY_FEATURE {
            let found = refusal(ShaderStage::Vertex, &module(&[C::Shader, capability]), &all_subgroups());
            let found = found.unwrap_or_else(|| panic!("{capability:?} is allowed"));
            let start = format!("not supported: capability {capability:?} of shader 'test': ");
            assert!(found.starts_with(&start) && found.contains(feature), "{found}");
        }
    }

    #[test]
    fn each_capability_is_listed_once() {
        let mut listed: Vec<u32> = FREE.iter().map(|c| *c as u32).collect();
        listed.extend(BY_FEATURE.iter().map(|row| row.0 as u32));
        listed.extend(BY_SUBGROUP.iter().map(|row| row.0 as u32));
        let count = listed.len();
        listed.sort_unstable();
        listed.dedup();
        assert_eq!(listed.len(), count);
    }

    #[test]
    fn a_feature_that_is_on_allows_its_capability_and_no_other() {
        let mut features = all_subgroups();
        features.v12.shader_float16 = vk::TRUE;
        assert_eq!(refusal(ShaderStage::Compute, &module(&[C::Float16]), &features), None);
        let found = refusal(ShaderStage::Compute, &module(&[C::Float16, C::Int64]), &features).unwrap();
        assert!(found.contains("Int64") && found.contains("shaderInt64"), "{found}");
    }

    #[test]
    fn a_feature_that_is_not_wanted_allows_nothing() {
        let mut all = all_subgroups();
        all.core.multi_viewport = vk::TRUE;
        all.core.shader_resource_residency = vk::TRUE;
        let features = Features::supported_subset(&all, FeatureSet::ALL);
        for capability in [C::Kernel, C::MultiViewport, C::SparseResidency, C::Linkage] {
            let found = refusal(ShaderStage::Compute, &module(&[capability]), &features).unwrap();
            assert!(found.contains("lvk turns on no device feature"), "{found}");
        }
    }

    #[test]
    fn capabilities_that_the_caller_allows_are_allowed() {
        let of = module(&[C::Kernel, C::Linkage]);
        let check =
            |extra: &[u32]| check_capabilities("test", ShaderStage::Compute, &of, &all_subgroups(), extra);
        assert!(check(&[C::Kernel as u32, C::Linkage as u32]).is_ok());
        assert!(check(&[C::Linkage as u32]).unwrap_err().to_string().contains("Kernel"));
    }

    #[test]
    fn an_unknown_number_is_refused_by_its_number() {
        let module = Reflection { capabilities: vec![4_000_000_000], ..Reflection::default() };
        let found = refusal(ShaderStage::Compute, &module, &all_subgroups()).unwrap();
        assert!(found.starts_with("not supported: capability number 4000000000"), "{found}");
    }

    #[test]
    fn subgroups_depend_on_operation_and_stage() {
        let quad = module(&[C::GroupNonUniform, C::GroupNonUniformQuad]);
        let mut features = all_subgroups();
        assert_eq!(refusal(ShaderStage::Compute, &quad, &features), None);
        assert!(refusal(ShaderStage::Vertex, &quad, &features).unwrap().contains("InAllStages"));
        features.subgroups.quads_everywhere = true;
        assert_eq!(refusal(ShaderStage::Vertex, &quad, &features), None);
        features.subgroups.stages = vk::ShaderStageFlags::COMPUTE;
        assert!(refusal(ShaderStage::Vertex, &quad, &features).unwrap().contains("vertex stage"));
        features.subgroups.operations = vk::SubgroupFeatureFlags::BASIC;
        assert!(refusal(ShaderStage::Compute, &quad, &features).unwrap().contains("QUAD"));
    }

    #[test]
    fn mesh_stages_are_refused_where_the_feature_is_off() {
        let mut with = Features::default();
        with.ext.mesh.mesh_shader = vk::TRUE;
        for stage in ShaderStage::ALL {
            let refused = check_stage("test", stage, &Features::default()).is_err();
            assert_eq!(refused, matches!(stage, ShaderStage::Task | ShaderStage::Mesh), "{stage:?}");
            assert!(check_stage("test", stage, &with).is_ok());
        }
    }

    #[test]
    fn atomics_are_allowed_where_their_feature_is_on() {
        let mut features = all_subgroups();
        features.v12.shader_buffer_int64_atomics = vk::TRUE;
        features.ext.float_atomics.shader_shared_float32_atomics = vk::TRUE;
        let one = |is_float, bits, is_add, place| Reflection {
            atomics: vec![Atomic { is_float, bits, is_add, place }],
            ..Reflection::default()
        };
        let lacks = |module: &Reflection| refusal(ShaderStage::Compute, module, &features);
        assert_eq!(lacks(&one(false, 64, false, AtomicStorage::Buffer)), None);
        assert_eq!(lacks(&one(true, 32, false, AtomicStorage::Shared)), None);
        let found = lacks(&one(false, 64, false, AtomicStorage::Shared)).unwrap();
        assert!(
            found.contains("64-bit integers in shared memory") && found.contains("SharedInt64"),
            "{found}"
        );
        let found = lacks(&one(true, 32, true, AtomicStorage::Shared)).unwrap();
        assert!(found.contains("shaderSharedFloat32AtomicAdd"), "{found}");
        assert!(lacks(&one(true, 64, false, AtomicStorage::Buffer)).unwrap().contains("lvk turns on no"));
    }
}
