//! Trees for devices without ray tracing: how the CPU builds them and keeps them on disk, which kernels build them on
//! the GPU, and whether a tree from a file is sound. What they are made for is in [`crate::software_ray_query`].
//!
//! Shaders walk them with `software_ray_query/glsl/software_*.glsl`.

pub(crate) mod bvh2;
pub(crate) mod bvh8;
pub(crate) mod encode_blas;
pub(crate) mod encode_instances;
pub(crate) mod encode_tlas;
pub(crate) mod indexed_triangles;
pub(crate) mod mesh_bvh;
pub(crate) mod nodes;
mod ploc;
pub(crate) mod primitives;
pub(crate) mod rebraid;
pub(crate) mod settings;
pub(crate) mod subtrees;
mod thread_budget;
