//! The part of the command line that samples with scenes share.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use clap::Args;

use super::png::{self, PngError};
use super::progress::Progress;
use super::ray_args::RayArgs;
use super::scene_list;
use super::value_parsers::positive;
use crate::scene::{ObjOptions, Scene, SceneError};

/// Arguments that select the scene and its camera.
#[derive(Debug, Clone, PartialEq, Args)]
pub struct SceneArgs {
    /// Wavefront OBJ to render, with its MTL and textures beside it, or a name in --list-scenes
    /// [default: the built-in scene]
    #[arg(long, value_name = "FILE|NAME", help_heading = "Scene")]
    pub scene: Option<PathBuf>,

    /// Factor from the file's units to scene units [default: 1, or the known scale of a benchmark scene]
    #[arg(long, value_name = "F", value_parser = positive, requires = "scene", help_heading = "Scene")]
    pub scale: Option<f32>,

    /// Lights and up to five cameras: lines `scene NAME x y z` with the lamp's place, then `sun x y z` towards the sun if
    /// it shines, and `at EYE TARGET FOV` or `dir EYE DIRECTION FOV`
    #[arg(long, value_name = "FILE", requires = "scene", help_heading = "Scene")]
    pub cameras: Option<PathBuf>,

    /// The camera
    #[command(flatten)]
    pub camera: CameraArgs,

    /// List of the scenes that have a name
    #[command(flatten)]
    pub list: ListArgs,
}

/// Arguments that select the camera of a scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Args)]
pub struct CameraArgs {
    /// Camera, one of the scene's five; a sequence starts there and passes through all five
    #[arg(long = "camera", value_name = "1-5", default_value_t = 1)]
    #[arg(value_parser = clap::value_parser!(u32).range(1..=5), help_heading = "Scene")]
    pub number: u32,
}

/// The option that lists scenes.
#[derive(Debug, Clone, PartialEq, Eq, Args)]
pub struct ListArgs {
    /// Print the scenes that --scene accepts by name, and exit; searches FOLDER, by default the folder in LVK_SCENES
    #[arg(long, value_name = "FOLDER", num_args = 0..=1, default_missing_value = "")]
    #[arg(value_parser = clap::value_parser!(OsString), help_heading = "Scene")]
    pub list_scenes: Option<OsString>,
}

impl SceneArgs {
    /// Loads the scene, or generates the courtyard.
    ///
    /// # Errors
    /// [`SceneError`].
    pub fn load(&self, progress: &mut Progress) -> Result<Scene, SceneError> {
        self.load_with(progress, false)
    }

    /// Loads the scene like [`load`](Self::load), with the normal maps of OBJ files.
    ///
    /// # Errors
    /// [`SceneError`].
    pub fn load_with_normal_maps(&self, progress: &mut Progress) -> Result<Scene, SceneError> {
        self.load_with(progress, true)
    }

    fn load_with(&self, progress: &mut Progress, normal_maps: bool) -> Result<Scene, SceneError> {
        match self.file() {
            None => {
                progress.stage("making the courtyard", 0);
                Ok(Scene::procedural())
            }
            Some(path) => {
                let options = ObjOptions { scale: self.scale, cameras: self.cameras.clone(), normal_maps };
                Scene::from_obj(&path, &options, progress)
            }
        }
    }

    /// Refuses a picture that would replace an input.
    ///
    /// # Errors
    /// [`PngError::IsInput`].
    pub fn check_out(&self, out: &Path) -> Result<(), PngError> {
        for (option, input) in [("--scene", self.file()), ("--cameras", self.cameras.clone())] {
            if let Some(input) = input {
                png::check_not_input(out, option, &input)?;
            }
        }
        Ok(())
    }

    fn file(&self) -> Option<PathBuf> {
        let wish = self.scene.as_ref()?;
        let file = scene_list::resolve(wish, scene_list::folder().as_deref());
        let is_built_in = file == Path::new(scene_list::BUILT_IN) && !file.exists();
        if is_built_in { None } else { Some(file) }
    }
}

impl CameraArgs {
    /// Returns the index of the camera among the scene's five, 0 to 4.
    #[must_use]
    pub fn index(&self) -> usize {
        self.number.clamp(1, 5) as usize - 1
    }
}

impl ListArgs {
    /// Returns the text of `--list-scenes`, if the option was given.
    #[must_use]
    pub fn listing(&self) -> Option<String> {
        self.list_scenes.as_ref().map(|folder| scene_list::listing(Some(Path::new(folder))))
    }

    /// Returns the text of `--list-scenes` after the line of the sample's default scene.
    pub(crate) fn listing_after(&self, default: &str) -> Option<String> {
        let others = self.listing()?.replace("; the default", "");
        Some(format!("{default}; the default\n{others}"))
    }
}

/// Arguments of samples that trace rays in one generated scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Args)]
pub struct BuiltInSceneRayArgs {
    /// The built-in scene
    #[command(flatten)]
    pub scene: BuiltInSceneArgs,

    /// The ray tracing path
    #[command(flatten)]
    pub tracing: RayArgs,
}

/// Arguments of samples that render one generated scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Args)]
pub struct BuiltInSceneArgs {
    /// Print the scene that the sample shows, and exit
    #[arg(long, help_heading = "Frames")]
    pub list_scenes: bool,
}

impl BuiltInSceneArgs {
    /// Returns the text of `--list-scenes`, if the option was given, for a scene that is called `name`.
    #[must_use]
    pub fn listing(&self, name: &str, what: &str) -> Option<String> {
        self.list_scenes.then(|| format!("{name}  built in: {what}; the only one"))
    }
}
