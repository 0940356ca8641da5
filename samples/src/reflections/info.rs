//! The description of the sample's program.

use std::fmt::Write as _;

use clap::Args;

use super::{CullingCost, Reflections, ReflectionsConfig, pipelines};
use crate::app::device::device_text;
use crate::app::sample::Sample as _;
use crate::app::sample_info::prelude::*;
use crate::app::scene_args::BuiltInSceneRayArgs;
use crate::app::summary::path_text;
use crate::app::value_parsers::{up_to, whole};

/// Frames that measure culling on a GPU, and on a driver that runs on the CPU.
const GPU_ROUNDS: u32 = 25;
const CPU_ROUNDS: u32 = 3;

/// Arguments of the sample.
#[derive(Debug, Clone, PartialEq, Args)]
#[command(next_help_heading = "Rendering")]
pub struct ReflectionsArgs {
    /// Samples per pixel, 1 to 256, for antialiasing, soft shadows and glossy reflections
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = whole(1..=ReflectionsConfig::MAX_SAMPLES))]
    pub samples: u32,

    /// Angular size in radians below which instances are left out of the acceleration structure; 0 keeps all
    #[arg(long, value_name = "RADIANS", default_value_t = ReflectionsConfig::DEFAULT_MIN_ANGLE)]
    #[arg(value_parser = up_to(std::f32::consts::PI))]
    pub min_angle: f32,

    /// Also measure the frame with all instances, and print the difference
    #[arg(long)]
    pub compare_culling: bool,

    /// The built-in scene and the ray tracing path
    #[command(flatten)]
    pub common: BuiltInSceneRayArgs,
}

impl SampleInfo for Reflections {
    const NAME: &'static str = "reflections";
    const ABOUT: &'static str = "Renders a hall with polished floors, water, glass, a serpent and drifting leaves, all of them reflected by ray tracing over a rasterised picture, and writes pictures as PNG";
    const EXAMPLES: &'static str = "
        | a picture, on the most capable device and its fastest path
        --samples 16 --out hall.png | 16 samples per pixel
        --compare-culling | the time that culling small instances saves, in milliseconds
        --rt query --validate | ray queries in compute shaders, with validation
        --profile mali-g715 | emulates a phone: ray queries, split meshes
    ";
    type Args = ReflectionsArgs;
    type Sample = Self;

    fn pipelines() -> Vec<SamplePipeline> {
        pipelines::pipelines()
    }

    fn listing(args: &ReflectionsArgs) -> Option<String> {
        args.common.scene.listing("hall", "polished floors, water, glass, a serpent and drifting leaves")
    }

    fn open(args: &ReflectionsArgs, setup: &mut SampleSetup<'_>) -> Result<ReadySample<Self>, RunError> {
        let (context, rtx) = setup.ray_device(args.common.tracing.rt)?;
        let (samples, min_angle) = (args.samples, args.min_angle);
        let usual = ReflectionsConfig::new(rtx.path, rtx.width, rtx.height);
        setup.progress.stage("making the hall and its pipelines", 0);
        let sample = Self::new(&context, &ReflectionsConfig { samples, min_angle, ..usual })?;
        let mut summary = summary(&sample);
        if args.compare_culling {
            setup.progress.stage("measuring what culling saves", 0);
            let rounds = if context.capabilities().is_cpu { CPU_ROUNDS } else { GPU_ROUNDS };
            if let Some(cost) = CullingCost::measure(&sample, rounds)? {
                let _ = write!(summary, "\n          {cost}");
            }
        }
        Ok(ReadySample { sample, summary })
    }
}

fn summary(sample: &Reflections) -> String {
    let (capabilities, config) = (sample.context().capabilities(), sample.config());
    let path = path_text(capabilities, config.path, "compute shaders");
    let count = sample.instance_count();
    let share = 100.0 * f64::from(count.kept) / f64::from(count.total.max(1));
    format!(
        "{}method    g-buffers, then reflected rays; {path}; {} samples\n\
         culling   {} of {} instances kept ({share:.0} %): those seen under {} radians or more",
        device_text(capabilities),
        config.samples,
        count.kept,
        count.total,
        config.min_angle
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::cli::{assert_refuses, parse_line};

    #[test]
    fn defaults_are_those_of_the_configuration() {
        let parsed = |line| parse_line::<Reflections>(line).unwrap().sample;
        let args = parsed("");
        assert_eq!((args.samples, args.min_angle), (4, ReflectionsConfig::DEFAULT_MIN_ANGLE));
        assert!(!args.compare_culling && parsed("--compare-culling").compare_culling);
    }

    #[test]
    fn values_out_of_range_are_refused() {
        assert_refuses::<Reflections>(&[
            "--samples 0",
            "--samples 257",
            "--min-angle -0.1",
            "--min-angle nan",
            "--min-angle 4",
            "x",
        ]);
    }
}
