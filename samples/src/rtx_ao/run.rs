//! The sample on the command line: scene in, pictures and timings out.

use std::process::ExitCode;

use super::{RtxAo, RtxAoArgs, RtxAoConfig};
use crate::app::cli::{self, ReadySample, SampleSetup};
use crate::app::device::DeviceNeeds;
use crate::app::print_line;
use crate::app::run_error::RunError;
use crate::rtx::{RtxConfig, summary};
use crate::scene::Scene;

/// What the sample and its pictures are called.
const NAME: &str = "rtx_ao";
/// How far surroundings darken in the town, whose ground goes on far beyond its houses.
const TOWN_RADIUS: f32 = 1.8;

/// Does what the command line says. Prints to standard output, errors in one line to standard error; the status
/// is 0 when the pictures were written, 1 for trouble with the device, 2 for wrong input, 130 after Ctrl-C.
#[must_use]
pub fn run(args: &RtxAoArgs) -> ExitCode {
    match args.scene.list.listing() {
        Some(listing) => {
            let others = listing.replace("; the default", "");
            print_line(&format!("town  built in: paper houses around a carousel; the default\n{others}"));
            ExitCode::SUCCESS
        }
        None => cli::run_with(NAME, &args.run, |setup| open(args, setup)),
    }
}

fn open(args: &RtxAoArgs, setup: &mut SampleSetup<'_>) -> Result<ReadySample<RtxAo>, RunError> {
    args.scene.check_out(&args.run.out_or(NAME))?;
    let (scene, turning) = load(args, setup)?;
    setup.warn(&scene.warnings);
    let textures = scene.textures.len() as u32 + 16;
    let needs = DeviceNeeds { textures, ..DeviceNeeds::tracing(args.tracing.rt) };
    let context = setup.device(&needs)?;
    let capabilities = context.capabilities();
    let radius = args.radius.or(turning.is_some().then_some(TOWN_RADIUS));
    let (passes, rays) = (args.passes, args.rays);
    let config = RtxAoConfig {
        rtx: RtxConfig::from_args(args.tracing.rt, args.run.extent(), capabilities)?,
        passes,
        rays,
        radius,
    };
    setup.progress.stage("uploading the scene and building acceleration structures", 0);
    let sample = RtxAo::new(&context, &scene, turning.as_ref(), &config)?;
    let sample = sample.from_camera(&scene, args.scene.camera.index());
    let (name, count, radius) = (&scene.name, sample.triangle_count(), sample.radius());
    let told =
        format!("{name}: {count} triangles; {passes} passes a frame, {rays} rays within {radius:.2} units");
    let summary = summary(capabilities, config.rtx.path, "a fragment shader", &told);
    Ok(ReadySample { sample, summary })
}

/// The scene, and what turns in it.
fn load(args: &RtxAoArgs, setup: &mut SampleSetup<'_>) -> Result<(Scene, Option<Scene>), RunError> {
    if args.scene.scene.as_deref().is_none_or(|name| name.as_os_str() == "town") {
        return Ok((Scene::town(), Some(Scene::carousel())));
    }
    Ok((args.scene.load(&mut setup.progress)?, None))
}
