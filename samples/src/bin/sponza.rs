//! Rasterises a large textured scene with shadows, culled on the GPU; `--help` tells the rest.

use std::process::ExitCode;

use clap::Parser;
use lvk_samples::sponza::{SponzaArgs, run};

fn main() -> ExitCode {
    run(&SponzaArgs::parse())
}
