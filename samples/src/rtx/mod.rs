//! What the small ray tracing samples (`rtx_hello`, `rtx_textures`, `rtx_ao`, `rtx_pipeline`) share: what is asked for,
//! rays by pipeline or by query, a picture, and what their programs say.

mod canvas;
mod config;
mod error;
mod summary;
mod tracer;

pub(crate) use canvas::Canvas;
pub use config::RtxConfig;
pub use error::RtxError;
pub(crate) use summary::summary;
pub(crate) use tracer::{RayStages, Tracer, compute_pipeline, groups};
