//! The sample on the command line: pictures and timings out.

use std::process::ExitCode;

use super::{Faces, RenderToCubeMap, RenderToCubeMapArgs, RenderToCubeMapConfig};
use crate::app::cli::{self, ReadySample, SampleSetup};
use crate::app::device::DeviceNeeds;
use crate::app::run_error::RunError;
use crate::raster::summary;

/// What the sample and its pictures are called.
const NAME: &str = "render_to_cube_map";

/// Does what the command line says. Prints to standard output, errors in one line to standard error; the status
/// is 0 when the pictures were written, 1 for trouble with the device, 2 for wrong input, 130 after Ctrl-C.
#[must_use]
pub fn run(args: &RenderToCubeMapArgs) -> ExitCode {
    cli::run_with(NAME, &args.run, |setup| open(args, setup))
}

fn open(
    args: &RenderToCubeMapArgs,
    setup: &mut SampleSetup<'_>,
) -> Result<ReadySample<RenderToCubeMap>, RunError> {
    let context = setup.device(&DeviceNeeds::default())?;
    let faces = Faces::from_args(args.faces, context.capabilities());
    let config = RenderToCubeMapConfig {
        face_size: args.face_size,
        roughness: args.roughness,
        ..RenderToCubeMapConfig::new(args.run.extent(), faces)
    };
    let sample = RenderToCubeMap::new(&context, &config)?;
    let by = match faces {
        Faces::SixPasses => "six passes",
        Faces::OnePass => "one pass of six views",
    };
    let (count, size) = (sample.blocks().len() - 1, config.face_size);
    let scene =
        format!("{count} blocks around a drop; a cube map of 6 x {size} x {size} pixels, drawn in {by}");
    Ok(ReadySample { summary: summary(context.capabilities(), &scene), sample })
}
