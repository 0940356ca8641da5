//! Hits on a device without ray tracing.

use lvk_tests::subprocess::rerun_on_swiftshader;

/// Tests that create a dozen modules with traversal code each are skipped: that driver compiles for another half a
/// minute.
#[test]
#[ignore = "a minute, of the check swiftshader of .ci/slow"]
fn rays_hit_the_same_without_ray_tracing() {
    rerun_on_swiftshader(&["position_fetch::fetched_vertices"]);
}
