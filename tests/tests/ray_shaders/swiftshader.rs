//! Ray queries in shaders on a device without ray tracing.

use lvk_tests::subprocess::rerun_on_swiftshader;

/// But for pipelines, which there are none of.
#[test]
#[ignore = "a minute, of the check swiftshader of .ci/slow"]
fn queries_report_the_same_without_ray_tracing() {
    rerun_on_swiftshader(&["pipelines::"]);
}
