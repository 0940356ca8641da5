//! The description of the sample's program.

use clap::Args;

use super::{RtxAo, RtxAoConfig, pipelines};
use crate::app::ray_args::RayArgs;
use crate::app::sample_info::prelude::*;
use crate::app::scene_args::SceneArgs;
use crate::app::value_parsers::{positive, whole};
use crate::rtx::RtxConfig;
use crate::scene::Scene;

/// Radius of the ambient occlusion in the town, whose ground extends far beyond its houses.
const TOWN_RADIUS: f32 = 1.8;

/// Arguments of the sample.
#[derive(Debug, Clone, PartialEq, Args)]
#[command(next_help_heading = "Rendering")]
pub struct RtxAoArgs {
    /// Passes that a frame adds to the picture, 1 to 4096; each reduces noise
    #[arg(long, value_name = "N", default_value_t = 16, value_parser = whole(1..=RtxAoConfig::MAX_PASSES))]
    pub passes: u32,

    /// Rays to the surroundings of each pixel and pass, 1 to 64
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = whole(1..=RtxAoConfig::MAX_RAYS))]
    pub rays: u32,

    /// Distance within which surroundings darken a surface, in scene units [default: a share of the scene's size]
    #[arg(long, value_name = "UNITS", value_parser = positive)]
    pub radius: Option<f32>,

    /// The scene and its camera
    #[command(flatten)]
    pub scene: SceneArgs,

    /// The ray tracing path
    #[command(flatten)]
    pub tracing: RayArgs,
}

impl RtxAoArgs {
    /// Loads the scene, and the part of it that turns.
    fn load(&self, setup: &mut SampleSetup<'_>) -> Result<(Scene, Option<Scene>), RunError> {
        if self.scene.scene.as_deref().is_none_or(|name| name.as_os_str() == "town") {
            return Ok((Scene::town(), Some(Scene::carousel())));
        }
        Ok((self.scene.load(&mut setup.progress)?, None))
    }
}

impl SampleInfo for RtxAo {
    const NAME: &'static str = "rtx_ao";
    const ABOUT: &'static str = "Renders a rasterised scene with ray traced sunlight and ambient occlusion, and writes pictures as PNG";
    const DETAILS: &'static str =
        "Without --scene the sample renders a generated town of paper around a turning carousel.";
    const EXAMPLES: &'static str = "
        | a picture, on the most capable device and its fastest path
        --passes 256 | less noise
        --frames 20 | passes added up over twenty frames, each timed
        --scene courtyard --camera 2 | the scene of the hybrid sample
        --rt query --validate | ray queries in the fragment shader, with validation
    ";
    type Args = RtxAoArgs;
    type Sample = Self;

    fn pipelines() -> Vec<SamplePipeline> {
        pipelines::pipelines()
    }

    fn listing(args: &RtxAoArgs) -> Option<String> {
        args.scene.list.listing_after("town  built in: paper houses around a carousel")
    }

    fn open(args: &RtxAoArgs, setup: &mut SampleSetup<'_>) -> Result<ReadySample<Self>, RunError> {
        args.scene.check_out(&setup.args.out_or(Self::NAME))?;
        let (scene, turning) = args.load(setup)?;
        setup.warn(&scene.warnings);
        let textures = scene.textures.len() as u32 + 16;
        let context = setup.device(&DeviceNeeds { textures, ..DeviceNeeds::tracing(args.tracing.rt) })?;
        let rtx = RtxConfig::from_args(args.tracing.rt, setup.extent(), context.capabilities())?;
        // As the mesh: a radius beyond its range would leave single precision.
        let resized = |radius: f32| (f64::from(radius) * scene.resize).clamp(1e-9, 1e9) as f32;
        let radius = args.radius.map(resized).or(turning.is_some().then_some(TOWN_RADIUS));
        let (passes, rays) = (args.passes, args.rays);
        let config = RtxAoConfig { rtx, passes, rays, radius };
        setup.progress.stage("uploading the scene and building acceleration structures", 0);
        let sample = Self::new(&context, &scene, turning.as_ref(), &config)?;
        let sample = sample.from_camera(&scene, args.scene.camera.index());
        let (name, count, radius) = (&scene.name, sample.triangle_count(), sample.radius());
        let text = format!(
            "{name}: {count} triangles; {passes} passes a frame, {rays} rays within {radius:.2} units"
        );
        Ok(ReadySample::ray_traced(sample, rtx.path, "a fragment shader", &text))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::cli::assert_refuses;

    #[test]
    fn values_out_of_range_are_refused() {
        assert_refuses::<RtxAo>(&[
            "--passes 0",
            "--passes 4097",
            "--rays 0",
            "--rays 65",
            "--radius 0",
            "--radius nan",
            "x",
        ]);
    }
}
