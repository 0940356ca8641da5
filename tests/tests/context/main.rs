//! Contexts: creation, devices, profiles, and interoperation with other engines.

mod engine;
mod exchanged_layouts;
mod external_memory;
#[cfg(target_os = "linux")]
mod guest_windows;
mod host_waits;
mod interop;
mod no_ray_tracing;
mod profiles;
mod requirements;
mod start;
mod strange_windows;
