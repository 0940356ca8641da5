//! What software traces: how structures lie in memory, how builds and refits of them on the GPU are planned, and what
//! stands behind a handle. Trees that the CPU builds are made in [`crate::software`].

pub(crate) mod blas;
pub(crate) mod body;
pub(crate) mod geometry;
pub(crate) mod job;
pub(crate) mod layout;
pub(crate) mod parts;
pub(crate) mod plan;
pub(crate) mod refit_plan;
pub(crate) mod tlas;
