//! Draws the surroundings of a drop into a cube map, which it mirrors; `--help` tells the rest.

use std::process::ExitCode;

use clap::Parser;
use lvk_samples::render_to_cube_map::{RenderToCubeMapArgs, run};

fn main() -> ExitCode {
    run(&RenderToCubeMapArgs::parse())
}
