//! Test doubles and hooks for builds of software acceleration structures.

pub(crate) mod cluster_kernels;
pub(crate) mod cluster_model;
pub(crate) mod collapse_kernels;
pub(crate) mod collapse_model;
pub(crate) mod cpu_builds;
pub(crate) mod gpu_build_check;
pub(crate) mod hooks;
pub(crate) mod sort_kernels;
pub(crate) mod wide_tree;
