//! Renders turning triangles by ray tracing; `--help` tells the rest.

use std::process::ExitCode;

use clap::Parser;
use lvk_samples::rtx_hello::{RtxHelloArgs, run};

fn main() -> ExitCode {
    run(&RtxHelloArgs::parse())
}
