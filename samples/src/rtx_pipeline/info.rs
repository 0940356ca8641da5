//! The description of the sample's program.

use clap::Args;

use super::{RtxPipeline, RtxPipelineConfig, pipelines};
use crate::app::ray_args::RayArgs;
use crate::app::sample_info::prelude::*;
use crate::app::scene_args::SceneArgs;
use crate::app::value_parsers::whole;
use crate::rtx::RtxConfig;

/// Arguments of the sample.
#[derive(Debug, Clone, PartialEq, Args)]
pub struct RtxPipelineArgs {
    /// Maximum number of reflections and refractions of a ray, 0 to 16; pipelines of some devices allow less
    #[arg(long, value_name = "N", default_value_t = 4)]
    #[arg(value_parser = whole(0..=RtxPipelineConfig::MAX_DEPTH), help_heading = "Rendering")]
    pub depth: u32,

    /// The scene and its camera
    #[command(flatten)]
    pub scene: SceneArgs,

    /// The ray tracing path
    #[command(flatten)]
    pub tracing: RayArgs,
}

impl SampleInfo for RtxPipeline {
    const NAME: &'static str = "rtx_pipeline";
    const ABOUT: &'static str = "Renders a textured scene by a ray tracing pipeline whose hit shaders trace on, and writes pictures as PNG";
    const DETAILS: &'static str = "Without --scene the sample renders a generated courtyard.";
    const EXAMPLES: &'static str = "
        | the courtyard, on the most capable device and its fastest path
        --rt pipeline --depth 0 | shadows only
        --scene kitchen.obj --camera 3 | an OBJ through its third camera
        --rt query --validate | ray queries in a compute shader, with validation
        --profile mali-g715 | emulates a phone: ray queries, split meshes
    ";
    const ROUND: &'static str = "one round through all cameras";
    type Args = RtxPipelineArgs;
    type Sample = Self;

    fn pipelines() -> Vec<SamplePipeline> {
        pipelines::pipelines()
    }

    fn listing(args: &RtxPipelineArgs) -> Option<String> {
        args.scene.list.listing()
    }

    fn open(args: &RtxPipelineArgs, setup: &mut SampleSetup<'_>) -> Result<ReadySample<Self>, RunError> {
        args.scene.check_out(&setup.args.out_or(Self::NAME))?;
        let scene = args.scene.load(&mut setup.progress)?;
        let (context, scene) = setup.device_for_scene(scene, &DeviceNeeds::tracing(args.tracing.rt))?;
        let rtx = RtxConfig::from_args(args.tracing.rt, setup.extent(), context.capabilities())?;
        let config = RtxPipelineConfig { rtx, depth: args.depth };
        setup.progress.stage("uploading the scene and building acceleration structures", 0);
        let sample = Self::new(&context, &scene, &config)?;
        let sample = sample.from_camera(&scene, args.scene.camera.index());
        let (count, parts) = (sample.triangle_count(), sample.blas_part_count());
        let RtxPipelineConfig { rtx, depth } = *sample.config();
        let text = format!(
            "{}: {count} triangles in {parts} bottom-level structures, {} textures; rays mirrored {depth} times at most",
            scene.name,
            scene.textures.len()
        );
        Ok(ReadySample::ray_traced(sample, rtx.path, "a compute shader", &text))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::cli::assert_refuses;

    #[test]
    fn values_out_of_range_are_refused() {
        assert_refuses::<RtxPipeline>(&["--depth 17", "--depth -1", "--camera 6", "--rt mesh", "x"]);
    }
}
