//! Contexts for each path of ray tracing pipelines that the device has.

use lvk::{DeviceProfile, RayQueryRequest, RayTracingPipelinePath, RayTracingPipelineRequest};

use crate::{TestDevice, device_with};

/// Returns a context for each path of ray tracing pipelines, with the path: that of the device, and those of
/// [`lowered_devices`].
pub fn pipeline_devices() -> Vec<(RayTracingPipelinePath, TestDevice)> {
    let hardware = device_with(|desc| {
        desc.ray_tracing_pipeline = RayTracingPipelineRequest::HardwareIfPresent;
    });
    let mut devices = Vec::new();
    devices.extend(hardware.and_then(|ctx| on_path(RayTracingPipelinePath::Hardware, ctx)));
    devices.extend(lowered_devices());
    devices
}

/// Returns a context for each lowered path, with the path. A profile hides the device's own pipelines, and shaders of
/// the application get no ray queries.
pub fn lowered_devices() -> Vec<(RayTracingPipelinePath, TestDevice)> {
    let no_pipelines = DeviceProfile::no_rt_pipeline();
    let open = |request, path| {
        let ctx = device_with(|desc| {
            (desc.ray_query, desc.ray_tracing_pipeline) = (RayQueryRequest::Off, request);
            desc.profile = Some(&no_pipelines);
        });
        ctx.and_then(|ctx| on_path(path, ctx))
    };
    let software = open(RayTracingPipelineRequest::Software, RayTracingPipelinePath::Software);
    let query = open(RayTracingPipelineRequest::Query, RayTracingPipelinePath::Query);
    software.into_iter().chain(query).collect()
}

/// Returns the context with its path. Prints a line and returns `None` where its device lacks the path.
fn on_path(path: RayTracingPipelinePath, ctx: TestDevice) -> Option<(RayTracingPipelinePath, TestDevice)> {
    let caps = ctx.capabilities();
    if caps.ray_tracing_pipeline_path == path {
        return Some((path, ctx));
    }
    eprintln!("NOT TESTED, {} has no ray tracing pipelines by {path:?}", caps.device_name);
    None
}
