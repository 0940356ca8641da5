//! What shaders see of ray queries on a device that has no ray tracing at all.

use lvk_tests::child::program_without_ray_tracing;

/// But for pipelines, which there are none of.
#[test]
#[ignore = "a minute, of the step swiftshader of .ci/run"]
fn queries_tell_the_same_without_ray_tracing() {
    program_without_ray_tracing(&["pipelines::"]);
}
