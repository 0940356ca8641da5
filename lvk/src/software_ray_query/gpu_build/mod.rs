//! Builds and refits of software acceleration structures on the GPU: the kernels and their order.
//!
//! A build sorts primitives along a space-filling curve, finds the hierarchy of their codes, and fits bounds from the
//! leaves up. In a BLAS, nodes are then collapsed to eight children each. See [`steps`] for the order of the kernels.
//! Many builds are recorded side by side.

pub(crate) mod geometry;
pub(crate) mod layout;
pub(crate) mod params;
pub(crate) mod refit_layout;
pub(crate) mod steps;
