//! Contexts: how they start, on which devices, and inside of other engines.

mod interop;
mod no_ray_tracing;
mod profiles;
mod start;
