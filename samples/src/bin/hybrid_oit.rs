//! Renders blocks and spheres of tinted glass with coloured ray traced shadows; `--help` tells the rest.

use std::process::ExitCode;

use clap::Parser;
use lvk_samples::hybrid_oit::{HybridOitArgs, run};

fn main() -> ExitCode {
    run(&HybridOitArgs::parse())
}
