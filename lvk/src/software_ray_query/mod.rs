//! What software traces: how structures lie in memory, how builds and refits of them on the GPU are planned, and what
//! stands behind a handle. Trees that the CPU builds are made in [`crate::software_ray_query::bvh`].
//!
//! `disabled.rs` has the names that the rest of the crate uses, for builds without the feature `software-ray-query`. The
//! folders `command/software_ray_query` and `context/software_ray_query` record and create, each in its layer.

pub(crate) mod blas;
pub(crate) mod bvh;
pub(crate) mod bvh_cache;
pub(crate) mod gpu_build;
pub(crate) mod layout;
pub(crate) mod rebraid_parts;
pub(crate) mod storage;
pub(crate) mod tlas;
pub(crate) mod validate_blob;

/// The files behind `#include <lvk/software_*.glsl>`.
#[cfg(feature = "glsl")]
pub(crate) const GLSL: &[(&str, &str)] = &[
    ("lvk/software_boxes.glsl", include_str!("glsl/software_boxes.glsl")),
    ("lvk/software_cpu_node.glsl", include_str!("glsl/software_cpu_node.glsl")),
    ("lvk/software_cpu_walk.glsl", include_str!("glsl/software_cpu_walk.glsl")),
    ("lvk/software_layout.glsl", include_str!("glsl/software_layout.glsl")),
    ("lvk/software_ray_query.glsl", include_str!("glsl/software_ray_query.glsl")),
    ("lvk/software_stack.glsl", include_str!("glsl/software_stack.glsl")),
    ("lvk/software_triangle.glsl", include_str!("glsl/software_triangle.glsl")),
    ("lvk/software_walk.glsl", include_str!("glsl/software_walk.glsl")),
    ("lvk/software_wide_node.glsl", include_str!("glsl/software_wide_node.glsl")),
];
