//! The command line of the `reflections` sample.

use clap::Parser;

use super::ReflectionsConfig;
use crate::app::ray_args::RayArgs;
use crate::app::run_args::RunArgs;
use crate::app::scene_args::BuiltInSceneArgs;

/// Renders a hall with polished floors, water, glass, a serpent and drifting leaves, all of them reflected by ray tracing
/// over a rasterised picture, and writes pictures as PNG.
#[derive(Debug, Clone, PartialEq, Parser)]
#[command(name = "reflections", version, after_help = EXAMPLES)]
pub struct ReflectionsArgs {
    /// Samples of each pixel, 1 to 256: they smooth edges, soft shadows and glossy reflections
    #[arg(
        long,
        value_name = "N",
        default_value_t = 4,
        value_parser = clap::value_parser!(u32).range(1..=i64::from(ReflectionsConfig::MAX_SAMPLES)),
        help_heading = "Rendering"
    )]
    pub samples: u32,

    /// Leave instances out of the acceleration structure that are seen under less than so many radians; 0 keeps all
    #[arg(
        long,
        value_name = "RADIANS",
        default_value_t = ReflectionsConfig::DEFAULT_MIN_ANGLE,
        value_parser = angle,
        help_heading = "Rendering"
    )]
    pub min_angle: f32,

    /// Also measure the frame without leaving instances out, and say what that saves
    #[arg(long, help_heading = "Rendering")]
    pub compare_culling: bool,

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
  reflections                                             a picture, by the best path of the best device
  reflections --samples 16 --out hall.png                 a smoother one
  reflections --frames 0..240 --out dir/frame_####.png    one round of the animation; ranges can be shared among machines
  reflections --compare-culling                           what leaving small instances out saves, in milliseconds
  reflections --rt query --validate                       by ray queries in compute shaders, with validation
  reflections --profile mali-g715                         as on a phone: ray queries, split meshes

Exit status: 0 when the pictures were written, 1 for trouble with the device, 2 for wrong arguments, 130 after Ctrl-C.";

fn angle(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(value) if (0.0..=std::f32::consts::PI).contains(&value) => Ok(value),
        _ => Err("an angle from 0 to 3.14 is needed".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    fn parsed(line: &str) -> Result<ReflectionsArgs, clap::Error> {
        ReflectionsArgs::try_parse_from(std::iter::once("reflections").chain(line.split_whitespace()))
    }

    #[test]
    fn the_definition_is_sound_and_defaults_are_those_of_the_configuration() {
        ReflectionsArgs::command().debug_assert();
        let args = parsed("").unwrap();
        assert_eq!((args.samples, args.min_angle), (4, ReflectionsConfig::DEFAULT_MIN_ANGLE));
        assert!(!args.compare_culling && parsed("--compare-culling").unwrap().compare_culling);
    }

    #[test]
    fn values_out_of_range_are_refused() {
        for line in
            ["--samples 0", "--samples 257", "--min-angle -0.1", "--min-angle nan", "--min-angle 4", "x"]
        {
            assert_eq!(parsed(line).unwrap_err().exit_code(), 2, "{line}");
        }
    }
}
