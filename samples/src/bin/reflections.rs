//! Renders a hall full of ray traced reflections; `--help` tells the rest.

use std::process::ExitCode;

use clap::Parser;
use lvk_samples::reflections::ReflectionsArgs;

fn main() -> ExitCode {
    lvk_samples::reflections::run(&ReflectionsArgs::parse())
}
