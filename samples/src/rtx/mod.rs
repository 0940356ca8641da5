//! Shared by the small ray tracing samples (`rtx_hello`, `rtx_textures`, `rtx_ao`, `rtx_pipeline`) and `large_scene`: the
//! configuration of path and size, and rays by pipeline or by query.

mod config;
mod tracer;

pub use config::RtxConfig;
pub(crate) use tracer::{RayStages, Tracer, compute_pipeline, groups};

/// Examples of the samples whose only arguments are those of ray tracing.
pub(crate) const EXAMPLES: &str = "
    | a picture, by the best path of the best device
    --rt query --validate | by ray queries in a compute shader, with validation
    --profile mali-g715 | as on a phone: ray queries
";
