//! What rays hit on a device that has no ray tracing at all.

use lvk_tests::child::program_without_ray_tracing;

/// But for tests that make a dozen modules with walks each, which that driver compiles for another half a minute.
#[test]
#[ignore = "a minute, of the step swiftshader of .ci/run"]
fn rays_hit_the_same_without_ray_tracing() {
    program_without_ray_tracing(&["position_fetch::corners"]);
}
