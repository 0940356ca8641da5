//! The sample on the command line: pictures and timings out.

use std::fmt::Write as _;
use std::process::ExitCode;

use lvk::Context;

use super::{HybridOit, HybridOitArgs, HybridOitConfig, HybridOitError, HybridOitSequence, OitScene};
use crate::app::cli::{self, ReadySample, SampleSetup};
use crate::app::device::{DeviceNeeds, device_text, query_text};
use crate::app::print_line;
use crate::app::run_error::RunError;
use crate::hybrid::RayPath;

/// What the sample and its pictures are called.
const NAME: &str = "hybrid_oit";

impl From<HybridOitError> for RunError {
    fn from(error: HybridOitError) -> Self {
        match error {
            HybridOitError::Path(error) => error.into(),
            HybridOitError::Device(_) => Self::device(error),
            _ => Self::input(error),
        }
    }
}

/// Does what the command line says. Prints to standard output, errors in one line to standard error; the status
/// is 0 when the pictures were written, 1 for trouble with the device, 2 for wrong input, 130 after Ctrl-C.
#[must_use]
pub fn run(args: &HybridOitArgs) -> ExitCode {
    match args.scene.listing("room", "blocks and drifting spheres of tinted glass") {
        Some(listing) => {
            print_line(&listing);
            ExitCode::SUCCESS
        }
        None => cli::run_with(NAME, &args.run, |setup| open(args, setup)),
    }
}

fn open(
    args: &HybridOitArgs,
    setup: &mut SampleSetup<'_>,
) -> Result<ReadySample<HybridOitSequence>, RunError> {
    let context = setup.device(&DeviceNeeds::tracing(args.tracing.rt))?;
    let path = RayPath::choose(RayPath::from_args(args.tracing.rt), context.capabilities())?;
    let scene = OitScene::default();
    let config = HybridOitConfig {
        supersampling: args.supersampling,
        shadow_rays: args.shadow_rays,
        node_capacity: args.nodes,
        ..HybridOitConfig::new(path, args.run.width, args.run.height)
    };
    setup.progress.stage("making the scene and its pipelines", 0);
    let sample = HybridOit::new(&context, &scene, &config)?;
    let summary = summary(&context, &scene, &config);
    let sample = HybridOitSequence::new(sample, args.time);
    Ok(ReadySample { sample, summary })
}

fn summary(ctx: &Context, scene: &OitScene, config: &HybridOitConfig) -> String {
    let capabilities = ctx.capabilities();
    let mut text = device_text(capabilities);
    let path = match config.path {
        RayPath::Pipeline => "a ray tracing pipeline",
        RayPath::Query => &query_text(capabilities, "a compute shader"),
    };
    let _ = writeln!(text, "method    raster with a list of glass for each sample; shadows by {path}");
    let (samples, rays) = (config.supersampling * config.supersampling, config.shadow_rays);
    let OitScene { blocks, balls, glass, .. } = scene;
    let _ = write!(
        text,
        "scene     {} blocks, {} balls, {} spheres of glass; samples a pixel {samples}, shadow rays each {rays}",
        blocks.len(),
        balls.len(),
        glass.len()
    );
    text
}
