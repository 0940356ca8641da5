//! The sample on the command line: scene in, pictures and timings out.

use std::process::ExitCode;

use super::{DrawPath, Sponza, SponzaArgs};
use crate::app::cli::{self, ReadySample, SampleSetup};
use crate::app::device::DeviceNeeds;
use crate::app::print_line;
use crate::app::run_error::RunError;
use crate::hybrid::{fit_textures, textures_needed};
use crate::raster::summary;
use crate::scene::Scene;

/// What the sample and its pictures are called.
const NAME: &str = "sponza";

/// Does what the command line says. Prints to standard output, errors in one line to standard error; the status
/// is 0 when the pictures were written, 1 for trouble with the device, 2 for wrong input, 130 after Ctrl-C.
#[must_use]
pub fn run(args: &SponzaArgs) -> ExitCode {
    match args.scene.list.listing() {
        Some(listing) => {
            let others = listing.replace("; the default", "");
            print_line(&format!("atrium  built in: a columned atrium made by code; the default\n{others}"));
            ExitCode::SUCCESS
        }
        None => cli::run_with(NAME, &args.run, |setup| open(args, setup)),
    }
}

fn open(args: &SponzaArgs, setup: &mut SampleSetup<'_>) -> Result<ReadySample<Sponza>, RunError> {
    args.scene.check_out(&args.run.out_or(NAME))?;
    let mut scene = load(args, setup)?;
    setup.warn(&scene.warnings);
    let context =
        setup.device(&DeviceNeeds { textures: textures_needed(&scene), ..DeviceNeeds::default() })?;
    let capabilities = context.capabilities();
    setup.warn(&fit_textures(&mut scene, &capabilities.limits)?);
    setup.progress.stage("uploading the scene", 0);
    let (triangles, textures, maps) = (scene.triangles.len(), scene.textures.len(), scene.normal_maps.len());
    let told = format!("{}: {triangles} triangles, {textures} textures, {maps} normal maps", scene.name);
    let cameras = Scene { cameras: scene.cameras, ..Scene::empty() };
    let sample = Sponza::new(&context, scene, &args.config())?;
    let sample = sample.from_camera(&cameras, args.scene.camera.index());
    let path = match sample.draw_path() {
        DrawPath::Counted => "as many as the GPU has counted",
        DrawPath::Padded => "those that are culled without vertices",
    };
    let draws =
        format!("draws     {}, {path}; {} samples a pixel", sample.draws().len(), sample.config().samples);
    let summary = format!("{}\n{draws}", summary(capabilities, &told));
    Ok(ReadySample { sample, summary })
}

fn load(args: &SponzaArgs, setup: &mut SampleSetup<'_>) -> Result<Scene, RunError> {
    if args.scene.scene.is_some() {
        return Ok(match args.no_normal_maps {
            true => args.scene.load(&mut setup.progress)?,
            false => args.scene.load_with_normal_maps(&mut setup.progress)?,
        });
    }
    setup.progress.stage("making the atrium", 0);
    Ok(Scene::atrium())
}
