//! What the library builds on a device that has no ray tracing at all.

use lvk_tests::child::program_without_ray_tracing;

#[test]
#[ignore = "a minute, of the step swiftshader of .ci/run"]
fn structures_are_built_the_same_without_ray_tracing() {
    program_without_ray_tracing(&[]);
}
