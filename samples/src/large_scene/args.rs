//! The command line of the `large_scene` sample.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use clap::{Parser, ValueEnum};

use super::{LargeSceneConfig, Show};
use crate::app::ray_args::RayArgs;
use crate::app::run_args::RunArgs;
use crate::app::scene_args::{CameraArgs, ListArgs};

/// Renders millions of triangles by rays, and writes pictures as PNG.
///
/// Without --scene and --archive it shows a wooded valley made by code. Split and compacted structures are kept in the folder
/// of caches, so that the next start builds none.
#[derive(Debug, Clone, PartialEq, Parser)]
#[command(name = "large_scene", version, after_help = EXAMPLES)]
pub struct LargeSceneArgs {
    /// Wavefront OBJ to show, or the name of one in the folder of LVK_SCENES; several stand along streets
    #[arg(long = "scene", value_name = "FILE|NAME", help_heading = "Scene")]
    pub scenes: Vec<PathBuf>,

    /// Show every OBJ in this folder and the folders in it, three levels deep [default: the folder of LVK_SCENES]
    #[arg(
        long,
        value_name = "FOLDER",
        num_args = 0..=1,
        default_missing_value = "",
        value_parser = clap::value_parser!(OsString),
        help_heading = "Scene"
    )]
    pub archive: Option<OsString>,

    /// Instances of each OBJ, or trees of the valley [default: 4 of each OBJ, 600 trees]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000), help_heading = "Scene")]
    pub copies: Option<u32>,

    /// Triangles of the valley's ground and kinds of trees, before any is repeated
    #[arg(
        long,
        value_name = "N",
        default_value_t = 2_000_000,
        value_parser = clap::value_parser!(u32).range(1_000..=100_000_000),
        help_heading = "Scene"
    )]
    pub triangles: u32,

    /// What becomes of what is shown more than once
    #[arg(long, value_enum, default_value_t = Layout::Instanced, help_heading = "Scene")]
    pub layout: Layout,

    /// From where it is seen
    #[command(flatten)]
    pub camera: CameraArgs,

    /// What is known by name
    #[command(flatten)]
    pub list: ListArgs,

    /// What pixels show
    #[arg(long, value_enum, default_value_t = Show::Picture, help_heading = "Rendering")]
    pub show: Show,

    /// How often a ray may be mirrored or bent, 0 to 16
    #[arg(
        long,
        value_name = "N",
        default_value_t = 3,
        value_parser = clap::value_parser!(u32).range(0..=i64::from(LargeSceneConfig::MAX_DEPTH)),
        help_heading = "Rendering"
    )]
    pub depth: u32,

    /// Rays of each pixel, 1 to 256, whose average smooths edges
    #[arg(
        long,
        value_name = "N",
        default_value_t = 4,
        value_parser = clap::value_parser!(u32).range(1..=i64::from(LargeSceneConfig::MAX_SAMPLES)),
        help_heading = "Rendering"
    )]
    pub samples: u32,

    /// Leave acceleration structures as large as they are built
    #[arg(long, help_heading = "Rendering")]
    pub no_compaction: bool,

    /// By what rays are traced
    #[command(flatten)]
    pub tracing: RayArgs,

    /// Frames, pictures and device
    #[command(flatten)]
    pub run: RunArgs,
}

/// What becomes of what is shown more than once.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Layout {
    /// One structure of each original, and instances of it.
    Instanced,
    /// Every triangle where it is seen, in one mesh.
    Combined,
}

const EXAMPLES: &str = "\
Examples:
  large_scene                                             the valley: two million triangles, 180 million with all trees
  large_scene --triangles 20000000 --copies 5000          a larger one
  large_scene --layout combined --copies 20               every tree's triangles in one mesh
  large_scene --archive dir                               all OBJ files below dir, four of each, along streets
  large_scene --scene kitchen --scene bunny.obj           two of them
  large_scene --profile mali-g715                         as on a phone: ray queries, meshes split into many parts
  large_scene --show instances --window                   which instance is where, in a window

Exit status: 0 when the pictures were written, 1 for trouble with the device, 2 for wrong arguments, 130 after Ctrl-C.";

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

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    fn parsed(line: &str) -> Result<LargeSceneArgs, clap::Error> {
        LargeSceneArgs::try_parse_from(std::iter::once("large_scene").chain(line.split_whitespace()))
    }

    #[test]
    fn the_definition_is_sound_and_values_out_of_range_are_refused() {
        LargeSceneArgs::command().debug_assert();
        for line in [
            "--copies 0",
            "--triangles 999",
            "--samples 0",
            "--depth 17",
            "--camera 6",
            "--layout heap",
            "--show x",
            "x",
        ] {
            assert_eq!(parsed(line).unwrap_err().exit_code(), 2, "{line}");
        }
    }

    #[test]
    fn scenes_add_up_and_numbers_follow_what_is_shown() {
        let args = parsed("--scene a.obj --scene b --archive").unwrap();
        assert_eq!(args.scenes, [Path::new("a.obj"), Path::new("b")]);
        assert_eq!(args.archive_folder(), Some(Path::new("")));
        assert_eq!((args.copies_of_scenes(), args.trees()), (4, 600));
        assert_eq!(parsed("--copies 9").unwrap().trees(), 9);
    }
}
