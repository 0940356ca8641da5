//! Renders textured things that a compute shader moves, by ray tracing; `--help` tells the rest.

use std::process::ExitCode;

use clap::Parser;
use lvk_samples::rtx_textures::{RtxTexturesArgs, run};

fn main() -> ExitCode {
    run(&RtxTexturesArgs::parse())
}
