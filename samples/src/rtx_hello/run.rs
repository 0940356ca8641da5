//! The sample on the command line: pictures and timings out.

use std::process::ExitCode;

use super::{RtxHello, RtxHelloArgs};
use crate::app::cli::{self, ReadySample, SampleSetup};
use crate::app::device::DeviceNeeds;
use crate::app::print_line;
use crate::app::run_error::RunError;
use crate::rtx::{RtxConfig, summary};

/// What the sample and its pictures are called.
const NAME: &str = "rtx_hello";

/// Does what the command line says. Prints to standard output, errors in one line to standard error; the status
/// is 0 when the pictures were written, 1 for trouble with the device, 2 for wrong input, 130 after Ctrl-C.
#[must_use]
pub fn run(args: &RtxHelloArgs) -> ExitCode {
    match args.scene.listing("triangles", "a turning triangle and two rings of smaller ones") {
        Some(listing) => {
            print_line(&listing);
            ExitCode::SUCCESS
        }
        None => cli::run_with(NAME, &args.run, |setup| open(args, setup)),
    }
}

fn open(args: &RtxHelloArgs, setup: &mut SampleSetup<'_>) -> Result<ReadySample<RtxHello>, RunError> {
    let context = setup.device(&DeviceNeeds::tracing(args.tracing.rt))?;
    let capabilities = context.capabilities();
    let config = RtxConfig::from_args(args.tracing.rt, args.run.extent(), capabilities)?;
    let sample = RtxHello::new(&context, &config)?;
    let scene = format!("{} triangles, each an instance of the same one", sample.triangle_count());
    let summary = summary(capabilities, config.path, "a compute shader", &scene);
    Ok(ReadySample { sample, summary })
}
