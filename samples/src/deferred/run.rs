//! The sample on the command line: pictures and timings out.

use std::process::ExitCode;

use super::{Deferred, DeferredArgs, Passes};
use crate::app::cli::{self, ReadySample, SampleSetup};
use crate::app::device::DeviceNeeds;
use crate::app::run_error::RunError;
use crate::raster::summary;

/// What the sample and its pictures are called.
const NAME: &str = "deferred";

/// Does what the command line says. Prints to standard output, errors in one line to standard error; the status
/// is 0 when the pictures were written, 1 for trouble with the device, 2 for wrong input, 130 after Ctrl-C.
#[must_use]
pub fn run(args: &DeferredArgs) -> ExitCode {
    cli::run_with(NAME, &args.run, |setup| open(args, setup))
}

fn open(args: &DeferredArgs, setup: &mut SampleSetup<'_>) -> Result<ReadySample<Deferred>, RunError> {
    let context = setup.device(&DeviceNeeds::default())?;
    let sample = Deferred::new(&context, &args.config())?;
    let passes = match sample.passes() {
        Passes::One => "one pass reads its own targets",
        Passes::Several => "passes read what those before have drawn",
    };
    let scene = format!("{} lights, {} triangles; {passes}", args.lights, sample.triangle_count());
    Ok(ReadySample { summary: summary(context.capabilities(), &scene), sample })
}
