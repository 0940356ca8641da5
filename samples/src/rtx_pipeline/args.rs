//! The command line of the `rtx_pipeline` sample.

use clap::Parser;

use super::RtxPipelineConfig;
use crate::app::ray_args::RayArgs;
use crate::app::run_args::RunArgs;
use crate::app::scene_args::SceneArgs;

/// Renders a textured scene by a ray tracing pipeline whose hit shaders trace on, and writes pictures as PNG.
///
/// Without --scene it shows a courtyard made by code.
#[derive(Debug, Clone, PartialEq, Parser)]
#[command(name = "rtx_pipeline", version, after_help = EXAMPLES)]
pub struct RtxPipelineArgs {
    /// How often a ray may be mirrored or bent, 0 to 16; pipelines of some devices cannot trace so deep
    #[arg(
        long,
        value_name = "N",
        default_value_t = 4,
        value_parser = clap::value_parser!(u32).range(0..=i64::from(RtxPipelineConfig::MAX_DEPTH)),
        help_heading = "Rendering"
    )]
    pub depth: u32,

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
  rtx_pipeline                                            the courtyard, by the best path of the best device
  rtx_pipeline --rt pipeline --depth 0                    shadows alone
  rtx_pipeline --scene kitchen.obj --camera 3             an OBJ through its third camera
  rtx_pipeline --rt query --validate                      by ray queries in a compute shader, with validation
  rtx_pipeline --profile mali-g715                        as on a phone: ray queries, split meshes
  rtx_pipeline --frames 0..240 --out dir/frame_####.png   one round through all cameras; ranges can be shared among machines

Exit status: 0 when the pictures were written, 1 for trouble with the device, 2 for wrong arguments, 130 after Ctrl-C.";

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn the_definition_is_sound_and_values_out_of_range_are_refused() {
        RtxPipelineArgs::command().debug_assert();
        for line in ["--depth 17", "--depth -1", "--camera 6", "--rt mesh", "x"] {
            let words = std::iter::once("rtx_pipeline").chain(line.split_whitespace());
            assert_eq!(RtxPipelineArgs::try_parse_from(words).unwrap_err().exit_code(), 2, "{line}");
        }
    }
}
