//! What stands behind the handles of acceleration structures. Where the device has none of its own, that is what software
//! traces alone: one part in the order given, of the size it needs.

use std::fmt::Debug;
use std::ops::RangeBounds;

use lvk::{AccelStructHandle, Context, ContextDesc, DeviceProfile, RayQueryPath, RayQueryRequest, Result};

use crate::{TestDevice, device_with};

/// A context without structures of the device's own, whatever the device has: software traces them.
pub fn software_alone(adjust: impl FnOnce(&mut ContextDesc<'_>)) -> Option<TestDevice> {
    let profile = DeviceProfile::no_ray_tracing();
    device_with(|desc| {
        desc.ray_query = RayQueryRequest::Software;
        adjust(desc);
        desc.profile = Some(&profile);
    })
}

/// A context as others, and one that takes so many primitives in a structure, where that makes a difference: what software
/// traces alone is never split.
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

/// Whether the device builds structures of its own, whoever walks ray queries.
pub fn builds_device_accel_structs(ctx: &Context) -> bool {
    let caps = ctx.capabilities();
    caps.ray_tracing_pipeline || caps.ray_query_path == RayQueryPath::Hardware
}

/// As [`builds_device_accel_structs`], for tests of what only the device's own are subject to; says what is not tested where there are
/// none.
pub fn requires_device_accel_structs(ctx: &Context, what: &str) -> bool {
    let has = builds_device_accel_structs(ctx);
    if !has {
        eprintln!("NOT TESTED, {what}: {} has no structures of its own", ctx.capabilities().device_name);
    }
    has
}

/// Answers of how many parts a structure consists.
///
/// # Panics
/// When that is not `expected`, or not one where there are no structures of the device's own.
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
