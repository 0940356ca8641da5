//! The command line of the `sponza` sample.

use clap::Parser;

use super::{DrawPath, SponzaConfig};
use crate::app::run_args::RunArgs;
use crate::app::scene_args::SceneArgs;

/// Rasterises a large textured scene with shadows, culled on the GPU, and writes pictures as PNG.
///
/// Without --scene it shows a columned atrium made by code.
#[derive(Debug, Clone, PartialEq, Parser)]
#[command(name = "sponza", version, after_help = EXAMPLES)]
pub struct SponzaArgs {
    /// Samples a pixel, 1 or 4
    #[arg(
        long,
        value_name = "N",
        default_value_t = 4,
        value_parser = clap::builder::PossibleValuesParser::new(["1", "4"])
            .map(|samples| if samples == "1" { 1_u32 } else { 4 }),
        help_heading = "Rendering"
    )]
    pub msaa: u32,

    /// Draw everything, seen or not; the picture is the same
    #[arg(long, help_heading = "Rendering")]
    pub no_culling: bool,

    /// How draws are taken from what culling leaves [default: counted where the device can]
    #[arg(long, value_enum, help_heading = "Rendering")]
    pub draws: Option<DrawPath>,

    /// Most triangles of a draw, 1 to 1000000
    #[arg(
        long,
        value_name = "N",
        default_value_t = 256,
        value_parser = clap::value_parser!(u32).range(1..=1_000_000),
        help_heading = "Rendering"
    )]
    pub draw_triangles: u32,

    /// Texels on an edge of the shadow map, 16 to 8192
    #[arg(
        long,
        value_name = "N",
        default_value_t = 2048,
        value_parser = clap::value_parser!(u32).range(16..=i64::from(SponzaConfig::MAX_SHADOW_SIZE)),
        help_heading = "Rendering"
    )]
    pub shadow_size: u32,

    /// Texels to each side that shadows are filtered over, 0 to 4
    #[arg(
        long,
        value_name = "N",
        default_value_t = 2,
        value_parser = clap::value_parser!(u32).range(0..=i64::from(SponzaConfig::MAX_FILTER)),
        help_heading = "Rendering"
    )]
    pub filter: u32,

    /// Leave normal maps (`norm`, `map_bump`) out
    #[arg(long, help_heading = "Rendering")]
    pub no_normal_maps: bool,

    /// Which scene, and from where it is seen
    #[command(flatten)]
    pub scene: SceneArgs,

    /// Frames, pictures and device
    #[command(flatten)]
    pub run: RunArgs,
}

const EXAMPLES: &str = "\
Examples:
  sponza                                                  the atrium, by the best device
  sponza --scene crytek_sponza.obj --camera 2             an OBJ through its second camera
  sponza --msaa 1 --filter 0 --no-culling                 the plainest picture
  sponza --window --hot-reload                            in a window, whose shaders can be changed meanwhile
  sponza --frames 0..240 --out dir/frame_####.png         one round through all cameras; ranges can be shared among machines

Exit status: 0 when the pictures were written, 1 for trouble with the device, 2 for wrong arguments, 130 after Ctrl-C.";

impl SponzaArgs {
    /// What to render.
    pub(super) fn config(&self) -> SponzaConfig {
        SponzaConfig {
            samples: self.msaa,
            culls: !self.no_culling,
            draws: self.draws,
            shadow_size: self.shadow_size,
            filter: self.filter,
            triangles_per_draw: self.draw_triangles,
            normal_maps: !self.no_normal_maps,
            ..SponzaConfig::new(self.run.extent())
        }
    }
}

use clap::builder::TypedValueParser as _;

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn the_definition_is_sound_and_values_out_of_range_are_refused() {
        SponzaArgs::command().debug_assert();
        for line in [
            "--msaa 2",
            "--draws some",
            "--shadow-size 15",
            "--filter 5",
            "--draw-triangles 0",
            "--camera 6",
            "x",
        ] {
            let parsed = SponzaArgs::try_parse_from(std::iter::once("sponza").chain(line.split_whitespace()));
            assert_eq!(parsed.unwrap_err().exit_code(), 2, "{line}");
        }
        let args = SponzaArgs::try_parse_from(["sponza", "--msaa", "1", "--no-culling", "--draws", "padded"])
            .unwrap();
        let config = args.config();
        assert_eq!((config.samples, config.culls, config.draws), (1, false, Some(DrawPath::Padded)));
    }
}
