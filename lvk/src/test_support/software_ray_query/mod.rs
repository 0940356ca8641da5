//! Test doubles and hooks for the builds of software structures.

pub(crate) mod collapse_kernels;
pub(crate) mod collapse_model;
pub(crate) mod gpu_build_check;
pub(crate) mod hooks;
pub(crate) mod sort_kernels;
