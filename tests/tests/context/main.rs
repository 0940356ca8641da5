//! Contexts: creation, devices, profiles, and interoperation with other engines.

mod external_memory;
mod interop;
mod no_ray_tracing;
mod profiles;
mod start;
