//! Acceleration structures of the library's own, for devices without ray tracing: how they lie in memory, how the CPU
//! and the GPU build them, what stands behind a handle.
//!
//! Shaders walk them with `shader/glsl/software_*.glsl`.

pub(crate) mod binary_tree;
pub(crate) mod blas;
pub(crate) mod blas_blob;
pub(crate) mod body;
pub(crate) mod gpu_build;
pub(crate) mod instances;
pub(crate) mod layout;
pub(crate) mod mesh;
pub(crate) mod quality;
pub(crate) mod sound;
pub(crate) mod tlas;
pub(crate) mod tlas_blob;
pub(crate) mod tree;
pub(crate) mod tree_cache;
pub(crate) mod vertices;
pub(crate) mod wide_tree;
