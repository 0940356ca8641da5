//! Passes that rewrite a SPIR-V module.

pub(crate) mod check_indices;
#[cfg(feature = "glsl")]
pub(crate) mod merge_sampled_image;
pub(crate) mod strip_primitive_culling;
pub(crate) mod strip_ray_query;
#[cfg(feature = "glsl")]
pub(crate) mod strip_unused_bindings;
