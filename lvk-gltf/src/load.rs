//! Loading of files.

use std::ops::ControlFlow;
use std::path::Path;

use crate::{Error, Model, Problem, Result};

/// How to load a model.
#[derive(Clone, Copy, Default)]
pub struct LoadOptions<'a> {
    /// The most memory that the load takes.
    pub memory: MemoryLimit,
    /// Called from time to time, in the thread that loads. `Break` stops the load with [`Problem::Stopped`].
    pub on_progress: Option<&'a dyn Fn(Progress) -> ControlFlow<()>>,
}

/// Most memory of a load and of its model: a fixed part and a multiple of the bytes of the files.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MemoryLimit {
    /// Bytes for every file. Small files may hold large images.
    pub fixed_bytes: u64,
    /// Bytes for each byte of the file, and of the buffers and images that it names.
    pub multiple: u64,
}

/// How far a load is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// What is being done.
    pub step: &'static str,
    /// Objects of this step that are done.
    pub done: usize,
    /// Objects of this step.
    pub total: usize,
}

impl Default for MemoryLimit {
    /// One GiB and 64 bytes for each byte.
    fn default() -> Self {
        Self { fixed_bytes: 1 << 30, multiple: 64 }
    }
}

impl Model {
    /// Reads a `.gltf` or `.glb` file. Its content says which of the two it is. Buffers and images that it names by a
    /// relative path are read from its folder and the folders inside of it.
    ///
    /// # Errors
    /// [`Error`], if a file cannot be read, breaks a rule of the format, requires an unknown extension, or would take more
    /// memory than [`LoadOptions::memory`].
    pub fn load(path: &Path, options: &LoadOptions<'_>) -> Result<Self> {
        _ = options;
        Err(Error { file: path.display().to_string(), problem: Problem::Stopped })
    }

    /// Reads the bytes of a `.gltf` or `.glb` file. Other files that it names are read from `folder`; without a folder it
    /// may not name any.
    ///
    /// # Errors
    /// As [`Model::load`].
    pub fn from_bytes(bytes: &[u8], folder: Option<&Path>, options: &LoadOptions<'_>) -> Result<Self> {
        _ = (bytes, folder, options);
        Err(Error { file: "model".into(), problem: Problem::Stopped })
    }
}
