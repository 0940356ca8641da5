//! Contexts: creation, devices, profiles, and interoperation with other engines.

<<<<<<< HEAD
mod external_memory;
=======
mod exchanged_layouts;
#[cfg(target_os = "linux")]
mod guest_windows;
>>>>>>> 38c683e (interop: test devices that have exactly the requirements of a context)
mod interop;
mod no_ray_tracing;
mod profiles;
mod requirements;
mod start;
