//! Shared by the small ray tracing samples (`rtx_hello`, `rtx_textures`, `rtx_ao`, `rtx_pipeline`) and `large_scene`: the
//! configuration of path and size, and rays by pipeline or by query.

mod config;
mod tracer;

pub use config::RtxConfig;
pub(crate) use tracer::{RayStages, Tracer, compute_pipeline, groups};
