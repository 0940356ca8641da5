//! The sample on the command line: scenes in, pictures, timings and figures out.

use std::path::PathBuf;
use std::process::ExitCode;

use super::args::Layout;
use super::{LargeScene, LargeSceneArgs, LargeSceneConfig, LargeSceneError, World};
use crate::app::device::DeviceNeeds;
use crate::app::progress::Progress;
use crate::app::run::{self, Opened, Opening};
use crate::app::run_error::RunError;
use crate::app::{png, say, scene_list};
use crate::hybrid::{fit_textures, textures_needed};
use crate::rtx::{RtxConfig, headline};
use crate::scene::{ObjOptions, Scene};

/// What the sample and its pictures are called.
const NAME: &str = "large_scene";

/// Does what the command line says. Prints to standard output, errors in one line to standard error; the status
/// is 0 when the pictures were written, 1 for trouble with the device, 2 for wrong input, 130 after Ctrl-C.
#[must_use]
pub fn run(args: &LargeSceneArgs) -> ExitCode {
    match args.list.listing() {
        Some(listing) => {
            let others = listing.split_once('\n').map_or("", |(_, others)| others);
            say(&format!("valley  built in: a wooded valley made by code; the default\n{others}"));
            ExitCode::SUCCESS
        }
        None => run::run(NAME, &args.run, |opening| open(args, opening)),
    }
}

fn open(args: &LargeSceneArgs, opening: &mut Opening<'_>) -> Result<Opened<LargeScene>, RunError> {
    let mut world = world(args, opening)?;
    opening.warn(&world.scene().warnings.clone());
    let tracing = DeviceNeeds::tracing(args.tracing.rt);
    let context = opening.device(&DeviceNeeds { textures: textures_needed(world.scene()), ..tracing })?;
    let capabilities = context.capabilities();
    opening.warn(&fit_textures(world.scene_mut(), &capabilities.limits)?);
    let config = LargeSceneConfig {
        depth: args.depth,
        samples: args.samples,
        show: args.show,
        compact: !args.no_compaction,
        cache: opening.structure_cache(),
        ..LargeSceneConfig::new(RtxConfig::of(args.tracing.rt, args.run.extent(), capabilities)?)
    };
    let sample = LargeScene::new(&context, &world, &config, &mut opening.progress)?;
    let sample = sample.from_camera(&world, args.camera.place());
    opening.progress.pause();
    let told = format!("{}, {} textures", world.name(), world.scene().textures.len());
    let headline = headline(capabilities, config.rtx.path, "a compute shader", &told);
    let headline = format!("{headline}\n{}", sample.figures());
    Ok(Opened { sample, headline })
}

/// The world that the command line asks for.
fn world(args: &LargeSceneArgs, opening: &mut Opening<'_>) -> Result<World, RunError> {
    let files = files(args)?;
    let out = args.run.out_or(NAME);
    files.iter().try_for_each(|file| png::check_not_input(&out, "--scene", file))?;
    let world = match &files[..] {
        [] => {
            opening.progress.stage("making the valley", 0);
            World::valley(args.triangles, args.trees())
        }
        files => World::street(load(files, &mut opening.progress)?, args.copies_of_scenes())?,
    };
    Ok(match args.layout {
        Layout::Instanced => world,
        Layout::Combined => world.combined()?,
    })
}

fn load(files: &[PathBuf], progress: &mut Progress) -> Result<Vec<Scene>, RunError> {
    let options = ObjOptions::default();
    Ok(files.iter().map(|file| Scene::from_obj(file, &options, progress)).collect::<Result<_, _>>()?)
}

/// The OBJ files that are named, by themselves or by their folder.
fn files(args: &LargeSceneArgs) -> Result<Vec<PathBuf>, LargeSceneError> {
    let folder = scene_list::folder();
    let mut files: Vec<_> =
        args.scenes.iter().map(|wish| scene_list::resolve(wish, folder.as_deref())).collect();
    if let Some(named) = args.archive_folder() {
        let named = (!named.as_os_str().is_empty()).then(|| named.to_owned());
        let folder = named.or(folder).ok_or(LargeSceneError::NoFolder)?;
        let found = scene_list::find(&folder);
        if found.is_empty() {
            return Err(LargeSceneError::EmptyFolder { folder });
        }
        files.extend(found.into_iter().map(|scene| scene.path));
    }
    Ok(files)
}
