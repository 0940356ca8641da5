//! The command line of the `omni_shadows` sample.

use clap::Parser;

use super::config::{Faces, OmniShadowsConfig, ShadowFilter};
use crate::app::run_args::RunArgs;

/// Rasterises a lamp in a lattice and the shadows all around it, and writes pictures as PNG.
#[derive(Debug, Clone, PartialEq, Parser)]
#[command(name = "omni_shadows", version, after_help = EXAMPLES)]
pub struct OmniShadowsArgs {
    /// How the six faces of the shadow's cube map are drawn
    #[arg(long, value_enum, default_value_t = Faces::Auto, help_heading = "Rendering")]
    pub faces: Faces,

    /// How the shadow is filtered
    #[arg(long, value_enum, default_value_t = ShadowFilter::Soft, help_heading = "Rendering")]
    pub filter: ShadowFilter,

    /// Texels on an edge of the cube map, 16 to 4096
    #[arg(
        long,
        value_name = "TEXELS",
        default_value_t = 1024,
        value_parser = clap::value_parser!(u32).range(16..=i64::from(OmniShadowsConfig::MAX_SHADOW_SIZE)),
        help_heading = "Rendering"
    )]
    pub shadow_size: u32,

    /// Radius of the lamp in metres, 0 to 0.1: the larger, the softer
    #[arg(
        long,
        value_name = "METRES",
        default_value_t = 0.012,
        value_parser = |text: &str| number(text, 0.1),
        help_heading = "Rendering"
    )]
    pub lamp_radius: f32,

    /// How thick the air is, from 0 for clear to 1
    #[arg(
        long,
        value_name = "SHARE",
        default_value_t = 0.005,
        value_parser = |text: &str| number(text, 1.0),
        help_heading = "Rendering"
    )]
    pub haze: f32,

    /// Show the cube map in a corner, unfolded
    #[arg(long, help_heading = "Rendering")]
    pub show_cube: bool,

    /// Frames, pictures and device
    #[command(flatten)]
    pub run: RunArgs,
}

impl OmniShadowsArgs {
    /// What they ask for.
    pub(super) fn config(&self) -> OmniShadowsConfig {
        OmniShadowsConfig {
            extent: self.run.extent(),
            shadow_size: self.shadow_size,
            faces: self.faces,
            filter: self.filter,
            lamp_radius: self.lamp_radius,
            haze: self.haze,
            shows_cube: self.show_cube,
        }
    }
}

const EXAMPLES: &str = "\
Examples:
  omni_shadows                                            a picture, by the best device
  omni_shadows --window                                   in a window with switches for all of the above
  omni_shadows --faces single --filter hard               the cube map face by face, compared with once a pixel
  omni_shadows --lamp-radius 0.05 --haze 0                a larger lamp in clear air
  omni_shadows --frames 0..240 --out dir/frame_####.png   one round of the animation; ranges can be shared among machines

Exit status: 0 when the pictures were written, 1 for trouble with the device, 2 for wrong arguments, 130 after Ctrl-C.";

fn number(text: &str, most: f32) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(value) if (0.0..=most).contains(&value) => Ok(value),
        _ => Err(format!("a number from 0 to {most} is needed")),
    }
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    fn parsed(line: &str) -> Result<OmniShadowsArgs, clap::Error> {
        OmniShadowsArgs::try_parse_from(std::iter::once("omni_shadows").chain(line.split_whitespace()))
    }

    #[test]
    fn the_definition_is_sound_and_its_defaults_are_the_usual() {
        OmniShadowsArgs::command().debug_assert();
        let args = parsed("--width 64 --height 36").unwrap();
        assert_eq!(args.config(), OmniShadowsConfig::new([64, 36]));
    }

    #[test]
    fn values_out_of_range_are_refused() {
        for line in [
            "--shadow-size 15",
            "--shadow-size 4097",
            "--lamp-radius 0.2",
            "--lamp-radius nan",
            "--haze -1",
            "--faces two",
            "--filter x",
            "--rt query",
        ] {
            assert_eq!(parsed(line).unwrap_err().exit_code(), 2, "{line}");
        }
    }
}
