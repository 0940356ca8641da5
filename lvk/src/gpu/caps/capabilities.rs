//! What a physical device has, what of it the library turns on, and what callers may ask.

use std::ffi::{CStr, CString};

use ash::vk;

use super::limits::Limits;
use super::mesh_limits::MeshLimits;
use super::optional_features::{FeatureSet, OF_MESH_SHADERS, OptionalFeature};
use super::queues::{
    Queue, QueueFamily, QueueInfo, QueueLocation, describe_queues, locate_queues, queue_families,
};
use super::ray_query_path::{RayQueryPath, RayQueryRequest};
use super::shading_rate::ShadingRateLimits;
use crate::error::{Error, Result};
use crate::gpu::start::features::{Calibration, Features, Subgroups, missing_required};
use crate::gpu::start::select::DeviceKind;

/// Whether the caller needs a feature.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum FeatureRequest {
    /// Only devices that have it are considered.
    Required,
    /// Used where present.
    #[default]
    Optional,
    /// Not used even where present.
    Off,
}

impl FeatureRequest {
    pub(crate) fn is_requested(self) -> bool {
        self != Self::Off
    }
}

/// What the device of a context can do.
#[derive(Debug, Clone, Default)]
pub struct Capabilities {
    /// The device's own name.
    pub device_name: String,
    /// The driver's name, for instance `llvmpipe` or `NVIDIA`.
    pub driver_name: String,
    /// The driver's version text.
    pub driver_info: String,
    /// Vulkan version of the device as (major, minor, patch).
    pub api_version: (u32, u32, u32),
    /// Whether the device is a CPU: everything is traced and rasterised in software.
    pub is_cpu: bool,
    /// Ray tracing pipelines (`VK_KHR_ray_tracing_pipeline`) can be created and traced.
    pub ray_tracing_pipeline: bool,
    /// Traces may take their size from a buffer (`rayTracingPipelineTraceRaysIndirect`).
    pub trace_rays_indirect: bool,
    /// Ray tracing pipelines may be linked from libraries (`VK_KHR_pipeline_library`).
    pub pipeline_libraries: bool,
    /// Shaders may use ray queries, by whom [`ray_query_path`](Self::ray_query_path) says. In
    /// [`Context::devices`](crate::Context::devices), before anybody has chosen, whether the device itself has them.
    pub ray_query: bool,
    /// Who walks the trees of ray queries.
    pub ray_query_path: RayQueryPath,
    /// Why it is that one.
    pub ray_query_reason: &'static str,
    /// Hit shaders and ray queries may read the corners of the triangle that was hit
    /// (`VK_KHR_ray_tracing_position_fetch`).
    pub position_fetch: bool,
    /// Task and mesh shaders (`VK_EXT_mesh_shader`) can be drawn with.
    pub mesh_shader: bool,
    /// The optional features that are there; [`has`](Self::has) asks for one.
    pub optional: FeatureSet,
    /// Name of the [`DeviceProfile`](crate::DeviceProfile) that was applied: what is said here is what it leaves.
    pub profile: Option<String>,
    /// Why ray tracing is off although the device offers it: device creation with it failed, and was repeated without.
    pub ray_tracing_fallback: Option<String>,
    /// `gl_PrimitiveID` may be read in fragment shaders (`geometryShader`).
    pub primitive_id: bool,
    /// Storage images may be read without a format in the shader (`shaderStorageImageReadWithoutFormat`).
    pub formatless_storage_read: bool,
    /// Arrays of cubes can be made and sampled (`imageCubeArray`).
    pub cube_arrays: bool,
    /// Shaders may use 64-bit integers (`shaderInt64`).
    pub shader_int64: bool,
    /// Shaders may change 64-bit integers in buffers atomically (`shaderBufferInt64Atomics`).
    pub buffer_int64_atomics: bool,
    /// Several draws may come from one indirect call (`multiDrawIndirect`).
    pub multi_draw_indirect: bool,
    /// Occlusion queries may count samples exactly (`occlusionQueryPrecise`).
    pub precise_occlusion: bool,
    /// Queries may count what the stages of pipelines do (`pipelineStatisticsQuery`).
    pub pipeline_statistics: bool,
    /// The clocks of device and host can be read together (`VK_KHR_calibrated_timestamps` or
    /// `VK_EXT_calibrated_timestamps`): see [`Context::clock_pair`](crate::Context::clock_pair).
    pub calibrated_timestamps: bool,
    /// First contents of small textures that are only sampled are written by the host itself (`VK_EXT_host_image_copy`),
    /// past staging memory and queue, where the device samples them as fast as others. So it is on devices that are CPUs,
    /// where it was measured to be faster.
    pub host_image_copy: bool,
    /// Largest sampler anisotropy; 1 where the device has none.
    pub max_anisotropy: f32,
    /// The driver's builder keeps the order of triangles it is given (lavapipe before 26): meshes should be ordered
    /// spatially first.
    pub prefers_spatial_order: bool,
    /// Arrays that helper invocations of fragment shaders write keep nothing (lavapipe): there, ray queries in software see
    /// nothing in helper invocations.
    pub helpers_lose_arrays: bool,
    /// Who made the driver (`VkPhysicalDeviceVulkan12Properties::driverID`); 0 below Vulkan 1.2.
    pub driver_id: vk::DriverId,
    /// What stands behind each queue, in the order of [`Queue::ALL`]; [`queue`](Self::queue) asks for one.
    pub queues: [QueueInfo; 3],
    /// The numbers behind the limits.
    pub limits: Limits,
}

impl Capabilities {
    /// What stands behind a queue.
    pub fn queue(&self, queue: Queue) -> &QueueInfo {
        &self.queues[queue.index()]
    }

    /// Whether the device has `feature`, and it is on.
    pub fn has(&self, feature: OptionalFeature) -> bool {
        self.optional.contains(feature)
    }

    /// Without the optional features of `hidden` and those that cannot be without them.
    pub(crate) fn remove_features(&mut self, hidden: FeatureSet) {
        let mut left = self.optional.without(hidden);
        if !self.mesh_shader {
            left = left.without(OF_MESH_SHADERS.into_iter().collect());
        }
        self.optional = left.without_unmet_requirements();
        self.primitive_id = self.has(OptionalFeature::GeometryShader);
        self.formatless_storage_read = self.has(OptionalFeature::StorageImageReadWithoutFormat);
        self.cube_arrays = self.has(OptionalFeature::CubeArrays);
        self.shader_int64 = self.has(OptionalFeature::Int64);
        self.buffer_int64_atomics = self.has(OptionalFeature::BufferInt64Atomics);
        self.multi_draw_indirect = self.has(OptionalFeature::MultiDrawIndirect);
        self.precise_occlusion = self.has(OptionalFeature::OcclusionQueryPrecise);
        self.pipeline_statistics = self.has(OptionalFeature::PipelineStatisticsQuery);
        self.calibrated_timestamps = self.has(OptionalFeature::CalibratedTimestamps);
        self.host_image_copy = self.has(OptionalFeature::HostImageCopy) && self.is_cpu;
        if !self.has(OptionalFeature::LocalRead) {
            self.limits.max_input_attachments = 0;
        }
        if !self.has(OptionalFeature::PipelineShadingRate) {
            self.limits.shading_rate = ShadingRateLimits::default();
        }
        if !self.has(OptionalFeature::SamplerAnisotropy) {
            self.max_anisotropy = 1.0;
        }
    }

    /// Without the ray tracing that is not to be turned on.
    pub(crate) fn limit_ray_tracing(&mut self, pipeline: bool, query: bool) {
        self.ray_tracing_pipeline &= pipeline;
        self.trace_rays_indirect &= pipeline;
        self.pipeline_libraries &= pipeline;
        self.ray_query &= query;
        if !self.ray_query {
            self.ray_query_path = RayQueryPath::None;
        }
        self.position_fetch &= self.ray_tracing_pipeline || self.ray_query;
    }

    /// Whether the device itself walks the trees of ray queries (`VK_KHR_ray_query`).
    pub(crate) fn hardware_ray_query(&self) -> bool {
        self.ray_query_path == RayQueryPath::Hardware
    }

    /// Whether the library does.
    pub(crate) fn software_ray_query(&self) -> bool {
        self.ray_query_path == RayQueryPath::Software
    }

    /// Whether the device builds acceleration structures, for either use of them.
    pub(crate) fn hardware_acceleration_structures(&self) -> bool {
        self.ray_tracing_pipeline || self.hardware_ray_query()
    }

    /// Turns on what is asked for of what the device has.
    pub(crate) fn choose_ray_tracing(&mut self, pipeline: FeatureRequest, query: RayQueryRequest) {
        let choice = query.choose(self.ray_query, self.is_cpu);
        self.limit_ray_tracing(pipeline.is_requested(), choice.path == RayQueryPath::Hardware);
        self.ray_query_path = choice.path;
        self.ray_query_reason = choice.reason;
        if self.software_ray_query() {
            self.ray_query = true;
            self.limits.enable_software_structures(self.hardware_acceleration_structures());
            self.position_fetch |= !self.hardware_acceleration_structures();
        }
    }
}

/// One physical device as found, before any is chosen.
pub(crate) struct PhysicalDevice {
    pub(crate) raw: vk::PhysicalDevice,
    pub(crate) capabilities: Capabilities,
    pub(crate) kind: DeviceKind,
    pub(crate) local_memory_bytes: u64,
    /// The family for everything.
    pub(crate) queue_family: Option<u32>,
    pub(crate) families: Vec<QueueFamily>,
    /// The queue of the device for each of the library's.
    pub(crate) places: [QueueLocation; 3],
    /// Core features the library cannot do without and the device lacks.
    pub(crate) missing: Vec<String>,
    /// As found.
    pub(crate) features: Features,
    pub(crate) extensions: Vec<CString>,
}

impl PhysicalDevice {
    pub(crate) fn query(instance: &ash::Instance, raw: vk::PhysicalDevice) -> Result<Self> {
        // SAFETY: `raw` was enumerated from `instance`.
        let plain = unsafe { instance.get_physical_device_properties(raw) };
        // SAFETY: as above.
        let extensions = unsafe { instance.enumerate_device_extension_properties(raw) }
            .map_err(Error::vulkan("vkEnumerateDeviceExtensionProperties"))?;
        let names = extensions.iter().filter_map(|extension| extension.extension_name_as_c_str().ok());
        let families = queue_families(instance, raw);
        let everything = vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE;
        let queue = families.iter().position(|family| family.flags.contains(everything));
        let mut found = Self {
            raw,
            capabilities: Capabilities {
                device_name: device_name(&plain),
                api_version: version(plain.api_version),
                is_cpu: plain.device_type == vk::PhysicalDeviceType::CPU,
                ..Default::default()
            },
            kind: device_kind(plain.device_type),
            local_memory_bytes: local_memory(instance, raw),
            queue_family: None,
            families,
            places: Default::default(),
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

    /// Has this family for everything, and others beside it.
    pub(crate) fn use_single_family(&mut self, family: u32) {
        self.queue_family = Some(family);
        self.set_queues(locate_queues(&self.families, family));
    }

    /// Has these queues.
    pub(crate) fn set_queues(&mut self, places: [QueueLocation; 3]) {
        self.places = places;
        self.capabilities.queues = describe_queues(&self.families, &places);
        self.capabilities.limits.timestamp_bits = self.capabilities.queues[0].timestamp_bits;
    }

    /// Whether the device has an extension.
    pub(crate) fn has_extension(&self, name: &CStr) -> bool {
        self.extensions.iter().any(|extension| extension.as_c_str() == name)
    }

    /// Fills the features and what is missing; answers whether acceleration structures may be asked about.
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
        let caps = &mut self.capabilities;
        let ray_tracing = &found.ext.ray_tracing;
        caps.ray_tracing_pipeline = ray_tracing.ray_tracing_pipeline == vk::TRUE;
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
        // SAFETY: the chain holds only structures the device knows, and lives until the call returns.
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
        caps.helpers_lose_arrays = v12.driver_id == vk::DriverId::MESA_LLVMPIPE;
        caps.limits = Limits::from_properties(&plain.limits, &v12, &v13, &accel, &pipeline);
        caps.limits.mesh = MeshLimits::from_properties(&mesh);
        caps.limits.shading_rate = ShadingRateLimits::from_properties(&rates);
        caps.limits.max_allocation_bytes = v11.max_memory_allocation_size;
        caps.limits.max_custom_borders = borders.max_custom_border_color_samplers;
        caps.limits.max_views = v11.max_multiview_view_count;
    }
}

/// What the device offers.
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
    // SAFETY: the chain holds only structures the device knows, and lives until the call returns.
    unsafe { instance.get_physical_device_features2(raw, &mut all) };
    found.core = all.features;
    found.ext.set_featureless_extensions(has);
    found.calibration = calibration_extension(has);
    found
}

fn calibration_extension(has: &dyn Fn(&CStr) -> bool) -> Calibration {
    if has(ash::khr::calibrated_timestamps::NAME) {
        Calibration::Khr
    } else if has(ash::ext::calibrated_timestamps::NAME) {
        Calibration::Ext
    } else {
        Calibration::None
    }
}

impl PhysicalDevice {
    /// Takes a family whose queues present to the window, or says that there is none.
    pub(crate) fn select_present_queue(&mut self, family: Option<u32>) {
        match family {
            Some(family) => self.use_single_family(family),
            None => {
                self.missing.push("a queue for graphics and compute that presents to the window".to_owned())
            }
        }
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
