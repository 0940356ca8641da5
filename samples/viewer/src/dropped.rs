//! A file that was dropped on the window: a thread loads it while the model from before is shown.

use std::path::{Path, PathBuf};

use lvk::Context;
use lvk_samples::app::cli::warn;
use lvk_samples::app::loading::LoadThread;
use lvk_samples::app::progress::Progress;
use lvk_samples::app::run_error::RunError;

use crate::light::Environment;
use crate::model::load;
use crate::viewer::{UploadedScene, ViewerScene};

/// What becomes of dropped files.
#[derive(Default)]
pub(crate) struct DroppedFile {
    /// Loads the last one.
    thread: Option<LoadThread<Result<UploadedScene, RunError>>>,
    /// Why the last one cannot be shown.
    error: Option<String>,
}

impl DroppedFile {
    /// Starts to load a file, in place of one that is still being loaded. `light`: what it is lit by, and the radius of the discs of
    /// its directional lights, in radians.
    pub(crate) fn load(
        &mut self,
        ctx: &Context,
        path: &Path,
        light: (&Environment, f32),
        texture_budget: Option<u64>,
    ) {
        // A thread from before ends first.
        (self.thread, self.error) = (None, None);
        let request = Request {
            ctx: ctx.clone(),
            path: path.to_owned(),
            environment: light.0.clone(),
            disc_radius: light.1,
            texture_budget,
        };
        match LoadThread::start(move |progress| request.load(progress)) {
            Ok(thread) => self.thread = Some(thread),
            Err(error) => self.error = Some(error.to_string()),
        }
    }

    /// Takes the scene of a file that is loaded. An error stays for the panel.
    pub(crate) fn take(&mut self) -> Option<UploadedScene> {
        let loaded = self.thread.as_mut()?.take()?;
        self.thread = None;
        match loaded {
            Ok(scene) => Some(scene),
            Err(error) => {
                let error = error.to_string();
                warn(std::slice::from_ref(&error));
                self.error = Some(error);
                None
            }
        }
    }

    /// Why the last file cannot be shown, if so.
    pub(crate) fn error(&self) -> Option<&str> {
        self.error.as_deref()
    }

    /// Lays out how far the load is.
    #[cfg(feature = "window")]
    pub(crate) fn show(&self, ui: &egui::Context) {
        if let Some(thread) = &self.thread {
            thread.show(ui);
        }
    }
}

/// What to load.
struct Request {
    ctx: Context,
    path: PathBuf,
    environment: Environment,
    disc_radius: f32,
    texture_budget: Option<u64>,
}

impl Request {
    fn load(self, progress: &mut Progress) -> Result<UploadedScene, RunError> {
        let model = load(&self.path, progress).map_err(RunError::input)?;
        progress.go_on()?;
        progress.stage("uploading the model and building acceleration structures", 0);
        warn(&model.warnings.iter().map(ToString::to_string).collect::<Vec<_>>());
        let Self { ctx, path, environment, disc_radius, texture_budget } = self;
        let scene = ViewerScene { name: lvk::readable_name(&path), model, environment, disc_radius };
        let scene = UploadedScene::new(&ctx, scene, texture_budget)?;
        warn(scene.warnings());
        Ok(scene)
    }
}
