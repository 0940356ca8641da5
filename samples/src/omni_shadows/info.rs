//! The description of the sample's program.

use clap::Args;

use super::config::{OmniShadowsConfig, ShadowFaces, ShadowFilter};
use super::{OmniShadows, pipelines};
use crate::app::sample_info::prelude::*;
use crate::app::value_parsers::{up_to, whole};

/// Arguments of the sample.
#[derive(Debug, Clone, PartialEq, Args)]
#[command(next_help_heading = "Rendering")]
pub struct OmniShadowsArgs {
    /// Method of drawing the six faces of the shadow's cube map
    #[arg(long, value_enum, default_value_t = ShadowFaces::Auto)]
    pub faces: ShadowFaces,

    /// Filter of the shadow
    #[arg(long, value_enum, default_value_t = ShadowFilter::Soft)]
    pub filter: ShadowFilter,

    /// Texels on an edge of the cube map, 16 to 4096
    #[arg(long, value_name = "TEXELS", default_value_t = 1024)]
    #[arg(value_parser = whole(16..=OmniShadowsConfig::MAX_SHADOW_SIZE))]
    pub shadow_size: u32,

    /// Radius of the lamp in metres, 0 to 0.1; a larger lamp has softer shadows
    #[arg(long, value_name = "METRES", default_value_t = 0.012, value_parser = up_to(0.1))]
    pub lamp_radius: f32,

    /// Density of the air, from 0 for clear to 1
    #[arg(long, value_name = "SHARE", default_value_t = 0.005, value_parser = up_to(1.0))]
    pub haze: f32,

    /// Show the cube map in a corner, unfolded
    #[arg(long)]
    pub show_cube: bool,
}

impl OmniShadowsArgs {
    /// The configuration for images of `extent` pixels.
    fn config(&self, extent: [u32; 2]) -> OmniShadowsConfig {
        let Self { faces, filter, shadow_size, lamp_radius, haze, show_cube: shows_cube } = *self;
        OmniShadowsConfig { extent, shadow_size, faces, filter, lamp_radius, haze, shows_cube }
    }
}

impl SampleInfo for OmniShadows {
    const NAME: &'static str = "omni_shadows";
    const ABOUT: &'static str =
        "Rasterises a lamp in a lattice and the shadows all around it, and writes pictures as PNG";
    const EXAMPLES: &'static str = "
        | a picture, on the most capable device
        --window | in a window, with a panel for all options
        --faces single --filter hard | the cube map face by face, one comparison per pixel
        --lamp-radius 0.05 --haze 0 | a larger lamp in clear air
    ";
    type Args = OmniShadowsArgs;
    type Sample = Self;

    fn pipelines() -> Vec<SamplePipeline> {
        pipelines::ALL.iter().map(|pipeline| pipeline.data()).collect()
    }

    fn open(args: &OmniShadowsArgs, setup: &mut SampleSetup<'_>) -> Result<ReadySample<Self>, RunError> {
        let context = setup.device(&DeviceNeeds::default())?;
        let sample = Self::new(&context, &args.config(setup.extent()))?;
        let passes = if sample.is_multiview() { "in one pass by multiview" } else { "in six passes" };
        let (triangles, size) = (sample.triangle_count(), args.shadow_size);
        let scene = format!(
            "a lamp in a lattice: {triangles} triangles; shadows in a cube of {size} texels {passes}"
        );
        Ok(ReadySample::raster(sample, &scene))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::cli::{assert_refuses, parse_line};

    #[test]
    fn defaults_are_the_usual() {
        let args = parse_line::<OmniShadows>("").unwrap().sample;
        assert_eq!(args.config([64, 36]), OmniShadowsConfig::new([64, 36]));
    }

    #[test]
    fn values_out_of_range_are_refused() {
        assert_refuses::<OmniShadows>(&[
            "--shadow-size 15",
            "--shadow-size 4097",
            "--lamp-radius 0.2",
            "--lamp-radius nan",
            "--haze -1",
            "--faces two",
            "--filter x",
            "--rt query",
        ]);
    }
}
