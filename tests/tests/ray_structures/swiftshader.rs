//! Acceleration acceleration structures on a device without ray tracing.

use lvk_tests::subprocess::rerun_on_swiftshader;

/// But for tests of meshes that are split or put into order, and of copies: nothing is there, so they are the others once more
/// and take the driver another two minutes.
#[test]
#[ignore = "a minute, of the check swiftshader of .ci/slow"]
fn accel_structs_are_the_same_without_ray_tracing() {
    rerun_on_swiftshader(&["split::", "split_updates::", "order::", "compaction::"]);
}
