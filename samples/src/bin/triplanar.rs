//! Draws bodies without texture coordinates; `--help` tells the rest.

use std::process::ExitCode;

use clap::Parser;
use lvk_samples::triplanar::{TriplanarArgs, run};

fn main() -> ExitCode {
    run(&TriplanarArgs::parse())
}
