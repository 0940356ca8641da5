//! Software ray queries: memory layout of BLASes and TLASes, plans of builds and refits on the GPU, and the software
//! half of BLAS and TLAS objects. [`crate::software_ray_query::bvh`] builds trees on the CPU.
//!
//! `create` and `record` hold the methods of `Context` and `CommandBuffer` that create and build them. The shaders of
//! applications traverse them with the GLSL in `glsl/`; the compute shaders in `kernels/` build and refit them.
//!
//! In builds without the feature `software-ray-query`, the folder `disabled` takes the place of this module. It has the
//! items that the rest of the crate uses.

pub(crate) mod blas;
pub(crate) mod bvh;
pub(crate) mod bvh_cache;
pub(crate) mod create;
pub(crate) mod expected_mesh;
pub(crate) mod gpu_build;
pub(crate) mod layout;
pub(crate) mod rebraid_parts;
pub(crate) mod record;
pub(crate) mod storage;
pub(crate) mod tlas;
pub(crate) mod validate_blob;

/// The files for `#include <lvk/software_*.glsl>`.
#[cfg(feature = "glsl")]
pub(crate) const GLSL: &[(&str, &str)] = &[
    ("lvk/software_boxes.glsl", include_str!("glsl/software_boxes.glsl")),
    ("lvk/software_cpu_node.glsl", include_str!("glsl/software_cpu_node.glsl")),
    ("lvk/software_cpu_traversal.glsl", include_str!("glsl/software_cpu_traversal.glsl")),
    ("lvk/software_layout.glsl", include_str!("glsl/software_layout.glsl")),
    ("lvk/software_ray_query.glsl", include_str!("glsl/software_ray_query.glsl")),
    ("lvk/software_stack.glsl", include_str!("glsl/software_stack.glsl")),
    ("lvk/software_traversal.glsl", include_str!("glsl/software_traversal.glsl")),
    ("lvk/software_triangle.glsl", include_str!("glsl/software_triangle.glsl")),
    ("lvk/software_wide_node.glsl", include_str!("glsl/software_wide_node.glsl")),
];
