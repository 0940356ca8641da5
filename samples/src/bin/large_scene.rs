//! Renders millions of triangles, split, compacted and kept on disk; `--help` tells the rest.

use std::process::ExitCode;

use clap::Parser;
use lvk_samples::large_scene::{LargeSceneArgs, run};

fn main() -> ExitCode {
    run(&LargeSceneArgs::parse())
}
