//! The `rtx_pipeline` sample: a whole ray tracing pipeline. One ray a pixel starts; hit shaders read textures, ask for
//! their lights by shadow rays of their own with a miss shader of their own, and trace on from mirrors and through glass,
//! each one level deeper. By queries a loop does the same.
//!
//! [`RtxPipeline`] is the sample for programs and tests, `info.rs` describes its program.

mod config;
mod info;
mod panel;
mod pipelines;
mod renderer;

pub use config::RtxPipelineConfig;
pub use info::RtxPipelineArgs;
pub use panel::RtxPipelineSettings;
pub use renderer::RtxPipeline;
