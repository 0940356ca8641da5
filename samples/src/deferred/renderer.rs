//! Renders the sample at a frame time.

use crate::app::run_error::RunError;
use crate::app::sample_error::SampleError;
use std::f32::consts::TAU;

use bytemuck::{Pod, Zeroable};
use lvk::{
    BufferHandle, BufferUsage, CommandBuffer, Context, Dependencies, DepthAttachment, Filter, Holder,
    IndexFormat, RenderPass, RenderPassDesc, SamplerDesc, SamplerHandle, TextureHandle,
};

use super::hall::{Hall, MATERIALS};
use super::pipelines::{Draw, Pipelines};
use super::targets::Targets;
use super::{DeferredConfig, Passes};
use crate::app::array_buffer::array;
use crate::app::frame::Frame;
use crate::app::sample::{FrameTime, Sample};
use crate::scene::{Camera, GpuCamera};

/// Distance of the near plane.
const NEAR: f32 = 0.1;

/// Lights the hall.
pub struct Deferred {
    ctx: Context,
    config: DeferredConfig,
    resources: PassResources,
    vertices: Holder<BufferHandle>,
    materials: Holder<BufferHandle>,
    triangles: Holder<BufferHandle>,
    triangle_count: u32,
    nearest: Holder<SamplerHandle>,
    camera: Camera,
    phase: f32,
    power: f32,
    exposure: f32,
}

/// Resources that depend on [`Passes`].
struct PassResources {
    passes: Passes,
    targets: Targets,
    pipelines: Pipelines,
}

impl PassResources {
    fn new(ctx: &Context, passes: Passes, extent: [u32; 2]) -> Result<Self, SampleError> {
        let targets = Targets::new(ctx, passes, extent)?;
        Ok(Self { passes, targets, pipelines: Pipelines::new(ctx, passes)? })
    }
}

/// `Frame` in `shaders/deferred/frame.glsl`.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct FrameConstants {
    camera: GpuCamera,
    vertices: u64,
    materials: u64,
    /// Albedo, normal and light.
    colors: [u32; 3],
    depth: u32,
    nearest: u32,
    light_count: u32,
    view: u32,
    phase: f32,
    power: f32,
    exposure: f32,
}

impl Deferred {
    /// Makes the hall, targets and pipelines. The animation stands at its beginning.
    ///
    /// # Errors
    /// [`SampleError`] when the configuration is beyond the device, or the device fails.
    pub fn new(ctx: &Context, config: &DeferredConfig) -> Result<Self, SampleError> {
        let passes = Passes::choose(config.passes, ctx)?;
        let hall = Hall::new();
        let nearest = SamplerDesc {
            mag_filter: Filter::Nearest,
            min_filter: Filter::Nearest,
            ..SamplerDesc::default()
        };
        Ok(Self {
            ctx: ctx.clone(),
            config: *config,
            resources: PassResources::new(ctx, passes, config.extent)?,
            vertices: array(ctx, "vertices", BufferUsage::STORAGE, &hall.vertices)?,
            materials: array(ctx, "materials", BufferUsage::STORAGE, &MATERIALS)?,
            triangles: array(ctx, "triangles", BufferUsage::INDEX, &hall.triangles)?,
            triangle_count: hall.triangles.len() as u32,
            nearest: ctx.create_sampler(&nearest)?,
            camera: camera(0.0),
            phase: 0.0,
            power: 0.9,
            exposure: 1.6,
        })
    }

    /// The passes of the last frame, or of the first where none was rendered yet.
    pub fn passes(&self) -> Passes {
        self.resources.passes
    }

    /// The next frames go by `passes`, or by what the device has.
    pub fn set_passes(&mut self, passes: Option<Passes>) {
        self.config.passes = passes;
    }

    /// Triangles of the hall.
    pub fn triangle_count(&self) -> u32 {
        self.triangle_count
    }

    fn constants(&self) -> lvk::Result<FrameConstants> {
        let [width, height] = self.config.extent;
        let Targets { colors: [albedo, normal, light, _], depth, .. } = &self.resources.targets;
        Ok(FrameConstants {
            camera: GpuCamera::new(&self.camera, width, height, NEAR),
            vertices: self.vertices.address()?,
            materials: self.materials.address()?,
            colors: [albedo, normal, light].map(|texture| texture.index()),
            depth: depth.index(),
            nearest: self.nearest.index(),
            light_count: self.config.lights,
            view: self.config.view as u32,
            phase: self.phase,
            power: self.power,
            exposure: self.exposure,
        })
    }

    /// All of it in one pass: nothing but the picture is kept.
    fn draw_at_once(&self, cmd: &mut CommandBuffer, constants: u64) -> lvk::Result<()> {
        let mut pass = cmd.begin_rendering(&RenderPassDesc {
            color: &self.resources.targets.begun(0..4),
            depth: Some(self.resources.targets.far_away()),
            local_read: true,
            debug_name: "deferred",
            ..RenderPassDesc::default()
        })?;
        self.draw_solid(&mut pass, constants)?;
        self.draw_light(&mut pass, constants)?;
        self.draw(&mut pass, constants, Draw::Resolve, [3, 1])
    }

    fn surfaces_pass(&self, cmd: &mut CommandBuffer, constants: u64) -> lvk::Result<()> {
        let mut pass = cmd.begin_rendering(&RenderPassDesc {
            color: &self.resources.targets.begun(0..3),
            depth: Some(self.resources.targets.far_away()),
            ..RenderPassDesc::default()
        })?;
        self.draw_solid(&mut pass, constants)
    }

    fn light_pass(&self, cmd: &mut CommandBuffer, constants: u64) -> lvk::Result<()> {
        let Targets { colors: [albedo, normal, ..], depth, .. } = &self.resources.targets;
        let mut pass = cmd.begin_rendering(&RenderPassDesc {
            color: &[self.resources.targets.light()],
            depth: Some(DepthAttachment::read_only(**depth)),
            dependencies: Dependencies {
                sampled_images: &[**albedo, **normal, **depth],
                ..Dependencies::default()
            },
            ..RenderPassDesc::default()
        })?;
        self.draw_light(&mut pass, constants)
    }

    fn picture_pass(&self, cmd: &mut CommandBuffer, constants: u64) -> lvk::Result<()> {
        let Targets { colors: [albedo, normal, light, _], depth, .. } = &self.resources.targets;
        let sampled = [**albedo, **normal, **light, **depth];
        let mut pass = cmd.begin_rendering(&RenderPassDesc {
            color: &self.resources.targets.begun(3..4),
            dependencies: Dependencies { sampled_images: &sampled, ..Dependencies::default() },
            ..RenderPassDesc::default()
        })?;
        self.draw(&mut pass, constants, Draw::Resolve, [3, 1])
    }

    fn draw_solid(&self, pass: &mut RenderPass<'_>, constants: u64) -> lvk::Result<()> {
        pass.bind_render_pipeline(self.resources.pipelines.get(Draw::Surfaces))?;
        pass.push_constants(&constants)?;
        pass.bind_index_buffer(*self.triangles, 0, IndexFormat::U32)?;
        pass.draw_indexed(0..3 * self.triangle_count, 0, 0..1)?;
        self.draw(pass, constants, Draw::Orbs, [4, self.config.lights])
    }

    fn draw_light(&self, pass: &mut RenderPass<'_>, constants: u64) -> lvk::Result<()> {
        self.draw(pass, constants, Draw::Ambient, [3, 1])?;
        self.draw(pass, constants, Draw::Lights, [60, self.config.lights])?;
        self.draw(pass, constants, Draw::Glow, [4, self.config.lights])
    }

    fn draw(
        &self,
        pass: &mut RenderPass<'_>,
        constants: u64,
        draw: Draw,
        [vertices, instances]: [u32; 2],
    ) -> lvk::Result<()> {
        pass.bind_render_pipeline(self.resources.pipelines.get(draw))?;
        pass.push_constants(&constants)?;
        pass.draw(0..vertices, 0..instances)
    }
}

impl Sample for Deferred {
    fn context(&self) -> &Context {
        &self.ctx
    }

    fn update(&mut self, time: FrameTime) {
        self.phase = time.phase();
        self.camera = camera(self.phase);
    }

    fn record(&mut self, frame: &mut Frame<'_>) -> Result<TextureHandle, RunError> {
        let passes = Passes::choose(self.config.passes, &self.ctx)?;
        if passes != self.resources.passes {
            self.resources = PassResources::new(&self.ctx, passes, self.config.extent)?;
        }
        let constants = frame.cmd.upload(&self.constants()?)?;
        match passes {
            Passes::One => frame.pass("one pass", |cmd| self.draw_at_once(cmd, constants))?,
            Passes::Several => {
                frame.pass("surfaces", |cmd| self.surfaces_pass(cmd, constants))?;
                frame.pass("light", |cmd| self.light_pass(cmd, constants))?;
                frame.pass("picture", |cmd| self.picture_pass(cmd, constants))?;
            }
        }
        Ok(self.resources.targets.picture())
    }

    fn resize(&mut self, extent: [u32; 2]) -> Result<(), RunError> {
        self.resources.targets = Targets::new(&self.ctx, self.resources.passes, extent)?;
        self.config.extent = extent;
        Ok(())
    }

    fn camera_mut(&mut self) -> Option<&mut Camera> {
        Some(&mut self.camera)
    }

    #[cfg(feature = "window")]
    fn panel(&mut self, ui: &mut egui::Ui) {
        let there = Passes::supported(&self.ctx);
        if there.len() > 1 {
            let mut passes = self.config.passes.unwrap_or(there[0]);
            ui.horizontal(|ui| {
                ui.radio_value(&mut passes, Passes::One, "one pass");
                ui.radio_value(&mut passes, Passes::Several, "several");
            });
            self.set_passes(Some(passes));
        }
        ui.horizontal_wrapped(|ui| {
            for view in super::View::ALL {
                ui.radio_value(&mut self.config.view, view, format!("{view:?}").to_lowercase());
            }
        });
        let lights = egui::Slider::new(&mut self.config.lights, 1..=DeferredConfig::MAX_LIGHTS);
        ui.add(lights.logarithmic(true).text("lights"));
        ui.add(egui::Slider::new(&mut self.power, 0.0..=4.0).text("power of a light"));
        ui.add(egui::Slider::new(&mut self.exposure, 0.1..=8.0).logarithmic(true).text("exposure"));
    }

    fn reload(&mut self) -> Result<(), RunError> {
        self.resources.pipelines = Pipelines::new(&self.ctx, self.resources.passes)?;
        Ok(())
    }
}

/// The camera of the animation at `phase` of the round, 0 to 1.
fn camera(phase: f32) -> Camera {
    let (sine, cosine) = (TAU * phase).sin_cos();
    Camera::looking_at([1.5 + 0.9 * sine, 1.75, 9.6 + 0.5 * cosine], [-0.55 - 0.5 * sine, 1.95, -12.0], 50.0)
}
