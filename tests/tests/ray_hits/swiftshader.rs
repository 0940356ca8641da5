//! What rays hit on a device that has no ray tracing at all.

use lvk_tests::subprocess::rerun_on_swiftshader;

/// But for tests that make a dozen modules with walks each, which that driver compiles for another half a minute.
#[test]
#[ignore = "a minute, of the step swiftshader of .ci/run"]
fn rays_hit_the_same_without_ray_tracing() {
    rerun_on_swiftshader(&["position_fetch::fetched_vertices"]);
}
