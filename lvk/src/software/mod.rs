//! Acceleration structures of the library's own, for devices without ray tracing.

#[allow(dead_code, reason = "nothing but tests builds software structures yet")]
pub(crate) mod gpu_build;
