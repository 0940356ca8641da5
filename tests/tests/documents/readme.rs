//! The code in the README equals the code of the samples.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::path::Path;

fn project_file(path: &str) -> String {
    let project = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    std::fs::read_to_string(project.join(path)).unwrap()
}

#[test]
fn the_smallest_triangle_is_the_one_that_runs_and_is_small() {
    let readme = project_file("README.md");
    let (_, section) = readme.split_once("## Smallest").unwrap();
    let (_, block) = section.split_once("\n```rust\n").unwrap();
    let (code, _) = block.split_once("```").unwrap();
    let program = project_file("samples/src/bin/triangle.rs");
    assert_eq!(code, program, "copy samples/src/bin/triangle.rs to README.md");
    let lines = program.lines().count();
    assert!(lines <= 100, "{lines} lines");
}
