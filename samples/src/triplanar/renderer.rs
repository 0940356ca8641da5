//! Renders the sample at a frame time.

use crate::app::render_target::RenderTarget;
use crate::app::run_error::RunError;
use crate::app::sample_error::SampleError;
use std::f32::consts::TAU;

use bytemuck::{Pod, Zeroable};
use lvk::{
    BufferHandle, BufferUsage, CommandBuffer, Context, CullMode, Dependencies, Holder, IndexFormat,
    RenderPipelineDesc, RenderPipelineHandle, SamplerDesc, SamplerHandle, TextureHandle,
};

use super::models::Models;
use super::pipelines::MODELS;
use super::streamed::{COUNT, Residency, Streamed};
use crate::app::array_buffer::array;
use crate::app::frame::Frame;
use crate::app::sample::{FrameTime, Sample};
use crate::scene::{Camera, GpuCamera, PAINTED};

/// Colour of what is far away, in linear light (`kBackdrop` in `shaders/triplanar/frame.glsl`).
const BACKDROP: [f32; 3] = [0.78, 0.80, 0.82];
const NEAR_PLANE: f32 = 0.05;
/// Frames between two textures that go or come, where they do so by themselves.
const FRAMES_PER_TURN: u32 = 30;

/// Draws bodies by textures along three axes.
pub struct Triplanar {
    ctx: Context,
    target: RenderTarget,
    pipeline: Holder<RenderPipelineHandle>,
    textures: Streamed,
    bodies: Models,
    triangles: Holder<BufferHandle>,
    constants: FrameConstants,
    camera: Camera,
    /// Frames since textures come and go by themselves, if they do.
    turns: Option<u32>,
    _held: ([Holder<BufferHandle>; 2], Holder<SamplerHandle>),
}

/// `Frame` in `shaders/triplanar/frame.glsl`.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct FrameConstants {
    camera: GpuCamera,
    vertices: u64,
    bodies: u64,
    textures: [u32; COUNT],
    sampler: u32,
    body_count: u32,
    phase: f32,
    sharpness: f32,
    by_angles: u32,
}

impl Triplanar {
    /// Makes the bodies, all textures and the pipeline, for pictures of `extent` pixels. The animation stands at its beginning.
    ///
    /// # Errors
    /// [`SampleError`] when the picture is beyond the device, or the device fails.
    pub fn new(ctx: &Context, extent: [u32; 2]) -> Result<Self, SampleError> {
        let target = RenderTarget::with_depth(ctx, extent)?;
        let mut textures = Streamed::new(ctx)?;
        (0..COUNT).for_each(|number| textures.load(number));
        let bodies = Models::new();
        let vertices = array(ctx, "vertices", BufferUsage::STORAGE, &bodies.vertices)?;
        let placed = array(ctx, "bodies", BufferUsage::STORAGE, &bodies.bodies)?;
        let sampler = ctx.create_sampler(&SamplerDesc { max_anisotropy: 8.0, ..SamplerDesc::default() })?;
        let constants = FrameConstants {
            vertices: vertices.address()?,
            bodies: placed.address()?,
            sampler: sampler.index(),
            body_count: bodies.bodies.len() as u32,
            sharpness: 6.0,
            ..FrameConstants::zeroed()
        };
        textures.wait()?;
        Ok(Self {
            ctx: ctx.clone(),
            target,
            pipeline: pipeline(ctx)?,
            textures,
            triangles: array(ctx, "triangles", BufferUsage::INDEX, &bodies.triangles)?,
            bodies,
            constants,
            camera: camera(0.0),
            turns: None,
            _held: ([vertices, placed], sampler),
        })
    }

    /// Names of the textures, in the order of their numbers.
    #[must_use]
    pub fn texture_names() -> [&'static str; COUNT] {
        PAINTED.map(|painted| painted.name)
    }

    /// The state of the texture with this number; textures with larger numbers are unloaded.
    #[must_use]
    pub fn residency(&self, number: usize) -> Residency {
        self.textures.residency(number)
    }

    /// Gives a texture up at once, whatever frames are on their way; from the next frame on the placeholder is shown.
    pub fn unload(&mut self, number: usize) {
        self.textures.unload(number);
    }

    /// Loads an unloaded texture again; frames show the placeholder until the texture is loaded.
    pub fn load(&mut self, number: usize) {
        self.textures.load(number);
    }

    /// Waits for the textures that are coming.
    ///
    /// # Errors
    /// Errors of Vulkan.
    pub fn wait_for_textures(&mut self) -> lvk::Result<()> {
        self.textures.wait()
    }

    fn upload(&self, cmd: &mut CommandBuffer) -> lvk::Result<u64> {
        let [width, height] = self.target.extent();
        let camera = GpuCamera::new(&self.camera, width, height, NEAR_PLANE);
        cmd.upload(&FrameConstants { camera, textures: self.textures.indices(), ..self.constants })
    }

    /// Lets one texture after the other go and come back.
    fn take_turns(&mut self) {
        let Some(frames) = &mut self.turns else { return };
        *frames += 1;
        if frames.is_multiple_of(FRAMES_PER_TURN) {
            let turn = *frames / FRAMES_PER_TURN;
            let number = turn as usize % COUNT;
            self.textures.load((number + COUNT - 1) % COUNT);
            self.textures.unload(number);
        }
    }

    #[cfg(feature = "window")]
    fn texture_switch(&mut self, ui: &mut egui::Ui, number: usize) {
        let residency = self.textures.residency(number);
        ui.horizontal(|ui| match residency {
            Residency::Resident if ui.button("unload").clicked() => self.textures.unload(number),
            Residency::Unloaded if ui.button("load").clicked() => self.textures.load(number),
            Residency::Loading => drop(ui.spinner()),
            _ => {}
        });
    }
}

impl Sample for Triplanar {
    fn context(&self) -> &Context {
        &self.ctx
    }

    fn update(&mut self, time: FrameTime) {
        self.constants.phase = time.phase();
        self.camera = camera(time.phase());
    }

    fn record(&mut self, frame: &mut Frame<'_>) -> Result<TextureHandle, RunError> {
        self.take_turns();
        self.textures.take_in()?;
        let constants = self.upload(&mut frame.cmd)?;
        let nothing = Dependencies::default();
        let mut pass = self.target.begin(&mut frame.cmd, "bodies", BACKDROP, &nothing)?;
        pass.bind_render_pipeline(*self.pipeline)?;
        pass.bind_index_buffer(*self.triangles, 0, IndexFormat::U32)?;
        pass.push_constants(&constants)?;
        for (number, corners) in (0..).zip(&self.bodies.corners) {
            pass.draw_indexed(corners.clone(), 0, number..number + 1)?;
        }
        Ok(self.target.image())
    }

    fn resize(&mut self, extent: [u32; 2]) -> Result<(), RunError> {
        self.target = RenderTarget::with_depth(&self.ctx, extent)?;
        Ok(())
    }

    fn camera_mut(&mut self) -> Option<&mut Camera> {
        Some(&mut self.camera)
    }

    #[cfg(feature = "window")]
    fn panel(&mut self, ui: &mut egui::Ui) {
        egui::Grid::new("textures").show(ui, |ui| {
            for (number, name) in Self::texture_names().into_iter().enumerate() {
                ui.label(name);
                self.texture_switch(ui, number);
                ui.end_row();
            }
        });
        let mut takes_turns = self.turns.is_some();
        if ui.checkbox(&mut takes_turns, "one after the other, by themselves").changed() {
            self.turns = takes_turns.then_some(0);
        }
        ui.add(egui::Slider::new(&mut self.constants.sharpness, 1.0..=32.0).text("sharpness"));
        let mut by_angles = self.constants.by_angles == 1;
        ui.checkbox(&mut by_angles, "by longitude and latitude");
        self.constants.by_angles = by_angles.into();
    }

    fn reload(&mut self) -> Result<(), RunError> {
        self.pipeline = pipeline(&self.ctx)?;
        Ok(())
    }
}

fn pipeline(ctx: &Context) -> lvk::Result<Holder<RenderPipelineHandle>> {
    MODELS.create_with(ctx, &RenderPipelineDesc { cull: CullMode::Back, ..RenderPipelineDesc::default() })
}

/// The camera of the animation at `phase` of the round, 0 to 1.
fn camera(phase: f32) -> Camera {
    let around = 0.25 + 0.35 * (TAU * phase).sin();
    let eye = [6.2 * around.sin(), 2.9, 6.2 * around.cos()];
    Camera::looking_at(eye, [0.0, 0.75, 0.0], 40.0)
}
