//! The command line of the `rtx_hello` sample.

use clap::Parser;

use crate::app::ray_args::RayArgs;
use crate::app::run_args::RunArgs;
use crate::app::scene_args::BuiltInSceneArgs;

/// Renders turning triangles, the first thing that rays can see, and writes pictures as PNG.
#[derive(Debug, Clone, PartialEq, Parser)]
#[command(name = "rtx_hello", version, after_help = EXAMPLES)]
pub struct RtxHelloArgs {
    /// The built-in scene
    #[command(flatten)]
    pub scene: BuiltInSceneArgs,

    /// By what rays are traced
    #[command(flatten)]
    pub tracing: RayArgs,

    /// Frames, pictures and device
    #[command(flatten)]
    pub run: RunArgs,
}

const EXAMPLES: &str = "\
Examples:
  rtx_hello                                               a picture, by the best path of the best device
  rtx_hello --rt query --validate                         by ray queries in a compute shader, with validation
  rtx_hello --frames 0..240 --out dir/frame_####.png      one round of the animation; ranges can be shared among machines
  rtx_hello --profile mali-g715                           as on a phone: ray queries

Exit status: 0 when the pictures were written, 1 for trouble with the device, 2 for wrong arguments, 130 after Ctrl-C.";
