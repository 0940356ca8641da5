//! Programs of one file, without a command line: the sample `triangle` and the example `triangle` of `lvk`.

use std::error::Error;
use std::path::Path;

use crate::Failure;

#[path = "../../../../../lvk/examples/triangle.rs"]
mod example_triangle;
#[path = "../../../../../samples/src/bin/triangle.rs"]
mod sample_triangle;

/// A program and the file that it writes to the current folder.
#[derive(Clone, Copy)]
pub(crate) struct SingleFileProgram {
    main: fn() -> Result<(), Box<dyn Error>>,
    file: &'static str,
}

/// Returns the program of this name: the sample traces by a ray tracing pipeline, the example by ray queries.
pub(crate) fn of_name(name: &str) -> Option<SingleFileProgram> {
    Some(match name {
        "triangle" => SingleFileProgram { main: sample_triangle::main, file: "triangle.png" },
        "example_triangle" => SingleFileProgram { main: example_triangle::main, file: "triangle.ppm" },
        _ => return None,
    })
}

impl SingleFileProgram {
    /// Runs the program in the folder of `result`, and gives its file that name. What else it leaves there stays.
    pub(crate) fn run(self, result: &Path) -> Result<(), Failure> {
        let folder = result.parent().ok_or("a result without a folder")?;
        std::env::set_current_dir(folder)?;
        (self.main)().map_err(|error| Failure::from(error.to_string()))?;
        Ok(std::fs::rename(folder.join(self.file), result)?)
    }
}
