//! The sample on the command line: pictures and timings out.

use std::process::ExitCode;

use super::{RtxHello, RtxHelloArgs};
use crate::app::device::DeviceNeeds;
use crate::app::run::{self, Opened, Opening};
use crate::app::run_error::RunError;
use crate::app::say;
use crate::rtx::{RtxConfig, headline};

/// What the sample and its pictures are called.
const NAME: &str = "rtx_hello";

/// Does what the command line says. Prints to standard output, errors in one line to standard error; the status
/// is 0 when the pictures were written, 1 for trouble with the device, 2 for wrong input, 130 after Ctrl-C.
#[must_use]
pub fn run(args: &RtxHelloArgs) -> ExitCode {
    match args.scene.listing("triangles", "a turning triangle and two rings of smaller ones") {
        Some(listing) => {
            say(&listing);
            ExitCode::SUCCESS
        }
        None => run::run(NAME, &args.run, |opening| open(args, opening)),
    }
}

fn open(args: &RtxHelloArgs, opening: &mut Opening<'_>) -> Result<Opened<RtxHello>, RunError> {
    let context = opening.device(&DeviceNeeds::tracing(args.tracing.rt))?;
    let capabilities = context.capabilities();
    let config = RtxConfig::of(args.tracing.rt, args.run.extent(), capabilities)?;
    let sample = RtxHello::new(&context, &config)?;
    let scene = format!("{} triangles, each an instance of the same one", sample.triangle_count());
    let headline = headline(capabilities, config.path, "a compute shader", &scene);
    Ok(Opened { sample, headline })
}
