//! The command line of the `hybrid_oit` sample.

use clap::Parser;

use super::HybridOitConfig;
use crate::app::ray_args::RayArgs;
use crate::app::run_args::RunArgs;
use crate::app::scene_args::BuiltInSceneArgs;

/// FrameTime in seconds at which the built-in animation begins: one that shows every colour of shadow.
const SHOWN_MOMENT: f64 = 1.9;

/// Renders blocks and drifting spheres of tinted glass, by the rasteriser with order-independent transparency and with
/// ray traced coloured shadows, and writes pictures as PNG.
#[derive(Debug, Clone, PartialEq, Parser)]
#[command(name = "hybrid_oit", version, after_help = EXAMPLES)]
pub struct HybridOitArgs {
    /// Samples a pixel along each side, 1 to 4: they smooth edges
    #[arg(
        long,
        value_name = "N",
        default_value_t = 2,
        value_parser = clap::value_parser!(u32).range(1..=i64::from(HybridOitConfig::MAX_SUPERSAMPLING)),
        help_heading = "Rendering"
    )]
    pub supersampling: u32,

    /// Shadow rays a sample, 1 to 64; a single one gives hard shadows
    #[arg(
        long,
        value_name = "N",
        default_value_t = 4,
        value_parser = clap::value_parser!(u32).range(1..=i64::from(HybridOitConfig::MAX_SHADOW_RAYS)),
        help_heading = "Rendering"
    )]
    pub shadow_rays: u32,

    /// Nodes in the pool of the transparency lists; glass that finds none is left out and counted
    /// [default: two a sample]
    #[arg(long, value_name = "N", help_heading = "Rendering")]
    pub nodes: Option<u32>,

    /// FrameTime of the animation that frame 0 shows, in seconds
    #[arg(
        long,
        value_name = "SECONDS",
        default_value_t = SHOWN_MOMENT,
        value_parser = seconds,
        allow_negative_numbers = true,
        help_heading = "Frames"
    )]
    pub time: f64,

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
  hybrid_oit                                              a picture, by the best path of the best device
  hybrid_oit --supersampling 4 --shadow-rays 16           a smoother one
  hybrid_oit --rt query --validate                        shadows by ray queries, under validation
  hybrid_oit --time 5.5                                   another moment
  hybrid_oit --frames 0..240 --out dir/frame_####.png     one round of the animation; ranges can be shared among machines
  hybrid_oit --nodes 100000                               too few nodes: see what is lost
  hybrid_oit --profile mali-g715                          as on a phone: ray queries

Exit status: 0 when the pictures were written, 1 for trouble with the device, 2 for wrong arguments, 130 after Ctrl-C.";

fn seconds(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|value: &f64| value.is_finite()).ok_or_else(|| "a number is needed".to_owned())
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    fn parsed(line: &str) -> Result<HybridOitArgs, clap::Error> {
        HybridOitArgs::try_parse_from(std::iter::once("hybrid_oit").chain(line.split_whitespace()))
    }

    #[test]
    fn the_definition_is_sound() {
        HybridOitArgs::command().debug_assert();
        let args = parsed("--nodes 0 --time -2.5").unwrap();
        assert_eq!((args.supersampling, args.shadow_rays, args.nodes), (2, 4, Some(0)));
        assert_eq!((args.time, parsed("").unwrap().time), (-2.5, SHOWN_MOMENT));
    }

    #[test]
    fn values_out_of_range_are_refused() {
        for line in [
            "--supersampling 0",
            "--supersampling 5",
            "--shadow-rays 0",
            "--shadow-rays 65",
            "--nodes -1",
            "--nodes 4294967296",
            "--time nan",
            "x",
        ] {
            assert_eq!(parsed(line).unwrap_err().exit_code(), 2, "{line}");
        }
    }
}
