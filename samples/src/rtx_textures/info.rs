//! The description of the sample's program.

use super::{RtxTextures, pipelines};
use crate::app::sample_info::prelude::*;
use crate::app::scene_args::BuiltInSceneRayArgs;

impl SampleInfo for RtxTextures {
    const NAME: &'static str = "rtx_textures";
    const ABOUT: &'static str =
        "Renders textured crates and rings that a compute shader moves, and writes pictures as PNG";
    const EXAMPLES: &'static str = crate::rtx::EXAMPLES;
    type Args = BuiltInSceneRayArgs;
    type Sample = Self;

    fn pipelines() -> Vec<SamplePipeline> {
        pipelines::pipelines()
    }

    fn listing(args: &BuiltInSceneRayArgs) -> Option<String> {
        args.scene.listing("waves", "crates and rings with textures, on paving")
    }

    fn open(args: &BuiltInSceneRayArgs, setup: &mut SampleSetup<'_>) -> Result<ReadySample<Self>, RunError> {
        let (context, config) = setup.ray_device(args.tracing.rt)?;
        let sample = Self::new(&context, &config)?;
        let scene = format!("{} instances, {} textures", sample.instance_count(), sample.texture_count());
        Ok(ReadySample::ray_traced(sample, config.path, "a compute shader", &scene))
    }
}
