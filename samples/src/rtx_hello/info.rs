//! The description of the sample's program.

use super::{RtxHello, pipelines};
use crate::app::sample_info::prelude::*;
use crate::app::scene_args::BuiltInSceneRayArgs;

impl SampleInfo for RtxHello {
    const NAME: &'static str = "rtx_hello";
    const ABOUT: &'static str =
        "Renders turning triangles, the first thing that rays can see, and writes pictures as PNG";
    const EXAMPLES: &'static str = crate::rtx::EXAMPLES;
    type Args = BuiltInSceneRayArgs;
    type Sample = Self;

    fn pipelines() -> Vec<SamplePipeline> {
        pipelines::pipelines()
    }

    fn listing(args: &BuiltInSceneRayArgs) -> Option<String> {
        args.scene.listing("triangles", "a turning triangle and two rings of smaller ones")
    }

    fn open(args: &BuiltInSceneRayArgs, setup: &mut SampleSetup<'_>) -> Result<ReadySample<Self>, RunError> {
        let (context, config) = setup.ray_device(args.tracing.rt)?;
        let sample = Self::new(&context, &config)?;
        let scene = format!("{} triangles, each an instance of the same one", sample.triangle_count());
        Ok(ReadySample::ray_traced(sample, config.path, "a compute shader", &scene))
    }
}
