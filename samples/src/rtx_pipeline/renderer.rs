//! Renders the sample at a frame time.

use crate::app::render_target::RenderTarget;
use crate::app::run_error::RunError;
use crate::app::sample_error::SampleError;
use bytemuck::{Pod, Zeroable};
use lvk::{Context, TextureHandle};

use super::config::RtxPipelineConfig;
use super::panel::RtxPipelineSettings;
use super::pipelines::RAYS;
use crate::app::frame::Frame;
use crate::app::sample::{FrameTime, Sample};
use crate::hybrid::{GpuScene, HitGroups, Lighting, SceneFrame, near_plane};
use crate::rtx::{RayStages, Tracer};
use crate::scene::{Camera, CameraTour, GpuCamera, Scene};

/// Places of hit groups in the pipeline (`kSolid` and `kGlass` in `shaders/rtx_pipeline/radiance.glsl`).
const HIT_GROUPS: HitGroups = HitGroups { opaque: 0, refractive: 1 };

/// Renders a scene by rays whose hits trace on.
pub struct RtxPipeline {
    ctx: Context,
    target: RenderTarget,
    config: RtxPipelineConfig,
    scene: GpuScene,
    tracer: Tracer,
    constants: FrameConstants,
    lighting: Lighting,
    settings: RtxPipelineSettings,
    tour: CameraTour,
    near_plane: f32,
}

lvk::shader_struct! {
    /// `Frame` in `shaders/rtx_pipeline/frame.glsl`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(super) struct FrameConstants {
        scene as scene_frame: SceneFrame,
        image: u32,
        depth: u32,
    }
}

impl RtxPipeline {
    /// Uploads `scene`, builds its acceleration structures and makes the pipeline, of hit shaders that trace no deeper than
    /// the device can.
    ///
    /// # Errors
    /// [`SampleError`] when the configuration or the scene is beyond the device, or the device fails.
    pub fn new(ctx: &Context, scene: &Scene, config: &RtxPipelineConfig) -> Result<Self, SampleError> {
        let config = config.valid_for(ctx.capabilities());
        let target = config.rtx.create_target(ctx)?;
        let gpu_scene = GpuScene::new(ctx, scene, HIT_GROUPS)?;
        let lighting = Lighting::new(scene);
        let settings = RtxPipelineSettings { depth: config.depth, lights: lighting.light_count() };
        let constants = FrameConstants {
            scene: SceneFrame {
                camera: GpuCamera::zeroed(),
                scene: gpu_scene.addresses(),
                lighting,
                tlas: gpu_scene.tlas.index(),
                sky: gpu_scene.sky.index(),
                surface_sampler: gpu_scene.surface_sampler.index(),
                sky_sampler: gpu_scene.sky_sampler.index(),
            },
            image: target.image_index(),
            depth: config.depth,
        };
        Ok(Self {
            tracer: tracer(ctx, &config)?,
            tour: CameraTour::new(scene, 0),
            near_plane: near_plane(scene),
            ctx: ctx.clone(),
            scene: gpu_scene,
            target,
            config,
            constants,
            lighting,
            settings,
        })
    }

    /// Tours the scene's cameras from the one with this index on.
    #[must_use]
    pub fn from_camera(mut self, scene: &Scene, first: usize) -> Self {
        self.tour = CameraTour::new(scene, first);
        self
    }

    /// The configuration, limited to what the device supports.
    pub fn config(&self) -> &RtxPipelineConfig {
        &self.config
    }

    /// Triangles of the scene.
    pub fn triangle_count(&self) -> u32 {
        self.scene.triangle_count
    }

    /// Settings of the panel, which take effect with the next frame.
    pub fn settings(&mut self) -> &mut RtxPipelineSettings {
        &mut self.settings
    }

    /// The initial and largest values of the settings.
    fn default_settings(&self) -> RtxPipelineSettings {
        RtxPipelineSettings { depth: self.config.depth, lights: self.lighting.light_count() }
    }

    /// Parts that the library made of the bottom-level structures, which are two at most.
    pub fn blas_part_count(&self) -> u32 {
        self.scene.blas_part_count
    }
}

impl Sample for RtxPipeline {
    fn context(&self) -> &Context {
        &self.ctx
    }

    fn update(&mut self, time: FrameTime) {
        self.tour.go_to(time.phase());
    }

    fn record(&mut self, frame: &mut Frame<'_>) -> Result<TextureHandle, RunError> {
        let [width, height] = self.config.rtx.extent();
        self.constants.depth = self.settings.depth.min(self.config.depth);
        self.constants.scene.lighting = self.lighting.with_lights(self.settings.lights);
        self.constants.scene.camera = GpuCamera::new(&self.tour.camera, width, height, self.near_plane);
        let push = frame.cmd.upload(&self.constants)?;
        Ok(self.tracer.record_image(frame, &self.target, &push)?)
    }

    fn resize(&mut self, extent: [u32; 2]) -> Result<(), RunError> {
        self.target = self.config.rtx.resize(&self.ctx, extent)?;
        self.constants.image = self.target.image_index();
        Ok(())
    }

    fn camera_mut(&mut self) -> Option<&mut Camera> {
        Some(&mut self.tour.camera)
    }

    #[cfg(feature = "window")]
    fn panel(&mut self, ui: &mut egui::Ui) {
        let most = self.default_settings();
        self.settings.show(ui, &most);
        ui.label(format!("{} triangles", self.triangle_count()));
    }

    fn reload(&mut self) -> Result<(), RunError> {
        self.tracer = tracer(&self.ctx, &self.config)?;
        Ok(())
    }
}

fn tracer(ctx: &Context, config: &RtxPipelineConfig) -> lvk::Result<Tracer> {
    Tracer::new(ctx, config.rtx.path, &RayStages { max_recursion: config.max_recursion(), ..RAYS })
}
