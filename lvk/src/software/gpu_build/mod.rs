//! Builds and refits of software structures on the GPU: which kernels run, in which order.
//!
//! A build sorts primitives along a space-filling curve, finds the hierarchy of their codes, and fits boxes from the
//! leaves up; see [`steps`] for the order of the kernels. Many builds are recorded side by side.

#[cfg(feature = "test-hooks")]
pub(crate) mod check;
pub(crate) mod steps;
