//! BVHs for devices without ray tracing: builders on the CPU, and the encoding of BLASes and TLASes. See
//! [`crate::software_ray_query`] for their use.
//!
//! Shaders traverse them with `software_ray_query/glsl/software_*.glsl`.

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
