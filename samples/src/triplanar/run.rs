//! The sample on the command line: pictures and timings out.

use std::process::ExitCode;

use super::{Triplanar, TriplanarArgs};
use crate::app::cli::{self, ReadySample, SampleSetup};
use crate::app::device::DeviceNeeds;
use crate::app::run_error::RunError;
use crate::raster::summary;

/// What the sample and its pictures are called.
const NAME: &str = "triplanar";

/// Does what the command line says. Prints to standard output, errors in one line to standard error; the status
/// is 0 when the pictures were written, 1 for trouble with the device, 2 for wrong input, 130 after Ctrl-C.
#[must_use]
pub fn run(args: &TriplanarArgs) -> ExitCode {
    cli::run_with(NAME, &args.run, |setup| open(args, setup))
}

fn open(args: &TriplanarArgs, setup: &mut SampleSetup<'_>) -> Result<ReadySample<Triplanar>, RunError> {
    let context = setup.device(&DeviceNeeds::default())?;
    setup.progress.stage("painting textures", 0);
    let mut sample = Triplanar::new(&context, args.run.extent())?;
    args.unloaded().for_each(|number| sample.unload(number));
    let count = Triplanar::texture_names().len();
    let scene = format!(
        "bodies without texture coordinates; {count} textures, {} of them unloaded",
        args.unload.len()
    );
    Ok(ReadySample { summary: summary(context.capabilities(), &scene), sample })
}
