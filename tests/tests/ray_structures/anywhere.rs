//! Structures on a device that has no ray tracing at all.

use lvk_tests::child::program_without_ray_tracing;

/// But for tests of meshes that are split or put into order, and of copies: nothing is there, so they are the others once more
/// and take the driver another two minutes.
#[test]
#[ignore = "a minute, of the step swiftshader of .ci/run"]
fn structures_are_the_same_without_ray_tracing() {
    program_without_ray_tracing(&["split::", "split_updates::", "order::", "compaction::"]);
}
