//! The capabilities of a device: its features, and the subset that the library enables.

use ash::vk;

use super::limits::{Limits, MicromapLimits};
use super::optional_features::{FeatureSet, OF_MESH_SHADERS, OF_RAY_TRACING_PIPELINES, OptionalFeature};
use super::queues::QueueInfo;
use super::ray_query_path::{RayQueryPath, RayQueryRequest};
use super::ray_tracing_pipeline_path::{PathInputs, RayTracingPipelinePath, RayTracingPipelineRequest};
use super::shading_rate::ShadingRateLimits;
use crate::queue::Queue;

/// Capabilities of the device of a context.
#[derive(Debug, Clone, Default)]
pub struct Capabilities {
    /// Name of the device.
    pub device_name: String,
    /// Name of the driver, for instance `llvmpipe` or `NVIDIA`.
    pub driver_name: String,
    /// Version text of the driver.
    pub driver_info: String,
    /// Vulkan version of the device as (major, minor, patch).
    pub api_version: (u32, u32, u32),
    /// True if the device is a CPU: it traces and rasterises in software.
    pub is_cpu: bool,
    /// True for GPUs on which lowered ray tracing pipelines were measured to be faster than the driver's: NVIDIA's H100, and others with
    /// its chip, which has no ray tracing cores. Vulkan does not tell, so the device's name decides.
    pub prefers_lowered_pipelines: bool,
    /// Ray tracing pipelines can be created and traced.
    /// [`ray_tracing_pipeline_path`](Self::ray_tracing_pipeline_path) is the implementation. In
    /// [`Context::devices`](crate::Context::devices), where no path is selected yet, it is true if the device
    /// itself has pipelines (`VK_KHR_ray_tracing_pipeline`).
    pub ray_tracing_pipeline: bool,
    /// Implementation of ray tracing pipelines: the device, or compute shaders that the library makes of them.
    pub ray_tracing_pipeline_path: RayTracingPipelinePath,
    /// Reason for the selection of that path.
    pub ray_tracing_pipeline_reason: &'static str,
    /// Trace commands may read their size from a buffer (`rayTracingPipelineTraceRaysIndirect`). Lowered pipelines
    /// always can.
    pub trace_rays_indirect: bool,
    /// Ray tracing pipelines may be linked from libraries (`VK_KHR_pipeline_library`). Lowered pipelines always can.
    pub pipeline_libraries: bool,
    /// Shaders may use ray queries. [`ray_query_path`](Self::ray_query_path) is the implementation. In
    /// [`Context::devices`](crate::Context::devices), where no path is selected yet, it is true if the device
    /// itself has ray queries.
    pub ray_query: bool,
    /// Implementation of ray queries: the device, or the library in software.
    pub ray_query_path: RayQueryPath,
    /// Reason for the selection of that path.
    pub ray_query_reason: &'static str,
    /// Hit shaders and ray queries may fetch the vertex positions of the hit triangle
    /// (`VK_KHR_ray_tracing_position_fetch`).
    pub position_fetch: bool,
    /// Draws may use task and mesh shaders (`VK_EXT_mesh_shader`).
    pub mesh_shader: bool,
    /// The device implements a subset of Vulkan (`VK_KHR_portability_subset`), as MoltenVK does. Features of
    /// [`FeatureSet::PORTABILITY`] may be missing.
    pub portability_subset: bool,
    /// The optional features that are enabled; see [`has`](Self::has).
    pub optional: FeatureSet,
    /// Name of the applied [`DeviceProfile`](crate::DeviceProfile). These capabilities are already reduced by
    /// it.
    pub profile: Option<String>,
    /// Reason why ray tracing is disabled although the device offers it: device creation failed with it, and
    /// was repeated without it.
    pub ray_tracing_fallback: Option<String>,
    /// Fragment shaders may read `gl_PrimitiveID` (`geometryShader`).
    pub primitive_id: bool,
    /// Shaders may read storage images without declaring a format (`shaderStorageImageReadWithoutFormat`).
    pub formatless_storage_read: bool,
    /// Arrays of cube textures can be created and sampled (`imageCubeArray`).
    pub cube_arrays: bool,
    /// Shaders may use 64-bit integers (`shaderInt64`).
    pub shader_int64: bool,
    /// Shaders may use atomic operations on 64-bit integers in buffers (`shaderBufferInt64Atomics`).
    pub buffer_int64_atomics: bool,
    /// One indirect command may issue several draws (`multiDrawIndirect`).
    pub multi_draw_indirect: bool,
    /// Occlusion queries may count samples exactly (`occlusionQueryPrecise`).
    pub precise_occlusion: bool,
    /// Queries may count the work of pipeline stages (`pipelineStatisticsQuery`).
    pub pipeline_statistics: bool,
    /// Labels of command buffers are written to the GPU as checkpoints, for the report of a lost device
    /// (`VK_NV_device_diagnostic_checkpoints`). It is enabled if
    /// [`ContextDesc::checkpoints`](crate::ContextDesc::checkpoints) requests it. In
    /// [`Context::devices`](crate::Context::devices) it is true if the device supports it.
    pub checkpoints: bool,
    /// The clocks of device and host can be read together (`VK_KHR_calibrated_timestamps` or
    /// `VK_EXT_calibrated_timestamps`): see [`Context::calibrated_timestamps`](crate::Context::calibrated_timestamps).
    pub calibrated_timestamps: bool,
    /// The host itself writes the first contents of small textures that are only sampled
    /// (`VK_EXT_host_image_copy`), without staging memory and queue. Sampling must not become slower by it.
    /// It is enabled on CPU devices only, where it was measured to be faster.
    pub host_image_copy: bool,
    /// Maximum sampler anisotropy; 1 if the device does not support it.
    pub max_anisotropy: f32,
    /// The driver's BVH builder keeps the input order of triangles (lavapipe before 26). Meshes should be
    /// sorted spatially first.
    pub prefers_spatial_order: bool,
    /// Arrays written by helper invocations of fragment shaders lose their contents (lavapipe). There, ray
    /// queries in software find no hits in helper invocations.
    pub helpers_lose_arrays: bool,
    /// Passes resolve samples into slices of volumes. NVIDIA's driver 580.159 leaves one of the slices as it is, so such passes are refused on
    /// NVIDIA's driver, whatever its version.
    pub resolves_to_volumes: bool,
    /// Vendor of the driver (`VkPhysicalDeviceVulkan12Properties::driverID`); 0 below Vulkan 1.2.
    pub driver_id: vk::DriverId,
    /// Properties of each queue, in the order of [`Queue::ALL`]; see [`queue`](Self::queue).
    pub queues: [QueueInfo; 3],
    /// Numeric limits.
    pub limits: Limits,
}

impl Capabilities {
    /// Returns the properties of the Vulkan queue behind `queue`.
    pub fn queue(&self, queue: Queue) -> &QueueInfo {
        &self.queues[queue.index()]
    }

    /// True if the device has `feature` and it is enabled.
    pub fn has(&self, feature: OptionalFeature) -> bool {
        self.optional.contains(feature)
    }

    /// Removes the optional features of `hidden`, and those that require them.
    pub(crate) fn remove_features(&mut self, hidden: FeatureSet) {
        let mut left = self.optional.without(hidden);
        if !self.mesh_shader {
            left = left.without(OF_MESH_SHADERS.into_iter().collect());
        }
        self.optional = left.without_unmet_requirements();
        self.remove_ray_tracing_features(self.builds_device_structures());
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
        if !self.has(OptionalFeature::SubgroupSizeControl) {
            self.limits.subgroup = self.limits.subgroup.without_size_control();
        }
        if !self.has(OptionalFeature::SamplerLodBias) {
            self.limits.max_lod_bias = 0.0;
        }
        if !self.has(OptionalFeature::SamplerAnisotropy) {
            self.max_anisotropy = 1.0;
        }
    }

    /// Removes the ray tracing features of the device that are not to be enabled.
    pub(crate) fn limit_ray_tracing(&mut self, pipeline: bool, query: bool) {
        self.ray_tracing_pipeline &= pipeline;
        if !self.ray_tracing_pipeline {
            self.ray_tracing_pipeline_path = RayTracingPipelinePath::None;
        }
        self.trace_rays_indirect &= pipeline;
        self.pipeline_libraries &= pipeline;
        self.ray_query &= query;
        if !self.ray_query {
            self.ray_query_path = RayQueryPath::None;
        }
        self.position_fetch &= self.ray_tracing_pipeline || self.ray_query;
        self.remove_ray_tracing_features(self.ray_tracing_pipeline || self.ray_query);
    }

    /// Removes the optional features of ray tracing pipelines and acceleration structures that are not there.
    /// `structures` is true if the device builds acceleration structures.
    fn remove_ray_tracing_features(&mut self, structures: bool) {
        let mut off = FeatureSet::NONE;
        if !self.device_pipelines() {
            off = OF_RAY_TRACING_PIPELINES.into_iter().collect();
        }
        if !structures {
            off = off.with(OptionalFeature::OpacityMicromaps);
        }
        self.optional = self.optional.without(off);
        if !self.has(OptionalFeature::OpacityMicromaps) {
            self.limits.micromap = MicromapLimits::default();
        }
        let orders = [OptionalFeature::InvocationReorder, OptionalFeature::InvocationReorderNv];
        self.limits.reorders_invocations &= orders.into_iter().any(|feature| self.has(feature));
    }

    /// True if ray tracing pipelines are those of the device (`VK_KHR_ray_tracing_pipeline`).
    pub(crate) fn device_pipelines(&self) -> bool {
        self.ray_tracing_pipeline_path == RayTracingPipelinePath::Hardware
    }

    /// True if ray tracing pipelines are lowered to compute shaders.
    pub(crate) fn lowered_pipelines(&self) -> bool {
        self.ray_tracing_pipeline_path.is_lowered()
    }

    /// True if the device itself performs the traversal of ray queries of the caller's shaders (`VK_KHR_ray_query`).
    pub(crate) fn hardware_ray_query(&self) -> bool {
        self.ray_query_path == RayQueryPath::Hardware
    }

    /// True if ray queries of the device run: in the caller's shaders, or in lowered pipelines.
    pub(crate) fn device_ray_queries(&self) -> bool {
        self.hardware_ray_query() || self.ray_tracing_pipeline_path == RayTracingPipelinePath::Query
    }

    /// True if the device builds acceleration structures, for pipelines or for queries.
    pub(crate) fn builds_device_structures(&self) -> bool {
        self.device_pipelines() || self.device_ray_queries()
    }

    /// True if the device gathers 64 bits for each invocation as fast as 32.
    pub(crate) fn has_fast_64_bit_loads(&self) -> bool {
        self.is_cpu && self.shader_int64
    }

    /// True if the library builds BVHs, for pipelines or for queries in software.
    pub(crate) fn builds_software_structures(&self) -> bool {
        self.ray_query_path == RayQueryPath::Software
            || self.ray_tracing_pipeline_path == RayTracingPipelinePath::Software
    }

    /// Enables the requested ray tracing features, by the device or by the library.
    ///
    /// Features that the application requires, `required`, may need pipelines or structures of the device.
    pub(crate) fn choose_ray_tracing(
        &mut self,
        pipeline: RayTracingPipelineRequest,
        query: RayQueryRequest,
        required: &[OptionalFeature],
    ) {
        let is_of_device = |feature| {
            OF_RAY_TRACING_PIPELINES.contains(feature) || *feature == OptionalFeature::OpacityMicromaps
        };
        let queries = query.choose(self.ray_query, self.is_cpu);
        let pipelines = pipeline.choose(PathInputs {
            has_pipelines: self.ray_tracing_pipeline,
            has_queries: self.ray_query,
            query_path: queries.path,
            prefers_lowered: self.is_cpu || self.prefers_lowered_pipelines,
            needs_device: required.iter().any(is_of_device),
        });
        (self.ray_query_path, self.ray_query_reason) = (queries.path, queries.reason);
        (self.ray_tracing_pipeline_path, self.ray_tracing_pipeline_reason) =
            (pipelines.path, pipelines.reason);
        let (device_pipelines, device_queries) = (self.device_pipelines(), self.device_ray_queries());
        self.limit_ray_tracing(device_pipelines, device_queries);
        // The limits of the device's features reset the paths that do not need them.
        (self.ray_query_path, self.ray_tracing_pipeline_path) = (queries.path, pipelines.path);
        self.ray_query = self.ray_query_path != RayQueryPath::None;
        if self.lowered_pipelines() {
            (self.ray_tracing_pipeline, self.trace_rays_indirect, self.pipeline_libraries) =
                (true, true, true);
            self.limits.set_lowered_pipelines();
        }
        if self.builds_software_structures() {
            self.limits.enable_software_structures(self.builds_device_structures());
            self.position_fetch |= !self.builds_device_structures();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the capabilities of a device with these features of its own.
    fn device(pipelines: bool, queries: bool) -> Capabilities {
        let mut caps = Capabilities {
            ray_tracing_pipeline: true,
            ray_tracing_pipeline_path: RayTracingPipelinePath::Hardware,
            ray_query: true,
            ray_query_path: RayQueryPath::Hardware,
            position_fetch: true,
            ..Capabilities::default()
        };
        caps.limits.max_ray_recursion = 1;
        caps.limit_ray_tracing(pipelines, queries);
        caps
    }

    #[test]
    fn pipelines_lowered_onto_queries_leave_the_queries_of_shaders_off() {
        let mut caps = device(true, true);
        caps.choose_ray_tracing(RayTracingPipelineRequest::Query, RayQueryRequest::Off, &[]);
        assert!(caps.ray_tracing_pipeline && !caps.ray_query && !caps.hardware_ray_query());
        assert!(caps.device_ray_queries() && !caps.device_pipelines());
        assert!(caps.builds_device_structures() && !caps.builds_software_structures());
        assert!(caps.trace_rays_indirect && caps.pipeline_libraries && caps.position_fetch);
        assert_eq!((caps.limits.max_ray_recursion, caps.limits.max_hit_attribute_bytes), (31, 32));
    }

    #[cfg(feature = "software-ray-query")]
    #[test]
    fn structures_of_both_kinds_are_built_where_both_are_used() {
        for (pipeline, query, expected) in [
            (RayTracingPipelineRequest::Auto, RayQueryRequest::Software, [true, true]),
            (RayTracingPipelineRequest::Software, RayQueryRequest::Hardware, [true, true]),
            (RayTracingPipelineRequest::Software, RayQueryRequest::Off, [false, true]),
            (RayTracingPipelineRequest::Off, RayQueryRequest::Software, [false, true]),
            (RayTracingPipelineRequest::Query, RayQueryRequest::Software, [true, true]),
            (RayTracingPipelineRequest::Off, RayQueryRequest::Off, [false, false]),
        ] {
            let mut caps = device(true, true);
            caps.choose_ray_tracing(pipeline, query, &[]);
            let found = [caps.builds_device_structures(), caps.builds_software_structures()];
            assert_eq!(found, expected, "{pipeline:?}, {query:?}");
        }
    }

    #[cfg(feature = "software-ray-query")]
    #[test]
    fn a_device_without_ray_tracing_has_pipelines_in_software() {
        let mut caps = device(false, false);
        assert_eq!(caps.ray_tracing_pipeline_path, RayTracingPipelinePath::None);
        caps.choose_ray_tracing(RayTracingPipelineRequest::Auto, RayQueryRequest::HardwareIfPresent, &[]);
        assert_eq!(caps.ray_tracing_pipeline_path, RayTracingPipelinePath::Software);
        assert!(caps.ray_tracing_pipeline && !caps.ray_query && caps.position_fetch);
    }
}
