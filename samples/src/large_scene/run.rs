//! The sample on the command line: scenes in, pictures, timings and figures out.

use std::path::PathBuf;
use std::process::ExitCode;

use super::load::Load;
use super::{LargeScene, LargeSceneArgs, LargeSceneError};
use crate::app::cli::{self, ReadySample, SampleSetup};
use crate::app::device::DeviceNeeds;
use crate::app::loading::Loading;
use crate::app::progress::Progress;
use crate::app::run_error::RunError;
use crate::app::{png, print_line, scene_list};

/// What the sample and its pictures are called.
const NAME: &str = "large_scene";
/// Room for textures in a window, whose device is opened before anything is known of the scene.
const ROOM: u32 = 1 << 16;

/// Does what the command line says. Prints to standard output, progress and errors in lines to standard error; the status
/// is 0 when the pictures were written, 1 for trouble with the device, 2 for wrong input, 130 after Ctrl-C.
#[must_use]
pub fn run(args: &LargeSceneArgs) -> ExitCode {
    match args.list.listing() {
        Some(listing) => {
            let others = listing.split_once('\n').map_or("", |(_, others)| others);
            print_line(&format!("valley  built in: a wooded valley made by code; the default\n{others}"));
            ExitCode::SUCCESS
        }
        None => cli::run_with(NAME, &args.run, |setup| open(args, setup)),
    }
}

fn open(
    args: &LargeSceneArgs,
    setup: &mut SampleSetup<'_>,
) -> Result<ReadySample<Loading<LargeScene>>, RunError> {
    let load = Load { args: args.clone(), files: files(args)?, cache: setup.structure_cache() };
    if setup.is_for_window() { in_background(load, setup) } else { at_once(&load, setup) }
}

/// A window is there before the world: a thread loads that while frames show how far it is.
fn in_background(
    load: Load,
    setup: &mut SampleSetup<'_>,
) -> Result<ReadySample<Loading<LargeScene>>, RunError> {
    let tracing = DeviceNeeds::tracing(load.args.tracing.rt);
    let context = setup.device(&DeviceNeeds { textures: ROOM, ..tracing })?;
    setup.progress.pause();
    let ctx = context.clone();
    let sample = Loading::start(&context, move |progress| {
        let world = load.world(progress)?;
        load.sample(&ctx, world, ROOM, progress)
    })?;
    Ok(ReadySample { sample, summary: String::new() })
}

/// The device is opened when it is known how many textures it is to have room for.
fn at_once(load: &Load, setup: &mut SampleSetup<'_>) -> Result<ReadySample<Loading<LargeScene>>, RunError> {
    setup.progress = Progress::spoken();
    let world = load.world(&mut setup.progress)?;
    let textures = world.textures_needed();
    let tracing = DeviceNeeds::tracing(load.args.tracing.rt);
    let context = setup.device(&DeviceNeeds { textures, ..tracing })?;
    let ReadySample { sample, summary } = load.sample(&context, world, textures, &mut setup.progress)?;
    Ok(ReadySample { sample: Loading::ready(sample), summary })
}

/// The OBJ files that are named, by themselves or by their folder.
fn files(args: &LargeSceneArgs) -> Result<Vec<PathBuf>, RunError> {
    let folder = scene_list::folder();
    let mut files: Vec<_> =
        args.scenes.iter().map(|wish| scene_list::resolve(wish, folder.as_deref())).collect();
    if let Some(named) = args.archive_folder() {
        let named = (!named.as_os_str().is_empty()).then(|| named.to_owned());
        let folder = named.or(folder).ok_or(LargeSceneError::NoFolder)?;
        let found = scene_list::find(&folder);
        if found.is_empty() {
            return Err(LargeSceneError::EmptyFolder { folder }.into());
        }
        files.extend(found.into_iter().map(|scene| scene.path));
    }
    let out = args.run.out_or(NAME);
    files.iter().try_for_each(|file| png::check_not_input(&out, "--scene", file))?;
    Ok(files)
}
