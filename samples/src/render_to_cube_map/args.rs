//! The command line of the `render_to_cube_map` sample.

use clap::{Parser, ValueEnum};

use super::RenderToCubeMapConfig;
use crate::app::run_args::RunArgs;

/// Draws the surroundings of a drop into a cube map, which the drop mirrors, and writes pictures as PNG.
#[derive(Debug, Clone, PartialEq, Parser)]
#[command(name = "render_to_cube_map", version, after_help = EXAMPLES)]
pub struct RenderToCubeMapArgs {
    /// How to draw the faces of the cube map; the picture is the same
    #[arg(long, value_enum, default_value_t = FacesArg::Auto, help_heading = "Rendering")]
    pub faces: FacesArg,

    /// Side of a face in pixels, 16 to 4096
    #[arg(
        long,
        value_name = "PIXELS",
        default_value_t = 512,
        value_parser = clap::value_parser!(u32).range(16..=i64::from(RenderToCubeMapConfig::MAX_FACE_SIZE)),
        help_heading = "Rendering"
    )]
    pub face_size: u32,

    /// How blurred the drop mirrors, 0 to 1
    #[arg(long, value_name = "SHARE", default_value_t = 0.0, value_parser = share, help_heading = "Rendering")]
    pub roughness: f32,

    /// Frames, pictures and device
    #[command(flatten)]
    pub run: RunArgs,
}

/// How to draw the faces of the cube map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum FacesArg {
    /// In one pass where the device has six views at once.
    Auto,
    /// A pass for each.
    SixPasses,
    /// All in one pass, with a view for each.
    OnePass,
}

const EXAMPLES: &str = "\
Examples:
  render_to_cube_map                                      a picture, by the best device
  render_to_cube_map --window                             in a window, with a switch from six passes to one
  render_to_cube_map --faces six-passes --validate        a pass for each face, with validation
  render_to_cube_map --roughness 0.6                      as if the drop were of brushed metal
  render_to_cube_map --frames 0..240 --out dir/f_####.png one round of the animation; ranges can be shared among machines

Exit status: 0 when the pictures were written, 1 for trouble with the device, 2 for wrong arguments, 130 after Ctrl-C.";

fn share(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(value) if (0.0..=1.0).contains(&value) => Ok(value),
        _ => Err("a number from 0 to 1 is needed".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn the_definition_is_sound_and_values_out_of_range_are_refused() {
        RenderToCubeMapArgs::command().debug_assert();
        for line in
            ["--faces seven", "--face-size 15", "--face-size 4097", "--roughness 1.1", "--roughness nan", "x"]
        {
            let words = std::iter::once("render_to_cube_map").chain(line.split_whitespace());
            assert_eq!(RenderToCubeMapArgs::try_parse_from(words).unwrap_err().exit_code(), 2, "{line}");
        }
    }
}
