//! The sample on the command line: pictures and timings out.

use std::process::ExitCode;

use super::{HelloTriangle, HelloTriangleArgs};
use crate::app::cli::{self, ReadySample, SampleSetup};
use crate::app::device::DeviceNeeds;
use crate::app::run_error::RunError;
use crate::raster::summary;

/// What the sample and its pictures are called.
const NAME: &str = "hello_triangle";

/// Does what the command line says. Prints to standard output, errors in one line to standard error; the status
/// is 0 when the pictures were written, 1 for trouble with the device, 2 for wrong input, 130 after Ctrl-C.
#[must_use]
pub fn run(args: &HelloTriangleArgs) -> ExitCode {
    cli::run_with(NAME, &args.run, |setup| open(args, setup))
}

fn open(
    args: &HelloTriangleArgs,
    setup: &mut SampleSetup<'_>,
) -> Result<ReadySample<HelloTriangle>, RunError> {
    let context = setup.device(&DeviceNeeds::default())?;
    let sample = HelloTriangle::new(&context, args.run.extent())?;
    let summary = summary(context.capabilities(), "a turning triangle");
    Ok(ReadySample { sample, summary })
}
