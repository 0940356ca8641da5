//! Renders a rasterised scene with ray traced sunlight and ambient occlusion; `--help` tells the rest.

use std::process::ExitCode;

use clap::Parser;
use lvk_samples::rtx_ao::{RtxAoArgs, run};

fn main() -> ExitCode {
    run(&RtxAoArgs::parse())
}
