//! Renders the sample at a frame time.

use crate::app::render_target::RenderTarget;
use crate::app::run_error::RunError;
use crate::app::sample_error::SampleError;
use bytemuck::Zeroable;
use lvk::{BufferHandle, BufferUsage, CommandBuffer, Context, Holder, SamplerHandle, TextureHandle};

use super::config::OmniShadowsConfig;
use super::frame::FrameConstants;
use super::models::{self, Draw, Models};
use super::scene_pass::ScenePass;
use super::shadow_cube::{CubePass, ShadowCube, samplers};
use crate::app::array_buffer::array;
use crate::app::frame::Frame;
use crate::app::sample::{FrameTime, Sample};
use crate::scene::{Camera, GpuCamera};

/// Distance at which the depth of the lamp's map is 1, in metres.
const LAMP_NEAR: f32 = 0.05;
const NEAR_PLANE: f32 = 0.05;
/// Irradiance of the lamp at a distance of one metre.
const INTENSITY: [f32; 3] = [27.0, 18.8, 11.0];
/// Edges of the cube map that the panel offers.
const SHADOW_SIZES: [u32; 4] = [256, 512, 1024, 2048];

/// Renders the lamp in its room.
pub struct OmniShadows {
    ctx: Context,
    config: OmniShadowsConfig,
    target: RenderTarget,
    cube: ShadowCube,
    cube_pass: CubePass,
    scene_pass: ScenePass,
    draws: Vec<Draw>,
    triangle_count: u32,
    constants: FrameConstants,
    camera: Camera,
    phase: f32,
    _held: ([Holder<BufferHandle>; 2], [Holder<SamplerHandle>; 3]),
}

impl OmniShadows {
    /// Makes models, textures and pipelines. The animation stands at its beginning.
    ///
    /// # Errors
    /// [`SampleError`] when the picture is beyond the device, the device cannot draw as asked, or fails.
    pub fn new(ctx: &Context, config: &OmniShadowsConfig) -> Result<Self, SampleError> {
        let config = config.clamped();
        let models = Models::new();
        let vertices = array(ctx, "vertices", BufferUsage::STORAGE, &models.vertices)?;
        let corners = array(ctx, "corners", BufferUsage::STORAGE, &models.corners)?;
        let samplers = samplers(ctx)?;
        let constants = FrameConstants {
            vertices: vertices.address()?,
            corners: corners.address()?,
            lamp_near: LAMP_NEAR,
            intensity: INTENSITY,
            room: models::ROOM,
            samplers: samplers.each_ref().map(Holder::index),
            ..FrameConstants::zeroed()
        };
        Ok(Self {
            target: RenderTarget::with_depth(ctx, config.extent)?,
            cube: ShadowCube::new(ctx, config.shadow_size)?,
            cube_pass: CubePass::new(ctx, config.faces.are_one_pass(ctx)?)?,
            scene_pass: ScenePass::new(ctx)?,
            ctx: ctx.clone(),
            config,
            triangle_count: models.triangle_count(),
            draws: models.draws,
            constants,
            camera: models::camera(0.0),
            phase: 0.0,
            _held: ([vertices, corners], samplers),
        })
    }

    /// Moves everything to where it is at `phase` of the animation's round, 0 to 1.
    pub fn show(&mut self, phase: f32) {
        self.phase = phase;
        self.camera = models::camera(phase);
    }

    /// Triangles of the picture.
    pub fn triangle_count(&self) -> u32 {
        self.triangle_count
    }

    /// Position of the lamp.
    pub fn lamp(&self) -> [f32; 3] {
        models::lamp(self.phase).into()
    }

    /// Corners of all triangles in their places, of those in the lamp's way and of the others.
    pub fn triangles(&self) -> [Vec<[[f32; 3]; 3]>; 2] {
        Models::new().triangles(self.phase)
    }

    /// True if all faces of the cube map are drawn in one pass.
    pub fn is_multiview(&self) -> bool {
        self.cube_pass.is_multiview()
    }

    fn upload(&self, cmd: &mut CommandBuffer) -> lvk::Result<u64> {
        let OmniShadowsConfig { extent: [width, height], filter, lamp_radius, haze, .. } = self.config;
        let constants = FrameConstants {
            camera: GpuCamera::new(&self.camera, width, height, NEAR_PLANE),
            instances: cmd.upload_slice(&models::instances(self.phase))?,
            light: models::lamp(self.phase).into(),
            bulb: lamp_radius,
            haze,
            cube: self.cube.texture.index(),
            faces: self.cube.faces.each_ref().map(Holder::index),
            filtering: filter as u32,
            texel: 2.0 / self.cube.size as f32,
            ..self.constants
        };
        cmd.upload(&constants)
    }

    /// Takes over what the panel has set.
    fn apply(&mut self) -> Result<(), SampleError> {
        let OmniShadowsConfig { shadow_size, faces, .. } = self.config;
        if self.cube.size != shadow_size {
            self.cube = ShadowCube::new(&self.ctx, shadow_size)?;
        }
        let is_multiview = faces.are_one_pass(&self.ctx)?;
        if self.is_multiview() != is_multiview {
            self.cube_pass = CubePass::new(&self.ctx, is_multiview)?;
        }
        Ok(())
    }
}

impl Sample for OmniShadows {
    fn context(&self) -> &Context {
        &self.ctx
    }

    fn update(&mut self, time: FrameTime) {
        self.show(time.phase());
    }

    fn record(&mut self, frame: &mut Frame<'_>) -> Result<TextureHandle, RunError> {
        self.apply()?;
        let constants = self.upload(&mut frame.cmd)?;
        let Self { target, cube, cube_pass, scene_pass, draws, config, .. } = &*self;
        frame.pass("shadow cube", |cmd| cube_pass.record(cmd, cube, draws, constants))?;
        let shown = (constants, config.shows_cube);
        scene_pass.record(&mut frame.cmd, target, *cube.texture, draws, shown)?;
        Ok(target.image())
    }

    fn resize(&mut self, extent: [u32; 2]) -> Result<(), RunError> {
        self.target = RenderTarget::with_depth(&self.ctx, extent)?;
        self.config.extent = extent;
        Ok(())
    }

    fn camera_mut(&mut self) -> Option<&mut Camera> {
        Some(&mut self.camera)
    }

    #[cfg(feature = "window")]
    fn panel(&mut self, ui: &mut egui::Ui) {
        use super::config::{ShadowFaces, ShadowFilter};

        let mut is_multiview = self.is_multiview();
        let can = ShadowFaces::can_be_one_pass(&self.ctx);
        let config = &mut self.config;
        let switch = egui::Checkbox::new(&mut is_multiview, "six faces in one pass");
        if ui.add_enabled(can, switch).changed() {
            config.faces = if is_multiview { ShadowFaces::Multiview } else { ShadowFaces::Single };
        }
        let sizes = egui::ComboBox::from_label("texels on an edge");
        sizes.selected_text(config.shadow_size.to_string()).show_ui(ui, |ui| {
            for size in SHADOW_SIZES {
                ui.selectable_value(&mut config.shadow_size, size, size.to_string());
            }
        });
        ui.horizontal(|ui| {
            for filter in [ShadowFilter::Off, ShadowFilter::Hard, ShadowFilter::Linear, ShadowFilter::Soft] {
                ui.selectable_value(&mut config.filter, filter, format!("{filter:?}"));
            }
        });
        ui.add(egui::Slider::new(&mut config.lamp_radius, 0.0..=0.06).text("radius of the lamp, m"));
        ui.add(egui::Slider::new(&mut config.haze, 0.0..=0.2).text("haze"));
        ui.checkbox(&mut config.shows_cube, "cube map");
    }

    fn reload(&mut self) -> Result<(), RunError> {
        let scene_pass = ScenePass::new(&self.ctx)?;
        self.cube_pass = CubePass::new(&self.ctx, self.cube_pass.is_multiview())?;
        self.scene_pass = scene_pass;
        Ok(())
    }
}
