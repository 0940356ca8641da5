//! Renders the sample at a frame time.

use glam::Vec3;
use lvk::{BufferHandle, CommandBuffer, Context, Holder, TextureHandle};
use lvk_gltf::{Model, Pose};
use lvk_samples::app::array_buffer::buffer;
use lvk_samples::app::frame::Frame;
use lvk_samples::app::render_target::RenderTarget;
use lvk_samples::app::run_error::RunError;
use lvk_samples::app::sample::{FrameTime, Sample};
use lvk_samples::app::sample_error::SampleError;
use lvk_samples::scene::{Camera, GpuCamera};

use crate::config::{ToneMapping, ViewerConfig};
use crate::gpu::GpuScene;
use crate::gpu::layout::FrameConstants;
use crate::light::Environment;
use crate::model::{ModelCamera, cameras};
use crate::path_tracer::PathTracer;
use crate::present::Present;

/// Samples of a pass, so that none takes long: on a GPU, and on a CPU.
const GPU_PASS: u32 = 4;
const CPU_PASS: u32 = 16;
/// Distance of the near plane over the distance of what the camera looks at.
const NEAR_SHARE: f32 = 1e-3;

/// A model with the light that falls on it.
#[derive(Debug, Clone)]
pub struct ViewerScene {
    /// For the log.
    pub name: String,
    /// The model, of which the default scene is shown.
    pub model: Model,
    /// Light from outside.
    pub environment: Environment,
    /// Radius of the discs of directional lights, in radians.
    pub disc_radius: f32,
}

/// Shows a model.
pub struct Viewer {
    ctx: Context,
    config: ViewerConfig,
    scene: GpuScene,
    tracer: PathTracer,
    present: Present,
    target: RenderTarget,
    sums: Holder<BufferHandle>,
    cameras: Vec<ModelCamera>,
    chosen: usize,
    camera: Camera,
    /// Samples in the sums.
    done: u32,
}

impl Viewer {
    /// Uploads the scene, builds its acceleration structures and makes all pipelines. The first camera looks.
    ///
    /// # Errors
    /// [`SampleError`] when the configuration or the scene is beyond the device, or the device fails.
    pub fn new(ctx: &Context, scene: &ViewerScene, config: &ViewerConfig) -> Result<Self, SampleError> {
        config.check(ctx.capabilities())?;
        let target = RenderTarget::storage(ctx, config.extent())?;
        let shown = scene.model.default_scene.unwrap_or(0);
        let pose: Pose = scene.model.pose(None, 0.0);
        let gpu = GpuScene::new(ctx, &scene.model, shown, &pose, &scene.environment, scene.disc_radius)?;
        let cameras = cameras(&scene.model, shown, &pose);
        let camera = cameras[0].camera;
        Ok(Self {
            scene: gpu,
            tracer: PathTracer::new(ctx, config.path)?,
            present: Present::new(ctx)?,
            sums: sums(ctx, config.extent())?,
            ctx: ctx.clone(),
            config: *config,
            target,
            cameras,
            chosen: 0,
            camera,
            done: 0,
        })
    }

    /// Cameras of the model; never empty.
    #[must_use]
    pub fn cameras(&self) -> &[ModelCamera] {
        &self.cameras
    }

    /// Looks through a camera of the model, by its place in [`cameras`](Self::cameras). There is no camera beyond the last.
    pub fn choose_camera(&mut self, place: usize) {
        self.chosen = place.min(self.cameras.len() - 1);
        self.look(&self.cameras[self.chosen].camera.clone());
    }

    /// Triangles of all meshes, each mesh once, and instances of meshes.
    #[must_use]
    pub fn counts(&self) -> (u64, u32) {
        (self.scene.triangle_count, self.scene.instance_count)
    }

    /// What the picture leaves out, for the user to read.
    #[must_use]
    pub fn warnings(&self) -> &[String] {
        &self.scene.warnings
    }

    /// The mean radiance of each pixel of the last frame, rows from the top.
    ///
    /// # Errors
    /// [`SampleError::Device`].
    pub fn radiance(&self) -> Result<Vec<[f32; 3]>, SampleError> {
        let [width, height] = self.config.extent();
        let mut sums = vec![[0.0_f32; 4]; width as usize * height as usize];
        self.ctx.download_buffer(*self.sums, 0, bytemuck::cast_slice_mut(&mut sums))?;
        let count = self.done.max(1) as f32;
        Ok(sums.iter().map(|[red, green, blue, _]| [red / count, green / count, blue / count]).collect())
    }

    fn look(&mut self, camera: &Camera) {
        if self.camera != *camera {
            self.camera = *camera;
            self.done = 0;
        }
    }

    fn pass_samples(&self) -> u32 {
        if self.ctx.capabilities().is_cpu { CPU_PASS } else { GPU_PASS }
    }

    fn upload_frame(&self, cmd: &mut CommandBuffer, sample_count: u32) -> lvk::Result<u64> {
        let ViewerConfig { width, height, bounces, exposure_stops, tone_mapping, .. } = self.config;
        let distance = Vec3::from(self.camera.eye).distance(Vec3::from(self.camera.target));
        cmd.upload(&FrameConstants {
            camera: GpuCamera::new(&self.camera, width, height, NEAR_SHARE * distance),
            scene: self.scene.constants,
            sums: self.sums.address()?,
            light: self.scene.light,
            tlas: self.scene.tlas.index(),
            image: self.target.image_index(),
            sample_number: self.done,
            sample_count,
            max_bounces: bounces - 1,
            exposure: exposure_stops.exp2(),
            offset_extent: self.scene.offset_extent,
            tone_mapping: match tone_mapping {
                ToneMapping::Neutral => 0,
                ToneMapping::Linear => 1,
            },
            _padding: 0,
        })
    }

    /// Adds samples, and stores the picture if `is_shown`.
    fn add_samples(&mut self, frame: &mut Frame<'_>, count: u32, is_shown: bool) -> lvk::Result<()> {
        let (constants, extent) = (self.upload_frame(&mut frame.cmd, count)?, self.config.extent());
        let (sums, image) = (*self.sums, self.target.image());
        frame.pass("paths", |cmd| self.tracer.record(cmd, constants, sums, extent))?;
        if is_shown {
            frame.pass("picture", |cmd| self.present.record(cmd, constants, sums, image, extent))?;
        }
        self.done += count;
        Ok(())
    }
}

impl Sample for Viewer {
    fn context(&self) -> &Context {
        &self.ctx
    }

    /// Nothing moves. Outside of windows each frame begins anew, so that it does not depend on those before.
    fn update(&mut self, _: FrameTime) {
        if !self.config.is_progressive {
            self.done = 0;
        }
    }

    fn stands_at_first(&self) -> bool {
        true
    }

    fn steps_per_frame(&self) -> u64 {
        if self.config.is_progressive { 1 } else { self.config.samples.div_ceil(self.pass_samples()).into() }
    }

    fn record(&mut self, frame: &mut Frame<'_>) -> Result<TextureHandle, RunError> {
        if self.config.is_progressive {
            let left = self.config.samples.saturating_sub(self.done);
            if left > 0 {
                self.add_samples(frame, left.min(1), true)?;
            }
            return Ok(self.target.image());
        }
        self.done = 0;
        while self.done < self.config.samples {
            if self.done > 0 {
                frame.next_step()?;
            }
            let count = (self.config.samples - self.done).min(self.pass_samples());
            self.add_samples(frame, count, self.done + count == self.config.samples)?;
        }
        Ok(self.target.image())
    }

    fn resize(&mut self, [width, height]: [u32; 2]) -> Result<(), RunError> {
        let config = ViewerConfig { width, height, ..self.config };
        config.check(self.ctx.capabilities())?;
        let target = RenderTarget::storage(&self.ctx, config.extent())?;
        self.sums = sums(&self.ctx, config.extent())?;
        (self.target, self.config, self.done) = (target, config, 0);
        Ok(())
    }

    fn view(&mut self) -> Option<Camera> {
        Some(self.camera)
    }

    fn set_view(&mut self, camera: &Camera) {
        self.look(camera);
    }

    /// Looks through the next camera of the model.
    fn next(&mut self) {
        self.choose_camera((self.chosen + 1) % self.cameras.len());
    }

    fn panel(&mut self, ui: &mut egui::Ui) {
        let mut chosen = self.chosen;
        egui::ComboBox::from_label("camera").selected_text(&self.cameras[chosen].name).show_ui(ui, |ui| {
            for (place, camera) in self.cameras.iter().enumerate() {
                ui.selectable_value(&mut chosen, place, &camera.name);
            }
        });
        if chosen != self.chosen {
            self.choose_camera(chosen);
        }
        ui.add(egui::Slider::new(&mut self.config.exposure_stops, -6.0..=6.0).text("stops"));
        if ui.add(egui::Slider::new(&mut self.config.bounces, 1..=64).text("bounces")).changed() {
            self.done = 0;
        }
        ui.label(format!("{} of {} samples", self.done, self.config.samples));
        let (triangles, instances) = self.counts();
        ui.label(format!("{triangles} triangles, {instances} instances"));
    }

    fn reload(&mut self) -> Result<(), RunError> {
        let (tracer, present) = (PathTracer::new(&self.ctx, self.config.path)?, Present::new(&self.ctx)?);
        (self.tracer, self.present, self.done) = (tracer, present, 0);
        Ok(())
    }
}

/// The sums of a picture of `extent` pixels.
fn sums(ctx: &Context, [width, height]: [u32; 2]) -> lvk::Result<Holder<BufferHandle>> {
    buffer(ctx, "sums", 16 * u64::from(width) * u64::from(height))
}
