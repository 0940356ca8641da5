//! Measures what `lvk` costs and gains; `--help` tells the rest.

use std::process::ExitCode;

use clap::Parser;
use lvk_samples::bench::{BenchArgs, run};

fn main() -> ExitCode {
    run(&BenchArgs::parse())
}
