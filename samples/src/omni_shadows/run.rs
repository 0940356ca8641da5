//! The sample on the command line: pictures and timings out.

use std::process::ExitCode;

use super::{OmniShadows, OmniShadowsArgs};
use crate::app::cli::{self, ReadySample, SampleSetup};
use crate::app::device::DeviceNeeds;
use crate::app::run_error::RunError;
use crate::raster::summary;

/// What the sample and its pictures are called.
const NAME: &str = "omni_shadows";

/// Does what the command line says. Prints to standard output, errors in one line to standard error; the status
/// is 0 when the pictures were written, 1 for trouble with the device, 2 for wrong input, 130 after Ctrl-C.
#[must_use]
pub fn run(args: &OmniShadowsArgs) -> ExitCode {
    cli::run_with(NAME, &args.run, |setup| open(args, setup))
}

fn open(args: &OmniShadowsArgs, setup: &mut SampleSetup<'_>) -> Result<ReadySample<OmniShadows>, RunError> {
    let context = setup.device(&DeviceNeeds::default())?;
    let sample = OmniShadows::new(&context, &args.config())?;
    let passes = if sample.is_multiview() { "in one pass by multiview" } else { "in six passes" };
    let (triangles, size) = (sample.triangle_count(), args.shadow_size);
    let scene =
        format!("a lamp in a lattice: {triangles} triangles; shadows in a cube of {size} texels {passes}");
    Ok(ReadySample { summary: summary(context.capabilities(), &scene), sample })
}
