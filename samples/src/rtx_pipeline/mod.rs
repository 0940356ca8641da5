//! The `rtx_pipeline` sample: a whole ray tracing pipeline. One ray a pixel starts; hit shaders read textures, ask for
//! their lights by shadow rays of their own with a miss shader of their own, and trace on from mirrors and through glass,
//! each one level deeper. By queries a loop does the same.
//!
//! [`RtxPipeline`] is the sample for programs and tests, [`run`] the one for the command line.

mod args;
mod config;
mod pipelines;
mod renderer;
mod run;
mod switches;

pub use args::RtxPipelineArgs;
pub use config::RtxPipelineConfig;
pub use pipelines::pipelines;
pub use renderer::RtxPipeline;
pub use run::run;
pub use switches::RtxPipelineSwitches;
