//! Rasterises a lamp in a lattice and the shadows all around it; `--help` tells the rest.

use std::process::ExitCode;

use clap::Parser;
use lvk_samples::omni_shadows::{OmniShadowsArgs, run};

fn main() -> ExitCode {
    run(&OmniShadowsArgs::parse())
}
