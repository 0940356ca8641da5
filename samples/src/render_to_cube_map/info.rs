//! The description of the sample's program.

use clap::{Args, ValueEnum};

use super::config::{CubeMapFaces, RenderToCubeMapConfig};
use super::{RenderToCubeMap, pipelines};
use crate::app::sample_info::prelude::*;
use crate::app::value_parsers::{up_to, whole};

/// Arguments of the sample.
#[derive(Debug, Clone, PartialEq, Args)]
#[command(next_help_heading = "Rendering")]
pub struct RenderToCubeMapArgs {
    /// Method of drawing the faces of the cube map; the image is the same
    #[arg(long, value_enum, default_value_t = FacesArg::Auto)]
    pub faces: FacesArg,

    /// Side of a face in pixels, 16 to 4096
    #[arg(long, value_name = "PIXELS", default_value_t = 512)]
    #[arg(value_parser = whole(16..=RenderToCubeMapConfig::MAX_FACE_SIZE))]
    pub face_size: u32,

    /// Blur of the drop's reflection, 0 to 1
    #[arg(long, value_name = "SHARE", default_value_t = 0.0, value_parser = up_to(1.0))]
    pub roughness: f32,
}

/// The method of drawing the faces of the cube map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum FacesArg {
    /// One pass if the device has six views at once, else six passes.
    Auto,
    /// A pass for each face.
    SixPasses,
    /// One pass, with a view for each face.
    OnePass,
}

impl SampleInfo for RenderToCubeMap {
    const NAME: &'static str = "render_to_cube_map";
    const ABOUT: &'static str = "Draws the surroundings of a drop into a cube map, which the drop mirrors, and writes pictures as PNG";
    const EXAMPLES: &'static str = "
        | a picture, on the most capable device
        --window | in a window, with a panel for all options
        --faces six-passes --validate | a pass for each face, with validation
        --roughness 0.6 | a drop of brushed metal
    ";
    type Args = RenderToCubeMapArgs;
    type Sample = Self;

    fn pipelines() -> Vec<SamplePipeline> {
        pipelines::pipelines()
    }

    fn open(args: &RenderToCubeMapArgs, setup: &mut SampleSetup<'_>) -> Result<ReadySample<Self>, RunError> {
        let context = setup.device(&DeviceNeeds::default())?;
        let faces = CubeMapFaces::from_args(args.faces, context.capabilities());
        let config = RenderToCubeMapConfig {
            face_size: args.face_size,
            roughness: args.roughness,
            ..RenderToCubeMapConfig::new(setup.extent(), faces)
        };
        let sample = Self::new(&context, &config)?;
        let by = match faces {
            CubeMapFaces::SixPasses => "six passes",
            CubeMapFaces::OnePass => "one pass of six views",
        };
        let (count, size) = (sample.blocks().len() - 1, config.face_size);
        let scene =
            format!("{count} blocks around a drop; a cube map of 6 x {size} x {size} pixels, drawn in {by}");
        Ok(ReadySample::raster(sample, &scene))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::cli::assert_refuses;

    #[test]
    fn values_out_of_range_are_refused() {
        assert_refuses::<RenderToCubeMap>(&[
            "--faces seven",
            "--face-size 15",
            "--face-size 4097",
            "--roughness 1.1",
            "--roughness nan",
            "x",
        ]);
    }
}
