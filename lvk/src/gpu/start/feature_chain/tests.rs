//! Unit tests of merged feature chains, without a device.

use std::ffi::CString;

use ash::{ext, khr};

use super::*;
use crate::gpu::caps::enabled_features::every_field;

/// False for extensions without structures, which cannot be read back.
fn has_structure(field: FeatureField) -> bool {
    let mut features = Features::default();
    features.ext.set_featureless_extensions(&|_| true);
    *field(&mut features) == vk::FALSE
}

/// Every extension that has a structure.
fn all_extensions() -> Vec<&'static CStr> {
    vec![
        khr::acceleration_structure::NAME,
        khr::ray_tracing_pipeline::NAME,
        khr::ray_query::NAME,
        khr::ray_tracing_position_fetch::NAME,
        ext::mesh_shader::NAME,
        ext::shader_atomic_float::NAME,
        khr::dynamic_rendering_local_read::NAME,
        khr::fragment_shading_rate::NAME,
        khr::fragment_shader_barycentric::NAME,
        khr::index_type_uint8::NAME,
        ext::custom_border_color::NAME,
        ext::host_image_copy::NAME,
        khr::maintenance5::NAME,
        ext::graphics_pipeline_library::NAME,
        ext::device_fault::NAME,
        INVOCATION_REORDER_EXT,
        ash::nv::ray_tracing_invocation_reorder::NAME,
        khr::ray_tracing_maintenance1::NAME,
        ext::opacity_micromap::NAME,
        ext::swapchain_maintenance1::NAME,
        khr::portability_subset::NAME,
    ]
}

fn chain(wanted: Features, available: bool) -> FeatureChain {
    FeatureChain::new(wanted, all_extensions(), |_| available)
}

/// Returns the features, the types of the structures and the extensions of a description.
fn read(info: &vk::DeviceCreateInfo<'_>) -> (Features, Vec<StructureType>, Vec<CString>) {
    // SAFETY: the tests build valid chains.
    unsafe {
        let links = chain_links(info.p_next);
        let features = read_chain(&links, info.p_enabled_features);
        let names = extension_names(info).into_iter().map(CStr::to_owned).collect();
        (features, links.iter().map(|link| link.s_type).collect(), names)
    }
}

fn assert_no_structure_comes_twice(types: &[StructureType]) {
    for (at, one) in types.iter().enumerate() {
        assert!(!types[..at].contains(one), "{one:?} comes twice");
    }
}

#[test]
fn every_feature_reaches_an_empty_description() {
    for field in every_field().filter(|field| has_structure(*field)) {
        let mut wanted = Features::default();
        *field(&mut wanted) = vk::TRUE;
        let mut added = chain(wanted, true);
        // SAFETY: the description is empty.
        let info = unsafe { added.merge_into(vk::DeviceCreateInfo::default()) }.unwrap();
        let (mut found, types, names) = read(&info);
        assert_no_structure_comes_twice(&types);
        assert_eq!(names.len(), all_extensions().len());
        let on = every_field().filter(|other| *other(&mut found) == vk::TRUE).count();
        assert!(*field(&mut found) == vk::TRUE && on == 1, "{wanted:?}");
    }
}

#[test]
fn every_feature_reaches_a_chain_of_all_versions_and_extensions() {
    for field in every_field().filter(|field| has_structure(*field)) {
        let mut wanted = Features::default();
        *field(&mut wanted) = vk::TRUE;
        let mut v11 = vk::PhysicalDeviceVulkan11Features::default();
        let mut v12 = vk::PhysicalDeviceVulkan12Features::default();
        let mut v13 = vk::PhysicalDeviceVulkan13Features::default();
        let mut extensions = ExtensionFeatures::default();
        let all = vk::PhysicalDeviceFeatures2::default();
        let all = all.push_next(&mut v11).push_next(&mut v12).push_next(&mut v13);
        let mut all = extensions.append_to_chain(all, &|_| true);
        let info = vk::DeviceCreateInfo::default().push_next(&mut all);
        let before = read(&info).1;
        let mut added = chain(wanted, true);
        // SAFETY: the chain consists of the structures above.
        let info = unsafe { added.merge_into(info) }.unwrap();
        let (mut found, types, _) = read(&info);
        assert_eq!(types, before, "nothing is missing");
        assert!(info.p_enabled_features.is_null(), "VkPhysicalDeviceFeatures2 takes its place");
        assert_eq!(*field(&mut found), vk::TRUE, "{wanted:?}");
    }
}

#[test]
fn every_feature_reaches_a_chain_of_promoted_structures() {
    for field in every_field().filter(|field| has_structure(*field)) {
        let mut wanted = Features::default();
        *field(&mut wanted) = vk::TRUE;
        let mut views = vk::PhysicalDeviceMultiviewFeatures::default();
        let mut timelines = vk::PhysicalDeviceTimelineSemaphoreFeatures::default();
        let mut sync = vk::PhysicalDeviceSynchronization2Features::default();
        let info = vk::DeviceCreateInfo::default()
            .push_next(&mut views)
            .push_next(&mut timelines)
            .push_next(&mut sync);
        let mut added = chain(wanted, true);
        // SAFETY: the chain consists of the structures above.
        let info = unsafe { added.merge_into(info) }.unwrap();
        let (mut found, types, names) = read(&info);
        assert_no_structure_comes_twice(&types);
        for version in [Version::V11, Version::V12, Version::V13] {
            assert!(!types.contains(&version.structure_type()), "{version:?}");
        }
        let substitute = SUBSTITUTES.iter().find(|(other, _)| *other(&mut wanted) == vk::TRUE);
        // Has no effect of its own, and no structure of a promoted extension.
        let is_indexing = wanted.v12.descriptor_indexing == vk::TRUE;
        match substitute {
            Some((_, name)) => assert!(names.iter().any(|found| found.as_c_str() == *name), "{name:?}"),
            None => assert!(*field(&mut found) == vk::TRUE || is_indexing, "{wanted:?}"),
        }
    }
}

#[test]
fn features_of_the_engine_stay_on() {
    let mut wanted = Features::default();
    wanted.core.shader_int64 = vk::TRUE;
    wanted.v12.timeline_semaphore = vk::TRUE;
    wanted.ext.ray_query.ray_query = vk::TRUE;
    let core = vk::PhysicalDeviceFeatures::default().sparse_binding(true);
    let mut indexing = vk::PhysicalDeviceDescriptorIndexingFeatures::default()
        .descriptor_binding_variable_descriptor_count(true);
    let mut robust = vk::PhysicalDeviceRobustness2FeaturesEXT::default().null_descriptor(true);
    let mut culling = vk::PhysicalDeviceRayTracingPipelineFeaturesKHR::default().ray_tracing_pipeline(true);
    let given = [ext::robustness2::NAME.as_ptr(), khr::ray_query::NAME.as_ptr()];
    let info = vk::DeviceCreateInfo::default()
        .enabled_features(&core)
        .enabled_extension_names(&given)
        .push_next(&mut indexing)
        .push_next(&mut robust)
        .push_next(&mut culling);
    let mut added = chain(wanted, true);
    // SAFETY: the chain consists of the structures above.
    let info = unsafe { added.merge_into(info) }.unwrap();
    let (found, types, names) = read(&info);
    assert_eq!([found.core.shader_int64, found.core.sparse_binding], [vk::TRUE; 2]);
    assert_eq!(found.v12.timeline_semaphore, vk::TRUE);
    assert_eq!(found.ext.ray_query.ray_query, vk::TRUE);
    assert!(types.contains(&<vk::PhysicalDeviceRobustness2FeaturesEXT<'_>>::STRUCTURE_TYPE));
    assert_eq!(names.len(), all_extensions().len() + 1, "ray queries come once");
    assert_eq!(core.shader_int64, vk::FALSE, "the engine's own structure may be constant");
    assert_eq!(robust.null_descriptor, vk::TRUE);
    assert_eq!(indexing.descriptor_binding_variable_descriptor_count, vk::TRUE);
    assert_eq!(culling.ray_tracing_pipeline, vk::TRUE);
}

#[test]
fn extensions_and_the_features_that_they_stand_for_are_on_together() {
    let given = [
        khr::draw_indirect_count::NAME.as_ptr(),
        ext::shader_viewport_index_layer::NAME.as_ptr(),
        khr::shader_draw_parameters::NAME.as_ptr(),
    ];
    let info = vk::DeviceCreateInfo::default().enabled_extension_names(&given);
    let mut added = chain(Features::default(), true);
    // SAFETY: the description has names only.
    let info = unsafe { added.merge_into(info) }.unwrap();
    let found = read(&info).0;
    let v12 = [found.v12.draw_indirect_count, found.v12.shader_output_layer];
    assert_eq!(v12, [vk::TRUE; 2]);
    assert_eq!([found.v12.shader_output_viewport_index, found.v11.shader_draw_parameters], [vk::TRUE; 2]);
    assert_eq!(found.v12.sampler_filter_minmax, vk::FALSE);
}

#[test]
fn a_feature_without_a_place_is_refused() {
    let mut wanted = Features::default();
    wanted.v12.draw_indirect_count = vk::TRUE;
    let mut timelines = vk::PhysicalDeviceTimelineSemaphoreFeatures::default();
    let info = vk::DeviceCreateInfo::default().push_next(&mut timelines);
    let mut added = chain(wanted, false);
    // SAFETY: the chain consists of the structure above.
    match unsafe { added.merge_into(info) } {
        Err(Error::Unsupported { why, .. }) => assert!(why.contains("VK_KHR_draw_indirect_count"), "{why}"),
        _ => unreachable!("the device lacks the extension"),
    }
}
