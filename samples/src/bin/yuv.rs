//! Shows a moving picture in Y'CbCr; `--help` tells the rest.

use std::process::ExitCode;

use clap::Parser;
use lvk_samples::yuv::{YuvArgs, run};

fn main() -> ExitCode {
    run(&YuvArgs::parse())
}
