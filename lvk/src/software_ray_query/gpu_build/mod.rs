//! Builds and refits of software structures on the GPU: which kernels run, in which order.
//!
//! A build sorts primitives along a space-filling curve, finds the hierarchy of their codes, and fits boxes from the
//! leaves up. Of bottom-level structures eight children at a time then become one node; see [`steps`] for the order of the
//! kernels. Many builds are recorded side by side.

pub(crate) mod geometry;
pub(crate) mod layout;
pub(crate) mod params;
pub(crate) mod refit_layout;
pub(crate) mod steps;
