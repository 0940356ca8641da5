//! Draws a knot of meshlets by task and mesh shaders; `--help` tells the rest.

use std::process::ExitCode;

use clap::Parser;
use lvk_samples::mesh_shaders::{MeshShadersArgs, run};

fn main() -> ExitCode {
    run(&MeshShadersArgs::parse())
}
