//! The viewer: a model on the GPU, a camera, and the picture so far.

use std::time::{Duration, Instant};

use glam::Vec3;
use lvk::{CommandBuffer, Context};
use lvk_gltf::{Bounds, Model};
use lvk_samples::app::frame::Frame;
use lvk_samples::app::render_target::RenderTarget;
use lvk_samples::app::sample_error::SampleError;
use lvk_samples::scene::{Camera, GpuCamera};

use crate::config::{Content, Method, ViewerConfig};
use crate::dropped::DroppedFile;
use crate::gpu::layout::{FrameConstants, Push};
use crate::gpu::{DrawnCounts, DrawnInstances, FrameChange, FrameScene, GpuScene, TextureMemory};
use crate::hybrid::cell_share;
use crate::light::Environment;
use crate::model::{self, ModelCamera};
use crate::path_pass::PathWork;
use crate::playback::Playback;
use crate::present::Present;
use crate::renderer::Renderer;

/// Samples of a pass of the path tracer, so that none takes long: on a GPU, and on a CPU.
const GPU_PASS: u32 = 4;
const CPU_PASS: u32 = 16;
/// Distance up to which surfaces take ambient light from each other, over the diagonal of the scene.
const OCCLUSION_SHARE: f32 = 0.05;
/// Distance of the near plane over the distance of what the camera looks at.
const NEAR_SHARE: f32 = 1e-3;

/// A model with the light that falls on it.
#[derive(Debug, Clone)]
pub struct ViewerScene {
    /// For the log.
    pub name: String,
    /// The model, of which the default scene is shown.
    pub model: Model,
    /// Light from outside. Its sun does not shine on a model with directional lights of its own.
    pub environment: Environment,
    /// Radius of the discs of directional lights, in radians.
    pub disc_radius: f32,
}

/// A scene on the GPU.
pub(crate) struct UploadedScene {
    pub(crate) name: String,
    pub(crate) gpu: GpuScene,
    pub(crate) environment: Environment,
    pub(crate) disc_radius: f32,
    bounds: Bounds,
    /// Never empty.
    pub(crate) cameras: Vec<ModelCamera>,
    /// Time that the uploads and the builds of acceleration structures took.
    time: Duration,
}

impl UploadedScene {
    /// Uploads a scene, and builds its acceleration structures. `texture_budget`: as in [`ViewerConfig`].
    pub(crate) fn new(
        ctx: &Context,
        scene: ViewerScene,
        texture_budget: Option<u64>,
    ) -> Result<Self, SampleError> {
        let start = Instant::now();
        let ViewerScene { name, model, environment, disc_radius } = scene;
        let shown = model.default_scene.unwrap_or(0);
        let pose = model.pose(None, 0.0);
        let bounds = model::bounds(&model, shown, &pose);
        let light = (&environment, disc_radius);
        let gpu = GpuScene::new(ctx, (model, shown), &pose, light, &bounds, texture_budget)?;
        let cameras = model::cameras_around(gpu.rig(), shown, &pose, &bounds);
        Ok(Self { name, gpu, environment, disc_radius, bounds, cameras, time: start.elapsed() })
    }

    /// Returns the warnings about parts of the model that look otherwise than the file says.
    pub(crate) fn warnings(&self) -> &[String] {
        &self.gpu.warnings
    }
}

/// Durations of the parts of [`Viewer::new`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PreparationTimes {
    /// Uploads, and builds of acceleration structures.
    pub scene: Duration,
    /// Pipelines.
    pub pipelines: Duration,
}

/// Shows a model.
pub struct Viewer {
    pub(crate) ctx: Context,
    pub(crate) config: ViewerConfig,
    pub(crate) shown: UploadedScene,
    pub(crate) renderer: Renderer,
    pub(crate) present: Present,
    pub(crate) target: RenderTarget,
    pub(crate) playback: Playback,
    /// The camera that looks, by its place among those of the scene.
    pub(crate) chosen: usize,
    /// True if another was chosen, until the window knows.
    pub(crate) has_chosen_camera: bool,
    pub(crate) dropped: DroppedFile,
    /// True if a warning has told of textures that are coarser than a picture needs.
    pub(crate) has_warned_of_textures: bool,
    /// Why the configuration that the panel asked for last cannot be, if so.
    pub(crate) refused: Option<String>,
    pub(crate) camera: Camera,
    /// The camera of the frame before.
    pub(crate) before: Camera,
    /// Samples in the picture, of the same camera.
    pub(crate) done: u32,
    /// Frames since the renderer was made or began anew.
    pub(crate) frame_number: u32,
    /// Instances that culling has left.
    pub(crate) drawn: DrawnCounts,
    /// Time that the compilation of pipelines took.
    pipelines_time: Duration,
}

impl Viewer {
    /// Uploads the scene, builds its acceleration structures and makes all pipelines. The first camera looks. Vertices are freed as
    /// they are uploaded, so that they are in the host's memory once.
    ///
    /// # Errors
    /// [`SampleError`] when the configuration or the scene is beyond the device, or the device fails.
    pub fn new(ctx: &Context, scene: ViewerScene, config: &ViewerConfig) -> Result<Self, SampleError> {
        config.check(ctx.capabilities())?;
        let target = RenderTarget::storage(ctx, config.extent())?;
        let shown = UploadedScene::new(ctx, scene, config.texture_budget)?;
        let camera = shown.cameras[0].camera;
        let start = Instant::now();
        let occludes = config.occludes(shown.gpu.instance_count());
        let (renderer, present) = (Renderer::new(ctx, config, occludes)?, Present::new(ctx)?);
        Ok(Self {
            pipelines_time: start.elapsed(),
            shown,
            renderer,
            present,
            ctx: ctx.clone(),
            config: *config,
            target,
            playback: Playback::default(),
            chosen: 0,
            has_chosen_camera: false,
            dropped: DroppedFile::default(),
            has_warned_of_textures: false,
            refused: None,
            camera,
            before: camera,
            done: 0,
            frame_number: 0,
            drawn: DrawnCounts::default(),
        })
    }

    /// Shows another scene by the same pipelines and settings. Its first camera looks, and no animation plays. On failure the scene from
    /// before stays.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn show(&mut self, scene: ViewerScene) -> Result<(), SampleError> {
        let uploaded = UploadedScene::new(&self.ctx, scene, self.config.texture_budget)?;
        self.show_uploaded(uploaded)
    }

    fn show_uploaded(&mut self, uploaded: UploadedScene) -> Result<(), SampleError> {
        let occludes = self.config.occludes(uploaded.gpu.instance_count());
        self.renderer.set_occlusion(&self.ctx, occludes)?;
        (self.camera, self.chosen) = (uploaded.cameras[0].camera, 0);
        (self.shown, self.pipelines_time) = (uploaded, Duration::ZERO);
        (self.playback, self.drawn) = (Playback::default(), DrawnCounts::default());
        (self.has_warned_of_textures, self.refused) = (false, None);
        self.begin();
        Ok(())
    }

    /// Returns how long the uploads, the builds and the pipelines took.
    #[must_use]
    pub fn preparation(&self) -> PreparationTimes {
        PreparationTimes { scene: self.shown.time, pipelines: self.pipelines_time }
    }

    /// Cameras of the model; never empty.
    #[must_use]
    pub fn cameras(&self) -> &[ModelCamera] {
        &self.shown.cameras
    }

    /// Looks through a camera of the model, by its place in [`cameras`](Self::cameras). Beyond the last it is the last.
    pub fn choose_camera(&mut self, place: usize) {
        self.chosen = place.min(self.shown.cameras.len() - 1);
        self.set_camera(&self.shown.cameras[self.chosen].camera.clone());
        self.has_chosen_camera = true;
    }

    /// Plays an animation of the model, by its place there, from a time in seconds on; `None` shows the nodes as they are.
    pub fn play(&mut self, animation: Option<usize>, start: f32) {
        self.playback = Playback { animation, start, ..self.playback };
        self.pose();
    }

    /// Moves everything to where it is at the time that is shown. A camera of a node moves with it.
    pub(crate) fn pose(&mut self) {
        let pose = self.playback.pose(self.shown.gpu.rig());
        if !self.shown.gpu.set_pose(&pose) {
            return;
        }
        self.done = 0;
        let is_own = self.camera == self.shown.cameras[self.chosen].camera;
        self.shown.cameras = model::cameras_around(
            self.shown.gpu.rig(),
            self.shown.gpu.scene_number(),
            &pose,
            &self.shown.bounds,
        );
        if is_own {
            self.set_camera(&self.shown.cameras[self.chosen].camera.clone());
        }
    }

    /// Name of the model.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.shown.name
    }

    /// Why the file that was dropped last cannot be shown, if so.
    #[must_use]
    pub fn drop_error(&self) -> Option<&str> {
        self.dropped.error()
    }

    /// Shows a dropped file in place of the model, once it is loaded.
    pub(crate) fn take_dropped(&mut self) {
        let Some(loaded) = self.dropped.take() else { return };
        match self.show_uploaded(loaded) {
            Ok(()) => self.has_chosen_camera = true,
            Err(error) => self.refused = Some(error.to_string()),
        }
    }

    /// The positions of vertices that morph targets or joints move, as the last frame has them: a list for each primitive with
    /// triangles, in the order of meshes and then of nodes. Empty if the model has no animations.
    ///
    /// # Errors
    /// [`SampleError::Device`].
    pub fn moved_positions(&self) -> Result<Vec<Vec<[f32; 3]>>, SampleError> {
        Ok(self.shown.gpu.moved_positions(&self.ctx)?)
    }

    /// Triangles of all meshes, each mesh once, and instances of meshes.
    #[must_use]
    pub fn counts(&self) -> (u64, u32) {
        (self.shown.gpu.triangle_count, self.shown.gpu.instance_count())
    }

    /// Memory of textures; `None` without a budget.
    #[must_use]
    pub fn texture_memory(&self) -> Option<TextureMemory> {
        self.shown.gpu.texture_memory()
    }

    /// Instances that the last frame has rasterised; `None` where culling leaves out none. Waits for the frame.
    ///
    /// # Errors
    /// [`SampleError::Device`].
    pub fn drawn_instances(&mut self) -> Result<Option<DrawnInstances>, SampleError> {
        if !self.config.culls() {
            return Ok(None);
        }
        self.drawn.read(&self.ctx, self.shown.gpu.culling())?;
        Ok(self.drawn.known())
    }

    /// What the picture leaves out, for the user to read.
    #[must_use]
    pub fn warnings(&self) -> &[String] {
        self.shown.warnings()
    }

    /// The configuration.
    #[must_use]
    pub fn config(&self) -> &ViewerConfig {
        &self.config
    }

    /// Renders by another configuration from now on; by the old one where this fails.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn configure(&mut self, config: &ViewerConfig) -> Result<(), SampleError> {
        config.check(self.ctx.capabilities())?;
        let before = &self.config;
        let is_resized = config.extent() != before.extent();
        let is_of_steps = |config: &ViewerConfig| config.content == Content::Steps;
        let needs_others = config.method != before.method
            || config.path != before.path
            || config.rasterises() != before.rasterises()
            || config.indirect != before.indirect
            || config.cache_entries != before.cache_entries
            || is_of_steps(config) != is_of_steps(before);
        let occludes = config.occludes(self.counts().1);
        if is_resized || needs_others {
            let renderer = Renderer::new(&self.ctx, config, occludes)?;
            if is_resized {
                self.target = RenderTarget::storage(&self.ctx, config.extent())?;
            }
            (self.renderer, self.frame_number, self.done) = (renderer, 0, 0);
        }
        self.renderer.set_occlusion(&self.ctx, occludes)?;
        if config.bounces != before.bounces {
            self.done = 0;
        }
        // The samples of a pixel have other numbers by turns: those of one rate would come again by the other.
        if config.light_turns() != before.light_turns() {
            (self.frame_number, self.done) = (0, 0);
        }
        self.config = ViewerConfig { texture_budget: before.texture_budget, ..*config };
        Ok(())
    }

    /// The mean radiance of each pixel of the last frame, rows from the top. Zeros until there is a frame of this scene, and of a path that
    /// began anew.
    ///
    /// # Errors
    /// [`SampleError::Device`].
    pub fn radiance(&self) -> Result<Vec<[f32; 3]>, SampleError> {
        let count = self.summed_samples() as f32;
        if self.is_first() || count == 0.0 {
            let [width, height] = self.config.extent();
            return Ok(vec![[0.0; 3]; width as usize * height as usize]);
        }
        let mean = |[red, green, blue, _]: [f32; 4]| [red, green, blue].map(|sum| sum / count);
        Ok(self.sums()?.into_iter().map(mean).collect())
    }

    /// The number of rays of the last frame, shadow rays too. Only the path tracer counts them.
    ///
    /// # Errors
    /// [`SampleError::Device`].
    pub fn ray_count(&self) -> Result<Option<u64>, SampleError> {
        if self.config.method == Method::Hybrid {
            return Ok(None);
        }
        Ok(Some(self.sums()?.iter().map(|[.., rays]| *rays as u64).sum()))
    }

    /// Sums of all pixels: radiance, and the path tracer's rays.
    fn sums(&self) -> Result<Vec<[f32; 4]>, SampleError> {
        let [width, height] = self.config.extent();
        let mut sums = vec![[0.0_f32; 4]; width as usize * height as usize];
        let (buffer, offset) = self.renderer.sums();
        self.ctx.download_buffer(buffer, offset, bytemuck::cast_slice_mut(&mut sums))?;
        Ok(sums)
    }

    /// Samples in the sums of the last frame. The hybrid method's picture is a mean already.
    fn summed_samples(&self) -> u32 {
        match self.config.method {
            Method::Hybrid => 1,
            Method::PathTrace => self.done,
        }
    }

    pub(crate) fn set_camera(&mut self, camera: &Camera) {
        if self.camera != *camera {
            self.camera = *camera;
            self.done = 0;
        }
    }

    /// True if the renderer knows no frame before.
    fn is_first(&self) -> bool {
        self.frame_number == 0
    }

    /// Samples of a step of a frame.
    pub(crate) fn step_samples(&self) -> u32 {
        match self.config.method {
            Method::Hybrid => 1,
            Method::PathTrace if self.ctx.capabilities().is_cpu => CPU_PASS,
            Method::PathTrace => GPU_PASS,
        }
    }

    fn upload_frame(&self, cmd: &mut CommandBuffer) -> lvk::Result<u64> {
        let ViewerConfig { width, height, bounces, exposure_stops, tone_mapping, content, .. } = self.config;
        let gpu = |camera: &Camera| {
            let distance = Vec3::from(camera.eye).distance(Vec3::from(camera.target));
            GpuCamera::new(camera, width, height, NEAR_SHARE * distance)
        };
        let seen = gpu(&self.camera);
        let addresses = self.renderer.addresses()?;
        let scene = self.shown.gpu.constants(cmd, self.is_first())?;
        cmd.upload(&FrameConstants {
            camera: seen.for_sample(self.frame_number, u32::MAX),
            scene,
            sums: addresses.sums,
            light: self.shown.gpu.light,
            tlas: self.shown.gpu.tlas.index(),
            image: self.target.image_index(),
            sample_number: if self.config.method == Method::Hybrid { self.frame_number } else { self.done },
            pixel_count: width * height,
            max_bounces: bounces - 1,
            exposure: exposure_stops.exp2(),
            offset_extent: self.shown.gpu.offset_extent,
            tone_mapping: tone_mapping as u32,
            frame_number: self.frame_number,
            seen,
            seen_before: gpu(if self.is_first() { &self.camera } else { &self.before }),
            visibility: addresses.visibility,
            planes: addresses.planes,
            path_lists: addresses.paths.lists,
            paths: addresses.paths.paths,
            cache: addresses.cache.addresses,
            wanted_mips: self
                .shown
                .gpu
                .wanted_mips()
                .map_or(Ok(0), |buffer| self.ctx.buffer_address(buffer))?,
            ambient_sums: addresses.ambient_sums,
            still_count: if self.camera == self.before { self.done } else { 0 },
            view: content as u32,
            scene_moves: u32::from(self.shown.gpu.moves()),
            emission: self.shown.gpu.emission(),
            cache_buckets: addresses.cache.bucket_count,
            cell_share: cell_share(seen.pixel_spread()),
            ambient: self.shown.gpu.ambient(),
            occlusion_distance: OCCLUSION_SHARE
                * self.shown.bounds.min.distance(self.shown.bounds.max).max(f32::MIN_POSITIVE),
            light_turns: self.config.light_turns(),
        })
    }

    /// Adds samples, and stores the picture if `is_shown`.
    pub(crate) fn add_samples(
        &mut self,
        frame: &mut Frame<'_>,
        count: u32,
        is_shown: bool,
    ) -> lvk::Result<()> {
        self.shown.gpu.record_motion(frame, self.is_first())?;
        let (constants, extent) = (self.upload_frame(&mut frame.cmd)?, self.config.extent());
        let scene = FrameScene {
            draws: self.shown.gpu.draws(),
            culling: self.config.culls().then(|| self.shown.gpu.culling()),
            written: &self.shown.gpu.written(),
            wanted_mips: self.shown.gpu.wanted_mips(),
        };
        let work = PathWork { frame: constants, samples: count, bounces: self.config.bounces };
        let change = if self.is_first() {
            FrameChange::All
        } else if self.camera.eye != self.before.eye || self.shown.gpu.moves() {
            FrameChange::Place
        } else {
            FrameChange::None
        };
        self.renderer.record(frame, work, scene, change)?;
        self.done += count;
        if is_shown {
            let push = Push { frame: constants, argument: self.summed_samples(), _padding: 0 };
            let (sums, image) = (self.renderer.sums().0, self.target.image());
            frame.pass("picture", |cmd| self.present.record(cmd, &push, sums, image, extent))?;
        }
        self.shown.gpu.end_frame(self.is_first());
        self.frame_number = self.frame_number.wrapping_add(1);
        self.before = self.camera;
        Ok(())
    }
}
