//! Acceleration structures of the library's own, for devices without ray tracing.

pub(crate) mod gpu_build;
