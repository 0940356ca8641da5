//! The command line of the `mesh_shaders` sample.

use clap::Parser;

use crate::app::run_args::RunArgs;

/// Draws a knot of meshlets by task and mesh shaders, and writes pictures as PNG.
#[derive(Debug, Clone, PartialEq, Parser)]
#[command(name = "mesh_shaders", version, after_help = EXAMPLES)]
pub struct MeshShadersArgs {
    /// Draw meshlets that cannot be seen, too; the picture is the same
    #[arg(long, help_heading = "Rendering")]
    pub no_culling: bool,

    /// Frames, pictures and device
    #[command(flatten)]
    pub run: RunArgs,
}

const EXAMPLES: &str = "\
Examples:
  mesh_shaders                                            a picture, by the best device
  mesh_shaders --window                                   in a window; hold the culling there, and look at it from elsewhere
  mesh_shaders --no-culling --frames 100                  what culling saves
  mesh_shaders --validate                                 with validation
  mesh_shaders --frames 0..240 --out dir/frame_####.png   one round of the animation; ranges can be shared among machines

Exit status: 0 when the pictures were written, 1 for trouble with the device, 2 for wrong arguments, 130 after Ctrl-C.";
