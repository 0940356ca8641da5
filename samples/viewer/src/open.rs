//! Opens the model that the arguments name.

use std::time::{Duration, Instant};

use lvk::Context;
use lvk_gltf::Model;
use lvk_samples::app::cli::{ReadySample, warn};
use lvk_samples::app::progress::Progress;
use lvk_samples::app::run_error::RunError;
use lvk_samples::hybrid::RayPath;

use crate::args::{LightArgs, SkyArg, ViewerArgs};
use crate::config::{Content, ViewerConfig, counts_steps};
use crate::light::{Environment, EnvironmentError, SunSetting};
use crate::model::{ModelError, load, showcase};
use crate::names::{animation_place, camera_place};
use crate::viewer::{PreparationTimes, Viewer, ViewerScene};

/// What to open, on any thread.
pub(crate) struct Request {
    pub(crate) args: ViewerArgs,
    /// Width and height of the pictures in pixels.
    pub(crate) extent: [u32; 2],
    pub(crate) is_for_window: bool,
}

/// A model, and how long it took to load.
pub(crate) struct LoadedModel {
    pub(crate) model: Model,
    time: Duration,
}

/// The model that the arguments name.
pub(crate) fn model(args: &ViewerArgs, progress: &mut Progress) -> Result<Model, ModelError> {
    args.file.as_deref().map_or_else(|| Ok(showcase()), |file| load(file, progress))
}

impl Request {
    /// Loads the model and prints its warnings.
    pub(crate) fn model(&self, progress: &mut Progress) -> Result<LoadedModel, RunError> {
        let start = Instant::now();
        let model = model(&self.args, progress).map_err(RunError::input)?;
        progress.go_on()?;
        let warnings: Vec<String> = model.warnings.iter().map(ToString::to_string).collect();
        warn_beside(progress, &warnings);
        Ok(LoadedModel { model, time: start.elapsed() })
    }

    /// Uploads the model, chooses its camera and animation, and makes all pipelines.
    pub(crate) fn viewer(
        &self,
        ctx: &Context,
        LoadedModel { model, time }: LoadedModel,
        progress: &mut Progress,
    ) -> Result<ReadySample<Viewer>, RunError> {
        let args = &self.args;
        let animation = args.animation.as_deref().map(|wish| animation_place(&model, wish));
        let animation = animation.transpose().map_err(RunError::input)?;
        progress.stage("uploading the model and building acceleration structures", 0);
        let config = self.config(ctx)?;
        let scene = self.scene(model).map_err(RunError::input)?;
        let mut viewer = Viewer::new(ctx, scene, &config)?;
        warn_beside(progress, viewer.warnings());
        if config.content == Content::Steps && !counts_steps(ctx.capabilities()) {
            let text = "--view steps is black: the device counts no steps of its rays; --rt software does";
            warn_beside(progress, &[text.to_owned()]);
        }
        viewer.play(animation, args.time);
        if let Some(wish) = &args.camera {
            let place = camera_place(viewer.cameras(), wish).map_err(RunError::input)?;
            viewer.choose_camera(place);
        }
        let (triangles, instances) = viewer.counts();
        let PreparationTimes { scene, pipelines } = viewer.preparation();
        let samples = match config.is_progressive {
            true => "a sample a frame".to_owned(),
            false => format!("{} samples a pixel", config.samples),
        };
        let [read, built, made] = [time, scene, pipelines].map(|time| time.as_secs_f64());
        let text = format!(
            "{}: {triangles} triangles, {instances} instances, read in {read:.2} s, uploaded and built in {built:.2} s, \
             pipelines made in {made:.2} s; {samples}, paths of {} surfaces at most",
            viewer.name(),
            config.bounces
        );
        progress.pause();
        Ok(ReadySample::ray_traced(viewer, config.path, "a compute shader", &text))
    }

    fn config(&self, ctx: &Context) -> Result<ViewerConfig, RunError> {
        let args = &self.args;
        let path = RayPath::choose(RayPath::from_args(args.tracing.rt), ctx.capabilities())?;
        let [width, height] = self.extent;
        Ok(ViewerConfig {
            method: args.method,
            content: args.view,
            samples: args.samples,
            bounces: args.bounces,
            exposure_stops: args.exposure,
            tone_mapping: args.tone,
            texture_budget: args.texture_budget.map(|mib| u64::from(mib) << 20),
            primary: args.primary,
            indirect: args.indirect,
            light_rate: args.light_rate,
            cache_entries: args.cache_entries,
            culling: args.culling,
            is_progressive: self.is_for_window || args.real_time,
            ..ViewerConfig::new(path, width, height)
        })
    }

    /// The model with the light that the arguments ask for.
    fn scene(&self, model: Model) -> Result<ViewerScene, EnvironmentError> {
        let LightArgs { sky, sky_rotation, sun_elevation, sun_azimuth, sun_radius } = &self.args.light;
        let environment = match sky {
            SkyArg::Day => Environment::day(&SunSetting {
                elevation_degrees: *sun_elevation,
                azimuth_degrees: *sun_azimuth,
                radius_degrees: *sun_radius,
            }),
            SkyArg::White => Environment::uniform([1.0; 3]),
            SkyArg::Black => Environment::uniform([0.0; 3]),
            SkyArg::File(path) => Environment::from_hdr(path, *sky_rotation)?,
        };
        let name = self.args.file.as_deref().map_or_else(|| "showcase".to_owned(), lvk::readable_name);
        Ok(ViewerScene { name, model, environment, disc_radius: sun_radius.to_radians() })
    }
}

/// Prints warnings to standard error, after pausing the progress bar.
fn warn_beside(progress: &mut Progress, warnings: &[String]) {
    if !warnings.is_empty() {
        progress.pause();
    }
    warn(warnings);
}
