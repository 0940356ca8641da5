//! The capabilities of a device: what it has, and what of that the library turns on.

use ash::vk;

use super::limits::Limits;
use super::optional_features::{FeatureSet, OF_MESH_SHADERS, OptionalFeature};
use super::queues::QueueInfo;
use super::ray_query_path::{RayQueryPath, RayQueryRequest};
use super::shading_rate::ShadingRateLimits;
use crate::queue::Queue;

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
    /// `VK_EXT_calibrated_timestamps`): see [`Context::calibrated_timestamps`](crate::Context::calibrated_timestamps).
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
