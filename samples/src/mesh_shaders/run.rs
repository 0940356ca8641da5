//! The sample on the command line: pictures and timings out.

use std::process::ExitCode;

use super::{MeshShaders, MeshShadersArgs};
use crate::app::cli::{self, ReadySample, SampleSetup};
use crate::app::device::DeviceNeeds;
use crate::app::run_error::RunError;
use crate::raster::summary;

/// What the sample and its pictures are called.
const NAME: &str = "mesh_shaders";

/// Does what the command line says. Prints to standard output, errors in one line to standard error; the status
/// is 0 when the pictures were written, 1 for trouble with the device, 2 for wrong input, 130 after Ctrl-C.
#[must_use]
pub fn run(args: &MeshShadersArgs) -> ExitCode {
    cli::run_with(NAME, &args.run, |setup| open(args, setup))
}

fn open(args: &MeshShadersArgs, setup: &mut SampleSetup<'_>) -> Result<ReadySample<MeshShaders>, RunError> {
    let context = setup.device(&DeviceNeeds::default())?;
    let sample = MeshShaders::new(&context, args.run.extent(), !args.no_culling)?;
    let meshlets = sample.meshlets();
    let (count, triangles) = (meshlets.meshlets.len(), meshlets.triangles.len());
    let scene = format!("a knot of {triangles} triangles in {count} meshlets");
    Ok(ReadySample { summary: summary(context.capabilities(), &scene), sample })
}
