//! The description of the sample's program: scenes in, images, timings and figures out.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};

use super::load::Load;
use super::pipelines::RAYS;
use super::{LargeScene, LargeSceneConfig, Show};
use crate::app::loading::Loading;
use crate::app::progress::Progress;
use crate::app::ray_args::RayArgs;
use crate::app::sample_error::SampleError;
use crate::app::sample_info::prelude::*;
use crate::app::scene_args::{CameraArgs, ListArgs};
use crate::app::value_parsers::whole;
use crate::app::{png, scene_list};

/// Descriptor slots of textures in a window, whose device is opened before the scene is known.
const WINDOW_TEXTURES: u32 = 1 << 16;

/// Arguments of the sample.
#[derive(Debug, Clone, PartialEq, Args)]
pub struct LargeSceneArgs {
    /// Wavefront OBJ to show, or the name of one in the folder of LVK_SCENES; several stand along streets
    #[arg(long = "scene", value_name = "FILE|NAME", help_heading = "Scene")]
    pub scenes: Vec<PathBuf>,

    /// Show every OBJ in this folder and the folders in it, three levels deep [default: the folder of LVK_SCENES]
    #[arg(long, value_name = "FOLDER", num_args = 0..=1, default_missing_value = "")]
    #[arg(value_parser = clap::value_parser!(OsString), help_heading = "Scene")]
    pub archive: Option<OsString>,

    /// Instances of each OBJ, or trees of the valley [default: 4 of each OBJ, 600 trees]
    #[arg(long, value_name = "N", value_parser = whole(1..=1_000_000), help_heading = "Scene")]
    pub copies: Option<u32>,

    /// Triangles of the valley's ground and kinds of trees, each counted once
    #[arg(long, value_name = "N", default_value_t = 2_000_000, value_parser = whole(1_000..=100_000_000))]
    #[arg(help_heading = "Scene")]
    pub triangles: u32,

    /// Layout of objects that occur more than once
    #[arg(long, value_enum, default_value_t = Layout::Instanced, help_heading = "Scene")]
    pub layout: Layout,

    /// The camera
    #[command(flatten)]
    pub camera: CameraArgs,

    /// List of the scenes that have a name
    #[command(flatten)]
    pub list: ListArgs,

    /// Quantity that the image shows
    #[arg(long, value_enum, default_value_t = Show::Picture, help_heading = "Rendering")]
    pub show: Show,

    /// Maximum number of reflections and refractions of a ray, 0 to 16
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = whole(0..=LargeSceneConfig::MAX_DEPTH))]
    #[arg(help_heading = "Rendering")]
    pub depth: u32,

    /// Samples per pixel, 1 to 256, averaged for antialiasing
    #[arg(long, value_name = "N", default_value_t = 4)]
    #[arg(value_parser = whole(1..=LargeSceneConfig::MAX_SAMPLES), help_heading = "Rendering")]
    pub samples: u32,

    /// Leave acceleration structures as large as they are built
    #[arg(long, help_heading = "Rendering")]
    pub no_compaction: bool,

    /// The ray tracing path
    #[command(flatten)]
    pub tracing: RayArgs,
}

/// The layout of scenes that are shown more than once.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Layout {
    /// One structure of each original, and instances of it.
    Instanced,
    /// Every triangle where it is seen, in one mesh.
    Combined,
}

impl LargeSceneArgs {
    /// Instances of each OBJ.
    pub(super) fn copies_of_scenes(&self) -> u32 {
        self.copies.unwrap_or(4)
    }

    /// Trees of the valley.
    pub(super) fn trees(&self) -> u32 {
        self.copies.unwrap_or(600)
    }

    /// The folder behind `--archive`, if that was given; empty for that of the environment.
    pub(super) fn archive_folder(&self) -> Option<&Path> {
        self.archive.as_deref().map(Path::new)
    }
}

impl SampleInfo for LargeScene {
    const NAME: &'static str = "large_scene";
    const ABOUT: &'static str = "Renders millions of triangles by rays, and writes pictures as PNG";
    const DETAILS: &'static str = "\
Without --scene and --archive the sample renders a generated wooded valley. The folder of caches keeps split and compacted \
structures, so that the next start builds none.";
    const EXAMPLES: &'static str = "
        | the valley: two million triangles, 180 million with all trees
        --triangles 20000000 --copies 5000 | a larger valley
        --layout combined --copies 20 | every tree's triangles in one mesh
        --archive dir | all OBJ files below dir, four of each, along streets
        --scene kitchen --scene bunny.obj | two OBJ files
        --profile mali-g715 | emulates a phone: ray queries, meshes split into many parts
        --show instances --window | a colour for each instance, in a window
    ";
    const ROUND: &'static str = "";
    type Args = LargeSceneArgs;
    type Sample = Loading<Self>;

    fn pipelines() -> Vec<SamplePipeline> {
        RAYS.pipelines()
    }

    fn listing(args: &LargeSceneArgs) -> Option<String> {
        let listing = args.list.listing()?;
        let others = listing.split_once('\n').map_or("", |(_, others)| others);
        Some(format!("valley  built in: a wooded valley made by code; the default\n{others}"))
    }

    fn open(
        args: &LargeSceneArgs,
        setup: &mut SampleSetup<'_>,
    ) -> Result<ReadySample<Loading<Self>>, RunError> {
        let files = files(args, &setup.args.out_or(Self::NAME))?;
        let (extent, cache) = (setup.extent(), setup.structure_cache());
        let load = Load { args: args.clone(), extent, files, cache };
        if setup.is_for_window() { in_background(load, setup) } else { at_once(&load, setup) }
    }
}

/// A window is there before the world: a thread loads that while frames show how far it is.
fn in_background(
    load: Load,
    setup: &mut SampleSetup<'_>,
) -> Result<ReadySample<Loading<LargeScene>>, RunError> {
    let tracing = DeviceNeeds::tracing(load.args.tracing.rt);
    let context = setup.device(&DeviceNeeds { textures: WINDOW_TEXTURES, ..tracing })?;
    setup.progress.pause();
    let ctx = context.clone();
    let sample = Loading::start(&context, move |progress| {
        let world = load.world(progress)?;
        load.sample(&ctx, world, WINDOW_TEXTURES, progress)
    })?;
    Ok(ReadySample { sample, summary: String::new() })
}

/// The device is opened when it is known how many textures it is to have room for.
fn at_once(load: &Load, setup: &mut SampleSetup<'_>) -> Result<ReadySample<Loading<LargeScene>>, RunError> {
    setup.progress = Progress::with_log_lines();
    let world = load.world(&mut setup.progress)?;
    let textures = world.textures_needed();
    let tracing = DeviceNeeds::tracing(load.args.tracing.rt);
    let context = setup.device(&DeviceNeeds { textures, ..tracing })?;
    let ReadySample { sample, summary } = load.sample(&context, world, textures, &mut setup.progress)?;
    Ok(ReadySample { sample: Loading::ready(sample), summary })
}

/// The OBJ files that are named, by themselves or by their folder.
fn files(args: &LargeSceneArgs, out: &Path) -> Result<Vec<PathBuf>, RunError> {
    let folder = scene_list::folder();
    let mut files: Vec<_> =
        args.scenes.iter().map(|wish| scene_list::resolve(wish, folder.as_deref())).collect();
    if let Some(named) = args.archive_folder() {
        let named = (!named.as_os_str().is_empty()).then(|| named.to_owned());
        let folder = named.or(folder).ok_or(SampleError::NoFolder)?;
        let found = scene_list::find(&folder);
        if found.is_empty() {
            return Err(SampleError::EmptyFolder { folder }.into());
        }
        files.extend(found.into_iter().map(|scene| scene.path));
    }
    files.iter().try_for_each(|file| png::check_not_input(out, "--scene", file))?;
    Ok(files)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::cli::{assert_refuses, parse_line};

    #[test]
    fn values_out_of_range_are_refused() {
        assert_refuses::<LargeScene>(&[
            "--copies 0",
            "--triangles 999",
            "--samples 0",
            "--depth 17",
            "--camera 6",
            "--layout heap",
            "--show x",
            "x",
        ]);
    }

    #[test]
    fn scenes_add_up_and_copies_have_defaults() {
        let parsed = |line| parse_line::<LargeScene>(line).unwrap().sample;
        let args = parsed("--scene a.obj --scene b --archive");
        assert_eq!(args.scenes, [Path::new("a.obj"), Path::new("b")]);
        assert_eq!(args.archive_folder(), Some(Path::new("")));
        assert_eq!((args.copies_of_scenes(), args.trees()), (4, 600));
        assert_eq!(parsed("--copies 9").trees(), 9);
    }
}
