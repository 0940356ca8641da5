//! The command line of the `hello_triangle` sample.

use clap::Parser;

use crate::app::run_args::RunArgs;

/// Rasterises a turning triangle, the first thing to draw, and writes pictures as PNG.
#[derive(Debug, Clone, PartialEq, Parser)]
#[command(name = "hello_triangle", version, after_help = EXAMPLES)]
pub struct HelloTriangleArgs {
    /// Frames, pictures and device
    #[command(flatten)]
    pub run: RunArgs,
}

const EXAMPLES: &str = "\
Examples:
  hello_triangle                                          a picture, by the best device
  hello_triangle --window --hot-reload                    in a window, whose shaders can be changed meanwhile
  hello_triangle --frames 0..240 --out dir/frame_####.png one round of the animation; ranges can be shared among machines
  hello_triangle --validate                               with validation

Exit status: 0 when the pictures were written, 1 for trouble with the device, 2 for wrong arguments, 130 after Ctrl-C.";
