//! Renders a textured scene by a ray tracing pipeline whose hit shaders trace on; `--help` tells the rest.

use std::process::ExitCode;

use clap::Parser;
use lvk_samples::rtx_pipeline::{RtxPipelineArgs, run};

fn main() -> ExitCode {
    run(&RtxPipelineArgs::parse())
}
