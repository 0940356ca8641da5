//! Rasterises a turning triangle; `--help` tells the rest.

use std::process::ExitCode;

use clap::Parser;
use lvk_samples::hello_triangle::{HelloTriangleArgs, run};

fn main() -> ExitCode {
    run(&HelloTriangleArgs::parse())
}
