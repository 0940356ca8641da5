//! Programs of one file, without a command line: the sample `triangle` and the example `triangle` of `lvk`.

use std::error::Error;

use crate::Failure;

#[path = "../../../../../lvk/examples/triangle.rs"]
mod example_triangle;
#[path = "../../../../../samples/src/bin/triangle.rs"]
mod sample_triangle;

/// Runs the sample, which traces a triangle by a ray tracing pipeline.
pub(crate) fn sample() -> Result<Vec<u8>, Failure> {
    written(sample_triangle::main, "triangle.png")
}

/// Runs the example, which traces a triangle by ray queries of a compute shader.
pub(crate) fn example() -> Result<Vec<u8>, Failure> {
    written(example_triangle::main, "triangle.ppm")
}

/// Runs a program in an empty folder, and returns the file that it writes there.
fn written(program: fn() -> Result<(), Box<dyn Error>>, file: &str) -> Result<Vec<u8>, Failure> {
    let folder = tempfile::tempdir()?;
    std::env::set_current_dir(&folder)?;
    program().map_err(|error| Failure::from(error.to_string()))?;
    Ok(std::fs::read(folder.path().join(file))?)
}
