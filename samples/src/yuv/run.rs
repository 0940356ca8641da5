//! The sample on the command line: pictures and timings out.

use std::process::ExitCode;

use super::{CONVERSIONS, Yuv, YuvArgs};
use crate::app::cli::{self, ReadySample, SampleSetup};
use crate::app::device::DeviceNeeds;
use crate::app::run_error::RunError;
use crate::raster::summary;

/// What the sample and its pictures are called.
const NAME: &str = "yuv";

/// Does what the command line says. Prints to standard output, errors in one line to standard error; the status
/// is 0 when the pictures were written, 1 for trouble with the device, 2 for wrong input, 130 after Ctrl-C.
#[must_use]
pub fn run(args: &YuvArgs) -> ExitCode {
    cli::run_with(NAME, &args.run, |setup| open(args, setup))
}

fn open(args: &YuvArgs, setup: &mut SampleSetup<'_>) -> Result<ReadySample<Yuv>, RunError> {
    let context = setup.device(&DeviceNeeds { yuv: &CONVERSIONS, ..DeviceNeeds::default() })?;
    let config = args.config();
    let sample = Yuv::new(&context, &config)?;
    let (format, [width, height]) = (sample.format(), config.film);
    let (model, range, all) = (config.model, config.range, sample.formats());
    let scene = format!(
        "a moving picture of {width}x{height} as {format:?}, {model:?}, {range:?} range; the device has {all:?}"
    );
    Ok(ReadySample { summary: summary(context.capabilities(), &scene), sample })
}
