//! Builds and refits of software structures on the GPU: which kernels run, in which order.
//!
//! A build sorts primitives along a space-filling curve, finds the hierarchy of their codes, and fits boxes from the
//! leaves up. Of bottom-level structures eight children at a time then become one node; see [`steps`] for the order of the
//! kernels. Many builds are recorded side by side.

#[cfg(any(test, feature = "test-hooks"))]
#[cfg_attr(not(feature = "test-hooks"), expect(dead_code, reason = "tests of the workspace ask for more"))]
pub(crate) mod check;
#[cfg(any(test, feature = "test-hooks"))]
#[cfg_attr(not(feature = "test-hooks"), expect(dead_code, reason = "tests of the workspace ask for more"))]
pub(crate) mod collapse;
pub(crate) mod geometry;
pub(crate) mod layout;
pub(crate) mod params;
pub(crate) mod refit_layout;
pub(crate) mod steps;
