//! Builds and refits of software acceleration structures on the GPU: the kernels and their order.
//!
//! A build sorts primitives along a space-filling curve, and merges nearest neighbours from the leaves up to nodes of two
//! children. In a BLAS, these are then collapsed to nodes of eight children. See [`steps`] for the order of the kernels.
//! Many builds are recorded side by side.

pub(crate) mod geometry;
pub(crate) mod layout;
pub(crate) mod params;
pub(crate) mod refit_layout;
pub(crate) mod steps;
