//! BVHs for devices without ray tracing: builders on the CPU, and the encoding of BLASes and TLASes. See
//! [`crate::software_ray_query`] for their use.
//!
//! Shaders traverse them with `software_ray_query/glsl/software_*.glsl`.

mod binary_node;
pub(crate) mod build_threads;
pub(crate) mod bvh2;
pub(crate) mod bvh8;
mod collapse_cost;
pub(crate) mod encode_blas;
pub(crate) mod encode_instances;
pub(crate) mod encode_tlas;
pub(crate) mod indexed_triangles;
pub(crate) mod mesh_bvh;
mod morton;
pub(crate) mod nodes;
mod partners;
pub(crate) mod phase_times;
mod ploc;
pub(crate) mod primitives;
pub(crate) mod rebraid;
mod reinsertion;
pub(crate) mod settings;
pub(crate) mod subtrees;
mod tree_regions;
mod wide_node;
mod wide_tree;
