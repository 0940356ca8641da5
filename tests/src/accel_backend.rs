//! Backends of acceleration structures. On a device without ray tracing an acceleration structure is a software BVH
//! alone: one part, in the given order, of the size that it needs.

use std::fmt::Debug;
use std::ops::RangeBounds;

use lvk::{
    AccelStructHandle, Context, ContextDesc, DeviceProfile, RayQueryPath, RayQueryRequest,
    RayTracingPipelinePath, Result,
};

use crate::{TestDevice, device_with};

/// Creates a context whose acceleration structures are software BVHs alone, on any device.
pub fn software_alone(adjust: impl FnOnce(&mut ContextDesc<'_>)) -> Option<TestDevice> {
    let profile = DeviceProfile::no_ray_tracing();
    device_with(|desc| {
        desc.ray_query = RayQueryRequest::Software;
        adjust(desc);
        desc.profile = Some(&profile);
    })
}

/// Creates a context, and one whose BLASes take at most `primitives` primitives, where the device builds acceleration
/// acceleration structures: a software BVH is never split.
pub fn whole_and_split(primitives: u64) -> Vec<TestDevice> {
    let profile = DeviceProfile {
        name: "small structures".into(),
        max_blas_primitives: primitives,
        ..DeviceProfile::default()
    };
    let split =
        device_with(|desc| desc.profile = Some(&profile)).filter(|ctx| builds_device_accel_structs(ctx));
    device_with(|_| ()).into_iter().chain(split).collect()
}

/// True if the device builds acceleration structures, whether or not its own ray queries are used.
pub fn builds_device_accel_structs(ctx: &Context) -> bool {
    let caps = ctx.capabilities();
    matches!(caps.ray_tracing_pipeline_path, RayTracingPipelinePath::Hardware | RayTracingPipelinePath::Query)
        || caps.ray_query_path == RayQueryPath::Hardware
}

/// True if the library builds BVHs, for ray queries or for pipelines.
pub fn builds_software_bvhs(ctx: &Context) -> bool {
    let caps = ctx.capabilities();
    caps.ray_query_path == RayQueryPath::Software
        || caps.ray_tracing_pipeline_path == RayTracingPipelinePath::Software
}

/// As [`builds_device_accel_structs`], for tests that need such a device. Prints what is not tested if it is none.
pub fn requires_device_accel_structs(ctx: &Context, what: &str) -> bool {
    let has = builds_device_accel_structs(ctx);
    if !has {
        eprintln!("NOT TESTED, {what}: {} has no structures of its own", ctx.capabilities().device_name);
    }
    has
}

/// Returns the number of parts of a BLAS.
///
/// # Panics
/// When the number is not in `expected`, or not 1 on a device that builds no acceleration structures.
#[track_caller]
pub fn expect_parts(
    ctx: &Context,
    handle: AccelStructHandle,
    expected: impl RangeBounds<u32> + Debug,
) -> Result<u32> {
    let parts = ctx.accel_struct_info(handle)?.parts;
    if builds_device_accel_structs(ctx) {
        assert!(expected.contains(&parts), "{parts} parts, not {expected:?}");
    } else {
        assert_eq!(parts, 1, "what software traces is never split");
    }
    Ok(parts)
}
