//! The command line of the `rtx_ao` sample.

use clap::Parser;

use super::RtxAoConfig;
use crate::app::ray_args::RayArgs;
use crate::app::run_args::RunArgs;
use crate::app::scene_args::SceneArgs;

/// Renders a rasterised scene with ray traced sunlight and ambient occlusion, and writes pictures as PNG.
///
/// Without --scene it shows a town of paper made by code, around a carousel that turns.
#[derive(Debug, Clone, PartialEq, Parser)]
#[command(name = "rtx_ao", version, after_help = EXAMPLES)]
pub struct RtxAoArgs {
    /// Passes that a frame adds to the picture, 1 to 4096: noise falls with each
    #[arg(
        long,
        value_name = "N",
        default_value_t = 16,
        value_parser = clap::value_parser!(u32).range(1..=i64::from(RtxAoConfig::MAX_PASSES)),
        help_heading = "Rendering"
    )]
    pub passes: u32,

    /// Rays to the surroundings of each pixel and pass, 1 to 64
    #[arg(
        long,
        value_name = "N",
        default_value_t = 2,
        value_parser = clap::value_parser!(u32).range(1..=i64::from(RtxAoConfig::MAX_RAYS)),
        help_heading = "Rendering"
    )]
    pub rays: u32,

    /// How far surroundings darken a surface, in scene units [default: a share of the scene's size]
    #[arg(long, value_name = "UNITS", value_parser = radius, help_heading = "Rendering")]
    pub radius: Option<f32>,

    /// Which scene, and from where it is seen
    #[command(flatten)]
    pub scene: SceneArgs,

    /// By what rays are traced
    #[command(flatten)]
    pub tracing: RayArgs,

    /// Frames, pictures and device
    #[command(flatten)]
    pub run: RunArgs,
}

const EXAMPLES: &str = "\
Examples:
  rtx_ao                                                  a picture, by the best path of the best device
  rtx_ao --passes 256                                     a cleaner one
  rtx_ao --frames 20                                      the same passes added up over twenty frames, each of them timed
  rtx_ao --scene courtyard --camera 2                     the scene of the hybrid sample
  rtx_ao --rt query --validate                            by ray queries in the fragment shader, with validation
  rtx_ao --frames 0..240 --out dir/frame_####.png         one round of the animation; ranges can be shared among machines

Exit status: 0 when the pictures were written, 1 for trouble with the device, 2 for wrong arguments, 130 after Ctrl-C.";

fn radius(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(value) if value > 0.0 && value.is_finite() => Ok(value),
        _ => Err("a positive number is needed".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn the_definition_is_sound_and_values_out_of_range_are_refused() {
        RtxAoArgs::command().debug_assert();
        for line in
            ["--passes 0", "--passes 4097", "--rays 0", "--rays 65", "--radius 0", "--radius nan", "x"]
        {
            let parsed = RtxAoArgs::try_parse_from(std::iter::once("rtx_ao").chain(line.split_whitespace()));
            assert_eq!(parsed.unwrap_err().exit_code(), 2, "{line}");
        }
    }
}
