//! The command line of the `rtx_textures` sample.

use clap::Parser;

use crate::app::ray_args::RayArgs;
use crate::app::run_args::RunArgs;
use crate::app::scene_args::BuiltInSceneArgs;

/// Renders textured crates and rings that a compute shader moves, and writes pictures as PNG.
#[derive(Debug, Clone, PartialEq, Parser)]
#[command(name = "rtx_textures", version, after_help = EXAMPLES)]
pub struct RtxTexturesArgs {
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
  rtx_textures                                            a picture, by the best path of the best device
  rtx_textures --rt query --validate                      by ray queries in a compute shader, with validation
  rtx_textures --frames 0..240 --out dir/frame_####.png   one round of the animation; ranges can be shared among machines
  rtx_textures --profile mali-g715                        as on a phone: ray queries

Exit status: 0 when the pictures were written, 1 for trouble with the device, 2 for wrong arguments, 130 after Ctrl-C.";
