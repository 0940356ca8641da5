//! Unit tests of the checks of a description, without a device.

use ash::vk::Handle;
use ash::{ext, khr};

use super::*;
use crate::error::device_candidate::DeviceKind;
use crate::gpu::caps::capabilities::Capabilities;
use crate::gpu::caps::features::Features;

unsafe extern "system" fn no_function(_: vk::Instance, _: *const std::ffi::c_char) -> vk::PFN_vkVoidFunction {
    None
}

/// A description with handles that are not null, and nothing on.
fn raw() -> RawContext<'static> {
    let static_fn = ash::StaticFn { get_instance_proc_addr: no_function };
    // SAFETY: no function of these objects is called.
    let (entry, instance, device) = unsafe {
        (
            ash::Entry::from_static_fn(static_fn),
            ash::Instance::load_with(|_| std::ptr::null(), vk::Instance::from_raw(1)),
            ash::Device::load_with(|_| std::ptr::null(), vk::Device::from_raw(2)),
        )
    };
    RawContext {
        entry,
        instance,
        instance_extensions: &[],
        physical_device: vk::PhysicalDevice::from_raw(3),
        device,
        device_extensions: &[],
        features: FeatureSet::NONE,
        ray_tracing_pipeline: false,
        trace_rays_indirect: false,
        primitive_culling: false,
        ray_query: false,
        position_fetch: false,
        mesh_shader: false,
        queue: vk::Queue::from_raw(4),
        queue_family: 0,
        compute_queue: None,
        transfer_queue: None,
    }
}

/// A device with every optional feature, ray tracing and mesh shaders.
fn device() -> PhysicalDevice {
    let mut features = Features::default();
    features.ext.ray_tracing.ray_traversal_primitive_culling = vk::TRUE;
    PhysicalDevice {
        raw: vk::PhysicalDevice::from_raw(3),
        capabilities: Capabilities {
            ray_tracing_pipeline: true,
            trace_rays_indirect: true,
            ray_query: true,
            position_fetch: true,
            mesh_shader: true,
            optional: FeatureSet::ALL,
            ..Default::default()
        },
        kind: DeviceKind::Other,
        local_memory_bytes: 0,
        queue_family: None,
        families: Vec::new(),
        queue_locations: Default::default(),
        missing: Vec::new(),
        features,
        extensions: Vec::new(),
    }
}

fn assert_wrong(answer: Result<()>, field: &str, words: &str) {
    match answer {
        Err(Error::InvalidUsage { object, message }) => {
            assert_eq!(object, format!("RawContext::{field}"), "{message}");
            assert!(message.contains(words), "{message}");
        }
        other => unreachable!("{field}: {other:?}"),
    }
}

#[test]
fn a_null_handle_is_named() {
    // SAFETY: no function of these objects is called.
    let (instance, device) = unsafe {
        (
            ash::Instance::load_with(|_| std::ptr::null(), vk::Instance::null()),
            ash::Device::load_with(|_| std::ptr::null(), vk::Device::null()),
        )
    };
    let (queue, null) = (vk::Queue::null(), Some((vk::Queue::null(), 0)));
    for (field, raw) in [
        ("instance", RawContext { instance, ..raw() }),
        ("device", RawContext { device, ..raw() }),
        ("physical_device", RawContext { physical_device: vk::PhysicalDevice::null(), ..raw() }),
        ("queue", RawContext { queue, ..raw() }),
        ("compute_queue", RawContext { compute_queue: null, ..raw() }),
        ("transfer_queue", RawContext { transfer_queue: null, ..raw() }),
    ] {
        assert_wrong(raw.check_handles(), field, "null");
    }
}

#[test]
fn a_queue_family_that_does_not_fit_is_named() {
    let family = |flags| QueueFamily { flags, count: 1, timestamp_bits: 64, copy_granularity: [1; 3] };
    let all = vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE | vk::QueueFlags::TRANSFER;
    let families = [family(all), family(vk::QueueFlags::TRANSFER), family(vk::QueueFlags::VIDEO_DECODE_KHR)];
    let (queue, other) = (raw().queue, vk::Queue::from_raw(5));
    for (field, raw, words) in [
        ("queue_family", RawContext { queue_family: 1, ..raw() }, "family 1 has no graphics or no compute"),
        ("queue_family", RawContext { queue_family: 9, ..raw() }, "no queue family 9"),
        ("compute_queue", RawContext { compute_queue: Some((other, 1)), ..raw() }, "family 1 has no compute"),
        ("compute_queue", RawContext { compute_queue: Some((other, 9)), ..raw() }, "no queue family 9"),
        (
            "transfer_queue",
            RawContext { transfer_queue: Some((other, 2)), ..raw() },
            "family 2 has no transfer",
        ),
        ("transfer_queue", RawContext { transfer_queue: Some((other, 9)), ..raw() }, "no queue family 9"),
        ("transfer_queue", RawContext { transfer_queue: Some((queue, 1)), ..raw() }, "families 1 and 0"),
    ] {
        assert_wrong(raw.check_queues(&families), field, words);
    }
    let raw = RawContext { transfer_queue: Some((other, 1)), ..raw() };
    assert!(raw.check_queues(&families).is_ok());
}

#[test]
fn a_feature_that_the_device_lacks_is_named_by_its_field() {
    let mut none = device();
    none.capabilities = Capabilities::default();
    none.features = Features::default();
    let features = FeatureSet::NONE.with(OptionalFeature::Int64);
    for (field, raw, words) in [
        ("features", RawContext { features, ..raw() }, "shaderInt64 cannot be on"),
        (
            "ray_tracing_pipeline",
            RawContext { ray_tracing_pipeline: true, ..raw() },
            "does not have the feature",
        ),
        (
            "trace_rays_indirect",
            RawContext { trace_rays_indirect: true, ..raw() },
            "does not have the feature",
        ),
        ("primitive_culling", RawContext { primitive_culling: true, ..raw() }, "does not have the feature"),
        ("ray_query", RawContext { ray_query: true, ..raw() }, "does not have the feature"),
        ("position_fetch", RawContext { position_fetch: true, ..raw() }, "does not have the feature"),
        ("mesh_shader", RawContext { mesh_shader: true, ..raw() }, "does not have the feature"),
    ] {
        assert_wrong(raw.check_features(&none), field, words);
    }
}

#[test]
fn a_flag_without_the_one_that_it_needs_is_named() {
    for (field, raw, words) in [
        ("trace_rays_indirect", RawContext { trace_rays_indirect: true, ..raw() }, "`ray_tracing_pipeline`"),
        ("primitive_culling", RawContext { primitive_culling: true, ..raw() }, "`ray_tracing_pipeline`"),
        ("position_fetch", RawContext { position_fetch: true, ..raw() }, "or `ray_query`"),
    ] {
        assert_wrong(raw.check_features(&device()), field, words);
    }
}

#[test]
fn a_missing_device_extension_is_named() {
    const STRUCTURES: [&CStr; 2] = [khr::acceleration_structure::NAME, khr::deferred_host_operations::NAME];
    let mut subset = device();
    subset.capabilities.portability_subset = true;
    let set = |feature| FeatureSet::NONE.with(feature);
    let clocks = set(OptionalFeature::CalibratedTimestamps);
    let local_read = RawContext { features: set(OptionalFeature::LocalRead), ..raw() };
    let query = RawContext { ray_query: true, device_extensions: &STRUCTURES, ..raw() };
    let pipeline = RawContext { ray_tracing_pipeline: true, device_extensions: &STRUCTURES[..1], ..raw() };
    for (device, raw, words) in [
        (subset, raw(), "VK_KHR_portability_subset is missing"),
        (
            device(),
            local_read,
            "VK_KHR_dynamic_rendering_local_read is missing; the feature dynamicRendering",
        ),
        (device(), RawContext { features: clocks, ..raw() }, "VK_KHR_calibrated_timestamps is missing"),
        (
            device(),
            RawContext { ray_query: true, ..raw() },
            "VK_KHR_acceleration_structure is missing; `ray_query`",
        ),
        (device(), query, "VK_KHR_ray_query is missing; `ray_query`"),
        (device(), pipeline, "VK_KHR_deferred_host_operations is missing"),
        (device(), RawContext { mesh_shader: true, ..raw() }, "VK_EXT_mesh_shader is missing; `mesh_shader`"),
    ] {
        assert_wrong(raw.check_features(&device), "device_extensions", words);
    }
    let device_extensions = &[ext::calibrated_timestamps::NAME];
    let raw = RawContext { features: clocks, device_extensions, ..raw() };
    assert!(raw.check_features(&device()).is_ok(), "either extension reads the clocks");
}

#[test]
fn a_missing_instance_extension_is_named() {
    const DEVICE: [&CStr; 2] = [khr::swapchain::NAME, ext::swapchain_maintenance1::NAME];
    let swapchain = FeatureSet::NONE.with(OptionalFeature::Swapchain);
    let raw = RawContext { features: swapchain, device_extensions: &DEVICE, ..raw() };
    assert_wrong(raw.check_features(&device()), "instance_extensions", "VK_KHR_surface is missing");
    let instance_extensions = &[khr::surface::NAME];
    let features = swapchain.with(OptionalFeature::SwapchainMaintenance1);
    let raw = RawContext { features, instance_extensions, ..raw };
    assert_wrong(raw.check_features(&device()), "instance_extensions", "VK_KHR_get_surface_capabilities2");
}

#[test]
fn features_of_portability_need_a_declaration_on_subsets_of_vulkan_only() {
    let declared = FeatureSet::NONE.with(OptionalFeature::TriangleFans);
    let whole = undeclared(declared, false);
    assert!(!whole.contains(OptionalFeature::ViewSwizzle) && whole.contains(OptionalFeature::Int64));
    let subset = undeclared(declared, true);
    assert!(subset.contains(OptionalFeature::ViewSwizzle));
    assert!(!subset.contains(OptionalFeature::TriangleFans));
}
