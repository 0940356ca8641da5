//! Renders a scene with ray traced shadows, reflections and refractions; `--help` tells the rest.

use std::process::ExitCode;

use clap::Parser;
use lvk_samples::hybrid::HybridArgs;

fn main() -> ExitCode {
    lvk_samples::hybrid::run(&HybridArgs::parse())
}
