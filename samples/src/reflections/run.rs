//! The sample on the command line: pictures and timings out.

use std::fmt::Write as _;
use std::process::ExitCode;

use lvk::Context;

use super::{CullingCost, Reflections, ReflectionsArgs, ReflectionsConfig, ReflectionsError};
use crate::app::cli::{self, ReadySample, SampleSetup};
use crate::app::device::{DeviceNeeds, device_text, query_text};
use crate::app::print_line;
use crate::app::run_error::RunError;
use crate::hybrid::RayPath;

/// What the sample and its pictures are called.
const NAME: &str = "reflections";

/// How often culling is measured on a GPU, and on a driver that runs on the CPU.
const GPU_ROUNDS: u32 = 25;
const CPU_ROUNDS: u32 = 3;

impl From<ReflectionsError> for RunError {
    fn from(error: ReflectionsError) -> Self {
        match error {
            ReflectionsError::BadSize { .. } | ReflectionsError::BadSamples { .. } => Self::input(error),
            ReflectionsError::Rays(error) => error.into(),
            ReflectionsError::Device(_) => Self::device(error),
        }
    }
}

/// Does what the command line says. Prints to standard output, errors in one line to standard error; the status
/// is 0 when the pictures were written, 1 for trouble with the device, 2 for wrong input, 130 after Ctrl-C.
#[must_use]
pub fn run(args: &ReflectionsArgs) -> ExitCode {
    match args.scene.listing("hall", "polished floors, water, glass, a serpent and drifting leaves") {
        Some(listing) => {
            print_line(&listing);
            ExitCode::SUCCESS
        }
        None => cli::run_with(NAME, &args.run, |setup| open(args, setup)),
    }
}

fn open(args: &ReflectionsArgs, setup: &mut SampleSetup<'_>) -> Result<ReadySample<Reflections>, RunError> {
    let context = setup.device(&DeviceNeeds::tracing(args.tracing.rt))?;
    let path = RayPath::choose(RayPath::from_args(args.tracing.rt), context.capabilities())?;
    let config = ReflectionsConfig {
        samples: args.samples,
        min_angle: args.min_angle,
        ..ReflectionsConfig::new(path, args.run.width, args.run.height)
    };
    setup.progress.stage("making the hall and its pipelines", 0);
    let sample = Reflections::new(&context, &config)?;
    let mut summary = summary(&context, &sample);
    if args.compare_culling {
        setup.progress.stage("measuring what culling saves", 0);
        let rounds = if context.capabilities().is_cpu { CPU_ROUNDS } else { GPU_ROUNDS };
        if let Some(cost) = CullingCost::measure(&sample, rounds)? {
            let _ = write!(summary, "\n          {cost}");
        }
    }
    Ok(ReadySample { sample, summary })
}

fn summary(ctx: &Context, sample: &Reflections) -> String {
    let capabilities = ctx.capabilities();
    let mut text = device_text(capabilities);
    let path = match sample.config().path {
        RayPath::Pipeline => "ray tracing pipeline",
        RayPath::Query => &query_text(capabilities, "compute shaders"),
    };
    let _ = writeln!(
        text,
        "method    g-buffers, then reflected rays; {path}; {} samples",
        sample.config().samples
    );
    let count = sample.instance_count();
    let share = 100.0 * f64::from(count.kept) / f64::from(count.total.max(1));
    let angle = sample.config().min_angle;
    let _ = write!(
        text,
        "culling   {} of {} instances kept ({share:.0} %): those seen under {angle} radians or more",
        count.kept, count.total
    );
    text
}
