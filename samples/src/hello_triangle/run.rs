//! The sample on the command line: pictures and timings out.

use std::process::ExitCode;

use super::{HelloTriangle, HelloTriangleArgs};
use crate::app::device::DeviceNeeds;
use crate::app::run::{self, Opened, Opening};
use crate::app::run_error::RunError;
use crate::raster::headline;

/// What the sample and its pictures are called.
const NAME: &str = "hello_triangle";

/// Does what the command line says. Prints to standard output, errors in one line to standard error; the status
/// is 0 when the pictures were written, 1 for trouble with the device, 2 for wrong input, 130 after Ctrl-C.
#[must_use]
pub fn run(args: &HelloTriangleArgs) -> ExitCode {
    run::run(NAME, &args.run, |opening| open(args, opening))
}

fn open(args: &HelloTriangleArgs, opening: &mut Opening<'_>) -> Result<Opened<HelloTriangle>, RunError> {
    let context = opening.device(&DeviceNeeds::default())?;
    let sample = HelloTriangle::new(&context, args.run.extent())?;
    let headline = headline(context.capabilities(), "a turning triangle");
    Ok(Opened { sample, headline })
}
