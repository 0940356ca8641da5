//! Ray queries in shaders, and lowered pipelines, on a device without ray tracing.

use lvk_tests::subprocess::rerun_on_swiftshader;

#[test]
#[ignore = "a minute, of the check swiftshader of .ci/slow"]
fn queries_and_pipelines_report_the_same_without_ray_tracing() {
    rerun_on_swiftshader(&[]);
}
