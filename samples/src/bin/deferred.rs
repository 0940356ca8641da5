//! Lights a hall by hundreds of small lights, deferred; `--help` tells the rest.

use std::process::ExitCode;

use clap::Parser;
use lvk_samples::deferred::{DeferredArgs, run};

fn main() -> ExitCode {
    run(&DeferredArgs::parse())
}
