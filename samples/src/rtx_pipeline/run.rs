//! The sample on the command line: scene in, pictures and timings out.

use std::process::ExitCode;

use super::{RtxPipeline, RtxPipelineArgs, RtxPipelineConfig};
use crate::app::cli::{self, ReadySample, SampleSetup};
use crate::app::device::DeviceNeeds;
use crate::app::print_line;
use crate::app::run_error::RunError;
use crate::hybrid::{fit_textures, textures_needed};
use crate::rtx::{RtxConfig, summary};

/// What the sample and its pictures are called.
const NAME: &str = "rtx_pipeline";

/// Does what the command line says. Prints to standard output, errors in one line to standard error; the status
/// is 0 when the pictures were written, 1 for trouble with the device, 2 for wrong input, 130 after Ctrl-C.
#[must_use]
pub fn run(args: &RtxPipelineArgs) -> ExitCode {
    match args.scene.list.listing() {
        Some(listing) => {
            print_line(&listing);
            ExitCode::SUCCESS
        }
        None => cli::run_with(NAME, &args.run, |setup| open(args, setup)),
    }
}

fn open(args: &RtxPipelineArgs, setup: &mut SampleSetup<'_>) -> Result<ReadySample<RtxPipeline>, RunError> {
    args.scene.check_out(&args.run.out_or(NAME))?;
    let mut scene = args.scene.load(&mut setup.progress)?;
    setup.warn(&scene.warnings);
    let tracing = DeviceNeeds::tracing(args.tracing.rt);
    let context = setup.device(&DeviceNeeds { textures: textures_needed(&scene), ..tracing })?;
    let capabilities = context.capabilities();
    setup.warn(&fit_textures(&mut scene, &capabilities.limits)?);
    let config = RtxPipelineConfig {
        rtx: RtxConfig::from_args(args.tracing.rt, args.run.extent(), capabilities)?,
        depth: args.depth,
    };
    setup.progress.stage("uploading the scene and building acceleration structures", 0);
    let sample = RtxPipeline::new(&context, &scene, &config)?;
    let sample = sample.from_camera(&scene, args.scene.camera.index());
    let (count, parts) = (sample.triangle_count(), sample.blas_part_count());
    let RtxPipelineConfig { rtx, depth } = *sample.config();
    let told = format!(
        "{}: {count} triangles in {parts} bottom-level structures, {} textures; rays mirrored {depth} times at most",
        scene.name,
        scene.textures.len()
    );
    let summary = summary(capabilities, rtx.path, "a compute shader", &told);
    Ok(ReadySample { sample, summary })
}
