//! Loading of the sample: files or code, the world, the arrays and structures on the device.

use std::path::PathBuf;

use lvk::{Context, Limits};

use super::info::Layout;
use super::{LargeScene, LargeSceneArgs, LargeSceneConfig, World};
use crate::app::cli::{ReadySample, warn};
use crate::app::progress::Progress;
use crate::app::run_error::RunError;
use crate::hybrid::fit_textures;
use crate::rtx::RtxConfig;
use crate::scene::{ObjOptions, Scene};

/// The parameters of loading, on any thread.
pub(super) struct Load {
    pub(super) args: LargeSceneArgs,
    /// Width and height of the images in pixels.
    pub(super) extent: [u32; 2],
    /// The OBJ files that stand along the streets; none for the valley.
    pub(super) files: Vec<PathBuf>,
    /// Folder of built structures.
    pub(super) cache: Option<PathBuf>,
}

impl Load {
    /// The world that the command line asks for.
    pub(super) fn world(&self, progress: &mut Progress) -> Result<World, RunError> {
        let args = &self.args;
        let world = match &self.files[..] {
            [] => World::valley(args.triangles, args.trees(), progress)?,
            files => {
                let options = ObjOptions::default();
                let scenes = files.iter().map(|file| Scene::from_obj(file, &options, progress));
                World::street(scenes.collect::<Result<_, _>>()?, args.copies_of_scenes())?
            }
        };
        progress.go_on()?;
        let world = match args.layout {
            Layout::Instanced => world,
            Layout::Combined => {
                progress.stage("combining the instances", 0);
                world.combined()?
            }
        };
        progress.pause();
        warn(&world.scene().warnings);
        Ok(world)
    }

    /// The sample on a device that has room for so many textures.
    pub(super) fn sample(
        &self,
        ctx: &Context,
        mut world: World,
        textures: u32,
        progress: &mut Progress,
    ) -> Result<ReadySample<LargeScene>, RunError> {
        let (args, capabilities) = (&self.args, ctx.capabilities());
        let room = capabilities.limits.max_bindless_textures.min(textures);
        let limits = Limits { max_bindless_textures: room, ..capabilities.limits };
        let warnings = fit_textures(world.scene_mut(), &limits)?;
        if !warnings.is_empty() {
            progress.pause();
            warn(&warnings);
        }
        let config = LargeSceneConfig {
            depth: args.depth,
            samples: args.samples,
            show: args.show,
            compact: !args.no_compaction,
            cache: self.cache.clone(),
            ..LargeSceneConfig::new(RtxConfig::from_args(args.tracing.rt, self.extent, capabilities)?)
        };
        let sample = LargeScene::new(ctx, &world, &config, progress)?;
        let sample = sample.from_camera(&world, args.camera.index());
        progress.pause();
        let text = format!("{}, {} textures", world.name(), world.scene().textures.len());
        let text = format!("{text}\n{}", sample.figures());
        Ok(ReadySample::ray_traced(sample, config.rtx.path, "a compute shader", &text))
    }
}
