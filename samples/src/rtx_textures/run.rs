//! The sample on the command line: pictures and timings out.

use std::process::ExitCode;

use super::{RtxTextures, RtxTexturesArgs};
use crate::app::cli::{self, ReadySample, SampleSetup};
use crate::app::device::DeviceNeeds;
use crate::app::print_line;
use crate::app::run_error::RunError;
use crate::rtx::{RtxConfig, summary};

/// What the sample and its pictures are called.
const NAME: &str = "rtx_textures";

/// Does what the command line says. Prints to standard output, errors in one line to standard error; the status
/// is 0 when the pictures were written, 1 for trouble with the device, 2 for wrong input, 130 after Ctrl-C.
#[must_use]
pub fn run(args: &RtxTexturesArgs) -> ExitCode {
    match args.scene.listing("waves", "crates and rings with textures, on paving") {
        Some(listing) => {
            print_line(&listing);
            ExitCode::SUCCESS
        }
        None => cli::run_with(NAME, &args.run, |setup| open(args, setup)),
    }
}

fn open(args: &RtxTexturesArgs, setup: &mut SampleSetup<'_>) -> Result<ReadySample<RtxTextures>, RunError> {
    let context = setup.device(&DeviceNeeds::tracing(args.tracing.rt))?;
    let capabilities = context.capabilities();
    let config = RtxConfig::from_args(args.tracing.rt, args.run.extent(), capabilities)?;
    let sample = RtxTextures::new(&context, &config)?;
    let scene = format!("{} instances, {} textures", sample.instance_count(), sample.texture_count());
    let summary = summary(capabilities, config.path, "a compute shader", &scene);
    Ok(ReadySample { sample, summary })
}
