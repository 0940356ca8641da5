//! The description of the sample's program.

use clap::Args;

use super::{HybridOit, HybridOitConfig, HybridOitSequence, OitScene, pipelines};
use crate::app::device::{device_text, pipeline_text, query_text};
use crate::app::sample_info::prelude::*;
use crate::app::scene_args::BuiltInSceneRayArgs;
use crate::app::value_parsers::whole;
use crate::hybrid::RayPath;

/// Frame time in seconds at which the built-in animation begins: its picture has every colour of shadow.
const FIRST_SECONDS: f64 = 1.9;

/// Arguments of the sample.
#[derive(Debug, Clone, PartialEq, Args)]
#[command(next_help_heading = "Rendering")]
pub struct HybridOitArgs {
    /// Samples along each side of a pixel, 1 to 4, for antialiasing
    #[arg(long, value_name = "N", default_value_t = 2)]
    #[arg(value_parser = whole(1..=HybridOitConfig::MAX_SUPERSAMPLING))]
    pub supersampling: u32,

    /// Shadow rays per sample, 1 to 64; 1 gives hard shadows
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = whole(1..=HybridOitConfig::MAX_SHADOW_RAYS))]
    pub shadow_rays: u32,

    /// Nodes in the pool of the transparency lists; glass without a free node is left out and counted
    /// [default: two per sample]
    #[arg(long, value_name = "N")]
    pub nodes: Option<u32>,

    /// Frame time of frame 0 in the animation, in seconds
    #[arg(long, value_name = "SECONDS", default_value_t = FIRST_SECONDS, value_parser = seconds)]
    #[arg(allow_negative_numbers = true, help_heading = "Frames")]
    pub time: f64,

    /// The built-in scene and the ray tracing path
    #[command(flatten)]
    pub common: BuiltInSceneRayArgs,
}

impl SampleInfo for HybridOit {
    const NAME: &'static str = "hybrid_oit";
    const ABOUT: &'static str = "Renders blocks and drifting spheres of tinted glass, by the rasteriser with order-independent transparency and with ray traced coloured shadows, and writes pictures as PNG";
    const EXAMPLES: &'static str = "
        | a picture, on the most capable device and its fastest path
        --supersampling 4 --shadow-rays 16 | more samples and softer shadows
        --rt query --validate | shadows by ray queries, with validation
        --time 5.5 | another frame time
        --nodes 100000 | too few nodes: some glass is missing
        --profile mali-g715 | emulates a phone: ray queries
    ";
    type Args = HybridOitArgs;
    type Sample = HybridOitSequence;

    fn pipelines() -> Vec<SamplePipeline> {
        pipelines::pipelines()
    }

    fn listing(args: &HybridOitArgs) -> Option<String> {
        args.common.scene.listing("room", "blocks and drifting spheres of tinted glass")
    }

    fn open(
        args: &HybridOitArgs,
        setup: &mut SampleSetup<'_>,
    ) -> Result<ReadySample<HybridOitSequence>, RunError> {
        let (context, rtx) = setup.ray_device(args.common.tracing.rt)?;
        let scene = OitScene::default();
        let config = HybridOitConfig {
            supersampling: args.supersampling,
            shadow_rays: args.shadow_rays,
            node_capacity: args.nodes,
            ..HybridOitConfig::new(rtx.path, rtx.width, rtx.height)
        };
        setup.progress.stage("making the scene and its pipelines", 0);
        let sample = Self::new(&context, &scene, &config)?;
        let summary = summary(&sample, &scene);
        Ok(ReadySample { sample: HybridOitSequence::new(sample, args.time), summary })
    }
}

fn seconds(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|value: &f64| value.is_finite()).ok_or_else(|| "a number is needed".to_owned())
}

fn summary(sample: &HybridOit, OitScene { blocks, balls, glass, .. }: &OitScene) -> String {
    let (capabilities, config) = (sample.context().capabilities(), sample.config());
    let path = match config.path {
        RayPath::Pipeline => &format!("a {}", pipeline_text(capabilities)),
        RayPath::Query => &query_text(capabilities, "a compute shader"),
    };
    format!(
        "{}method    raster with a list of glass for each sample; shadows by {path}\n\
         scene     {} blocks, {} balls, {} spheres of glass; samples a pixel {}, shadow rays each {}",
        device_text(capabilities),
        blocks.len(),
        balls.len(),
        glass.len(),
        config.supersampling * config.supersampling,
        config.shadow_rays
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::cli::{assert_refuses, parse_line};

    #[test]
    fn defaults_and_times_are_read() {
        let parsed = |line| parse_line::<HybridOit>(line).unwrap().sample;
        let args = parsed("--nodes 0 --time -2.5");
        assert_eq!((args.supersampling, args.shadow_rays, args.nodes), (2, 4, Some(0)));
        assert_eq!((args.time, parsed("").time), (-2.5, FIRST_SECONDS));
    }

    #[test]
    fn values_out_of_range_are_refused() {
        assert_refuses::<HybridOit>(&[
            "--supersampling 0",
            "--supersampling 5",
            "--shadow-rays 0",
            "--shadow-rays 65",
            "--nodes -1",
            "--nodes 4294967296",
            "--time nan",
            "x",
        ]);
    }
}
