//! Trees for devices without ray tracing: how the CPU builds them and keeps them on disk, which kernels build them on
//! the GPU, and whether a tree from a file is sound. What they are made for is in [`crate::accel::software`].
//!
//! Shaders walk them with `shader/glsl/software_*.glsl`.

pub(crate) mod binary_tree;
pub(crate) mod blas_blob;
pub(crate) mod gpu_build;
pub(crate) mod instances;
pub(crate) mod mesh;
pub(crate) mod opening;
pub(crate) mod parts;
mod ploc;
pub(crate) mod quality;
pub(crate) mod sound;
mod threads;
pub(crate) mod tlas_blob;
pub(crate) mod tree;
pub(crate) mod tree_cache;
pub(crate) mod vertices;
pub(crate) mod wide_tree;
