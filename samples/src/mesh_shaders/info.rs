//! The description of the sample's program.

use clap::Args;

use super::MeshShaders;
use super::pipelines::MESHLETS;
use crate::app::sample_info::prelude::*;

/// Arguments of the sample.
#[derive(Debug, Clone, PartialEq, Args)]
pub struct MeshShadersArgs {
    /// Draw invisible meshlets too; the picture is the same
    #[arg(long, help_heading = "Rendering")]
    pub no_culling: bool,
}

impl SampleInfo for MeshShaders {
    const NAME: &'static str = "mesh_shaders";
    const ABOUT: &'static str =
        "Draws a knot of meshlets by task and mesh shaders, and writes pictures as PNG";
    const EXAMPLES: &'static str = "
        | a picture, on the most capable device
        --window | in a window; freeze the culling there and move the camera
        --no-culling --frames 100 | the time without culling
        --validate | with validation
    ";
    type Args = MeshShadersArgs;
    type Sample = Self;

    fn pipelines() -> Vec<SamplePipeline> {
        vec![MESHLETS.data()]
    }

    fn open(args: &MeshShadersArgs, setup: &mut SampleSetup<'_>) -> Result<ReadySample<Self>, RunError> {
        let context = setup.device(&DeviceNeeds::default())?;
        let sample = Self::new(&context, setup.extent(), !args.no_culling)?;
        let meshlets = sample.meshlets();
        let (count, triangles) = (meshlets.meshlets.len(), meshlets.triangles.len());
        let scene = format!("a knot of {triangles} triangles in {count} meshlets");
        Ok(ReadySample::raster(sample, &scene))
    }
}
