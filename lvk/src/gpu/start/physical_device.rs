//! One physical device: its features, properties and queues, as Vulkan reports them.

use std::ffi::{CStr, CString};

use ash::vk;

use crate::error::device_candidate::{DeviceCandidate, DeviceKind};
use crate::error::{Error, Result};
use crate::gpu::caps::capabilities::Capabilities;
use crate::gpu::caps::features::{Calibration, Features, Subgroups, missing_required};
use crate::gpu::caps::invocation_reorder::InvocationReorderProperties;
use crate::gpu::caps::limits::{Limits, MicromapLimits};
use crate::gpu::caps::lowering_preference;
use crate::gpu::caps::mesh_limits::MeshLimits;
use crate::gpu::caps::optional_features::{FeatureSet, OptionalFeature};
use crate::gpu::caps::queues::{QueueFamily, QueueLocation, describe_queues, locate_queues, queue_families};
use crate::gpu::caps::ray_query_path::RayQueryPath;
use crate::gpu::caps::ray_tracing_pipeline_path::RayTracingPipelinePath;
use crate::gpu::caps::shading_rate::ShadingRateLimits;
use crate::gpu::caps::subgroup_limits::SubgroupLimits;

/// One physical device as reported, before a device is selected.
pub(crate) struct PhysicalDevice {
    pub(crate) raw: vk::PhysicalDevice,
    pub(crate) capabilities: Capabilities,
    pub(crate) kind: DeviceKind,
    pub(crate) local_memory_bytes: u64,
    /// The queue family with graphics and compute.
    pub(crate) queue_family: Option<u32>,
    pub(crate) families: Vec<QueueFamily>,
    /// The device's queue for each queue of the library.
    pub(crate) queue_locations: [QueueLocation; 3],
    /// Required core features that the device lacks.
    pub(crate) missing: Vec<String>,
    /// Features as reported.
    pub(crate) features: Features,
    pub(crate) extensions: Vec<CString>,
}

impl PhysicalDevice {
    pub(crate) fn query(instance: &ash::Instance, raw: vk::PhysicalDevice) -> Result<Self> {
        // SAFETY: `raw` was enumerated from `instance`.
        let plain = unsafe { instance.get_physical_device_properties(raw) };
        let name = device_name(&plain);
        // SAFETY: as above.
        let extensions = unsafe { instance.enumerate_device_extension_properties(raw) }
            .map_err(Error::vulkan("vkEnumerateDeviceExtensionProperties", &name))?;
        let names = extensions.iter().filter_map(|extension| extension.extension_name_as_c_str().ok());
        let families = queue_families(instance, raw);
        let everything = vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE;
        let queue = families.iter().position(|family| family.flags.contains(everything));
        let mut found = Self {
            raw,
            capabilities: Capabilities {
                api_version: version(plain.api_version),
                is_cpu: plain.device_type == vk::PhysicalDeviceType::CPU,
                prefers_lowered_pipelines: lowering_preference::is_preferred(plain.vendor_id, &name),
                device_name: name,
                ..Default::default()
            },
            kind: device_kind(plain.device_type),
            local_memory_bytes: local_memory(instance, raw),
            queue_family: None,
            families,
            queue_locations: Default::default(),
            missing: Vec::new(),
            features: Features::default(),
            extensions: names.map(CStr::to_owned).collect(),
        };
        if plain.api_version < vk::API_VERSION_1_3 {
            found.missing.push("Vulkan 1.3".to_owned());
            return Ok(found);
        }
        let ray_tracing = found.read_features(instance);
        found.read_properties(instance, &plain, ray_tracing);
        match queue {
            Some(family) => found.use_single_family(family as u32),
            None => found.missing.push("a queue for graphics and compute".to_owned()),
        }
        found.capabilities.remove_features(FeatureSet::NONE);
        Ok(found)
    }

    /// Uses `family` for graphics and compute, and selects the other queues again.
    pub(crate) fn use_single_family(&mut self, family: u32) {
        self.queue_family = Some(family);
        self.set_queues(locate_queues(&self.families, family));
    }

    /// Sets the location of each queue, and the queue information derived from it.
    pub(crate) fn set_queues(&mut self, queue_locations: [QueueLocation; 3]) {
        self.queue_locations = queue_locations;
        self.capabilities.queues = describe_queues(&self.families, &queue_locations);
        self.capabilities.limits.timestamp_bits = self.capabilities.queues[0].timestamp_bits;
    }

    /// Returns the description of the device, with the features it lacks of those that every context requires.
    pub(crate) fn candidate(&self, index: usize) -> DeviceCandidate {
        let caps = &self.capabilities;
        DeviceCandidate {
            index,
            name: caps.device_name.clone(),
            kind: self.kind,
            api_version: caps.api_version,
            driver: format!("{} {}", caps.driver_name, caps.driver_info).trim().to_owned(),
            missing: self.missing.clone(),
        }
    }

    /// True if the device has the extension.
    pub(crate) fn has_extension(&self, name: &CStr) -> bool {
        self.extensions.iter().any(|extension| extension.as_c_str() == name)
    }

    /// Fills in the features and the missing ones. Returns true if acceleration structure properties may be
    /// queried.
    fn read_features(&mut self, instance: &ash::Instance) -> bool {
        let mut found = query_features(instance, self.raw, &|name| self.has_extension(name));
        let accel = &found.ext.structures;
        let usable = accel.acceleration_structure
            & accel.descriptor_binding_acceleration_structure_update_after_bind
            & vk::Bool32::from(self.has_extension(ash::khr::deferred_host_operations::NAME))
            == vk::TRUE;
        found.limit_ray_tracing(usable, usable);
        found.limit_mesh_shaders(true);
        let pipeline_library = self.has_extension(ash::khr::pipeline_library::NAME);
        let checkpoints = self.has_extension(ash::nv::device_diagnostic_checkpoints::NAME);
        let portability_subset = self.has_extension(ash::khr::portability_subset::NAME);
        let caps = &mut self.capabilities;
        (caps.portability_subset, caps.checkpoints) = (portability_subset, checkpoints);
        let ray_tracing = &found.ext.ray_tracing;
        caps.ray_tracing_pipeline = ray_tracing.ray_tracing_pipeline == vk::TRUE;
        if caps.ray_tracing_pipeline {
            caps.ray_tracing_pipeline_path = RayTracingPipelinePath::Hardware;
        }
        caps.trace_rays_indirect = ray_tracing.ray_tracing_pipeline_trace_rays_indirect == vk::TRUE;
        caps.pipeline_libraries = caps.ray_tracing_pipeline && pipeline_library;
        caps.ray_query = found.ext.ray_query.ray_query == vk::TRUE;
        caps.ray_query_path = if caps.ray_query { RayQueryPath::Hardware } else { RayQueryPath::None };
        caps.position_fetch = found.ext.position_fetch.ray_tracing_position_fetch == vk::TRUE;
        caps.mesh_shader = found.ext.mesh.mesh_shader == vk::TRUE;
        caps.optional = FeatureSet::from_features(&found);
        self.missing.extend(missing_required(&found));
        self.features = found;
        usable
    }

    fn read_properties(
        &mut self,
        instance: &ash::Instance,
        plain: &vk::PhysicalDeviceProperties,
        ray_tracing: bool,
    ) {
        let mut accel = vk::PhysicalDeviceAccelerationStructurePropertiesKHR::default();
        let mut pipeline = vk::PhysicalDeviceRayTracingPipelinePropertiesKHR::default();
        let mut mesh = vk::PhysicalDeviceMeshShaderPropertiesEXT::default();
        let mut rates = vk::PhysicalDeviceFragmentShadingRatePropertiesKHR::default();
        let mut borders = vk::PhysicalDeviceCustomBorderColorPropertiesEXT::default();
        let mut portability = vk::PhysicalDevicePortabilitySubsetPropertiesKHR::default();
        let mut reorder = InvocationReorderProperties::default();
        let mut reorder_nv = vk::PhysicalDeviceRayTracingInvocationReorderPropertiesNV::default();
        let mut micromap = vk::PhysicalDeviceOpacityMicromapPropertiesEXT::default();
        let mut v11 = vk::PhysicalDeviceVulkan11Properties::default();
        let mut v12 = vk::PhysicalDeviceVulkan12Properties::default();
        let mut v13 = vk::PhysicalDeviceVulkan13Properties::default();
        let mut all = vk::PhysicalDeviceProperties2::default()
            .push_next(&mut v11)
            .push_next(&mut v12)
            .push_next(&mut v13);
        if ray_tracing {
            all = all.push_next(&mut accel);
        }
        if self.capabilities.ray_tracing_pipeline {
            all = all.push_next(&mut pipeline);
        }
        if self.capabilities.mesh_shader {
            all = all.push_next(&mut mesh);
        }
        if self.capabilities.has(OptionalFeature::PipelineShadingRate) {
            all = all.push_next(&mut rates);
        }
        if self.capabilities.has(OptionalFeature::CustomBorderColors) {
            all = all.push_next(&mut borders);
        }
        if self.capabilities.has(OptionalFeature::InvocationReorder) {
            all = all.push_next(&mut reorder);
        }
        if self.capabilities.has(OptionalFeature::InvocationReorderNv) {
            all = all.push_next(&mut reorder_nv);
        }
        if self.capabilities.has(OptionalFeature::OpacityMicromaps) {
            all = all.push_next(&mut micromap);
        }
        if self.capabilities.portability_subset {
            all = all.push_next(&mut portability);
        }
        // SAFETY: the chain holds only structures that the device supports, and lives until the call returns.
        unsafe { instance.get_physical_device_properties2(self.raw, &mut all) };
        self.features.subgroups = Subgroups {
            operations: v11.subgroup_supported_operations,
            stages: v11.subgroup_supported_stages,
            quads_everywhere: v11.subgroup_quad_operations_in_all_stages == vk::TRUE,
        };
        let caps = &mut self.capabilities;
        caps.driver_name = v12.driver_name_as_c_str().map(to_string).unwrap_or_default();
        caps.driver_info = v12.driver_info_as_c_str().map(to_string).unwrap_or_default();
        caps.max_anisotropy = plain.limits.max_sampler_anisotropy;
        caps.prefers_spatial_order = v12.driver_id == vk::DriverId::MESA_LLVMPIPE;
        caps.driver_id = v12.driver_id;
        caps.resolves_to_volumes = v12.driver_id != vk::DriverId::NVIDIA_PROPRIETARY;
        caps.helpers_lose_arrays = v12.driver_id == vk::DriverId::MESA_LLVMPIPE;
        caps.limits = Limits::from_properties(&plain.limits, &v12, &v13, &accel, &pipeline);
        caps.limits.mesh = MeshLimits::from_properties(&mesh);
        caps.limits.subgroup = SubgroupLimits::from_properties(&v11, &v13);
        caps.limits.shading_rate = ShadingRateLimits::from_properties(&rates);
        caps.limits.max_allocation_bytes = v11.max_memory_allocation_size;
        caps.limits.max_custom_borders = borders.max_custom_border_color_samplers;
        caps.limits.vertex_stride_alignment = portability.min_vertex_input_binding_stride_alignment.max(1);
        caps.limits.max_views = v11.max_multiview_view_count;
        caps.limits.micromap = MicromapLimits {
            max_two_state_level: micromap.max_opacity2_state_subdivision_level,
            max_four_state_level: micromap.max_opacity4_state_subdivision_level,
        };
        let hint = reorder_nv.ray_tracing_invocation_reorder_reordering_hint;
        caps.limits.reorders_invocations =
            reorder.reorders() || hint == vk::RayTracingInvocationReorderModeNV::REORDER;
    }
}

/// Returns the features that the device reports.
fn query_features(
    instance: &ash::Instance,
    raw: vk::PhysicalDevice,
    has: &dyn Fn(&CStr) -> bool,
) -> Features {
    let mut found = Features::default();
    let all = vk::PhysicalDeviceFeatures2::default()
        .push_next(&mut found.v11)
        .push_next(&mut found.v12)
        .push_next(&mut found.v13);
    let mut all = found.ext.append_to_chain(all, has);
    // SAFETY: the chain holds only structures that the device supports, and lives until the call returns.
    unsafe { instance.get_physical_device_features2(raw, &mut all) };
    found.core = all.features;
    found.ext.set_featureless_extensions(has);
    if !has(ash::khr::portability_subset::NAME) {
        found.ext.promise_portability();
    }
    found.calibration = calibration_extension(has);
    found
}

/// Returns the extension that reads the clocks of device and host together.
pub(super) fn calibration_extension(has: &dyn Fn(&CStr) -> bool) -> Calibration {
    if has(ash::khr::calibrated_timestamps::NAME) {
        Calibration::Khr
    } else if has(ash::ext::calibrated_timestamps::NAME) {
        Calibration::Ext
    } else {
        Calibration::None
    }
}

impl PhysicalDevice {
    /// Selects the family whose queues present to the window, or records that the device has no such family. Another error
    /// than a shortage of memory is recorded too, since another device may present.
    pub(crate) fn select_present_queue(&mut self, family: Result<Option<u32>>) -> Result<()> {
        const QUEUE: &str = "a queue for graphics and compute that presents to the window";
        match family {
            Ok(Some(family)) => self.use_single_family(family),
            Ok(None) => self.missing.push(QUEUE.to_owned()),
            Err(error @ Error::Vulkan { .. }) => self.missing.push(format!("{QUEUE} ({error})")),
            Err(error) => return Err(error),
        }
        Ok(())
    }
}

fn local_memory(instance: &ash::Instance, raw: vk::PhysicalDevice) -> u64 {
    // SAFETY: `raw` was enumerated from `instance`.
    let memory = unsafe { instance.get_physical_device_memory_properties(raw) };
    let heaps = memory.memory_heaps_as_slice().iter();
    heaps.filter(|heap| heap.flags.contains(vk::MemoryHeapFlags::DEVICE_LOCAL)).map(|heap| heap.size).sum()
}

fn device_name(properties: &vk::PhysicalDeviceProperties) -> String {
    properties.device_name_as_c_str().map(to_string).unwrap_or_default()
}

fn to_string(text: &CStr) -> String {
    text.to_string_lossy().into_owned()
}

fn version(packed: u32) -> (u32, u32, u32) {
    (vk::api_version_major(packed), vk::api_version_minor(packed), vk::api_version_patch(packed))
}

fn device_kind(raw: vk::PhysicalDeviceType) -> DeviceKind {
    match raw {
        vk::PhysicalDeviceType::DISCRETE_GPU => DeviceKind::Discrete,
        vk::PhysicalDeviceType::INTEGRATED_GPU => DeviceKind::Integrated,
        vk::PhysicalDeviceType::VIRTUAL_GPU => DeviceKind::Virtual,
        vk::PhysicalDeviceType::CPU => DeviceKind::Cpu,
        _ => DeviceKind::Other,
    }
}
