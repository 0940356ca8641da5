//! What software traces: how structures lie in memory, how builds and refits of them on the GPU are planned, and what
//! stands behind a handle. Trees that the CPU builds are made in [`crate::software_ray_query::bvh`].

pub(crate) mod blas;
pub(crate) mod bvh;
pub(crate) mod bvh_cache;
pub(crate) mod gpu_build;
pub(crate) mod layout;
pub(crate) mod rebraid_parts;
pub(crate) mod storage;
pub(crate) mod tlas;
pub(crate) mod validate_blob;
