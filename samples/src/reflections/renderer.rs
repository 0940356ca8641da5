//! Renders the sample at a frame time.

use crate::app::run_error::RunError;
use crate::app::sample_error::SampleError;
use lvk::{
    AddressMode, CommandBuffer, Context, Format, Holder, SamplerDesc, SamplerHandle, TextureDesc,
    TextureHandle,
};

use super::animation::{Animation, AnimationPasses};
use super::config::ReflectionsConfig;
use super::frame::{FrameConstants, Indices, NEAR_PLANE, WorldConstants, light_constants};
use super::gpu_scene::{GeometryArena, GpuScene};
use super::image_passes::ImagePasses;
#[cfg(feature = "window")]
use super::panel;
use super::procedural_textures::Picture;
use super::raster_passes::{Drawn, RasterPasses};
use super::ray_passes::{RayPasses, Surfaces};
use super::scene::{self, HallScene};
use super::sky_light::harmonics;
use super::targets::Targets;
use super::top_level::{InstanceCount, TopLevel};
use crate::app::frame::Frame;
use crate::app::pass_times::PassTimes;
use crate::app::sample::{FrameTime, Sample};
use crate::app::scene_textures;
use crate::app::ui::PendingSettings;
use crate::scene::{Camera, GpuCamera};

/// Names of the build of the top-level structure and of the ray passes. The transparent rays come first: the memory of
/// their g-buffer then serves the textures of the opaque ones.
pub(super) const TLAS_BUILD: &str = "TLAS build";
pub(super) const RAYS: [&str; 2] = ["transparent rays", "opaque rays"];

/// Texels on an edge of the sky's cube map.
const SKY_SIZE: u32 = 256;

/// Renders the hall. All pipelines are made by [`new`](Self::new).
pub struct Reflections {
    ctx: Context,
    config: ReflectionsConfig,
    gpu_scene: GpuScene,
    animation: Animation,
    moving_passes: AnimationPasses,
    top_level: TopLevel,
    targets: Targets,
    raster: RasterPasses,
    rays: RayPasses,
    images: ImagePasses,
    constants: WorldConstants,
    indices: Indices,
    camera: Camera,
    phase: f32,
    wanted: PendingSettings<ReflectionsConfig>,
    _held: (Vec<Holder<TextureHandle>>, [Holder<SamplerHandle>; 2]),
}

impl Reflections {
    /// Makes the hall, its structures and all pipelines. The animation stands at its beginning.
    ///
    /// # Errors
    /// [`SampleError`] when the configuration is beyond the device, or the device fails.
    pub fn new(ctx: &Context, config: &ReflectionsConfig) -> Result<Self, SampleError> {
        config.check(ctx.capabilities())?;
        let extent = [config.width, config.height];
        let world = HallScene::new();
        let mut textures = upload_textures(ctx, &world)?;
        let mut arena = GeometryArena::from_models(&world.models);
        let animation = Animation::new(ctx, &mut arena, world.leaf_count)?;
        let buffers = arena.upload(ctx)?;
        let handles = [*buffers[0], *buffers[1]];
        let gpu_scene = GpuScene::new(ctx, &world, &arena, buffers, &animation, &textures)?;
        let moving_passes = AnimationPasses::new(ctx, &animation, handles[1], config.skin_update)?;
        let top_level = TopLevel::new(ctx, &world, &arena, handles, &moving_passes)?;
        let targets = Targets::new(ctx, extent)?;
        let samplers = [
            sampler(ctx, "surface sampler", AddressMode::Repeat)?,
            sampler(ctx, "sky sampler", AddressMode::ClampToEdge)?,
        ];
        let sky = scene_textures::sky(ctx, &world.sky, SKY_SIZE)?;
        let mut indices = Indices {
            tlas: top_level.tlas.index(),
            sky: sky.index(),
            surface_sampler: samplers[0].index(),
            sky_sampler: samplers[1].index(),
            ..bytemuck::Zeroable::zeroed()
        };
        targets.name_in(&mut indices);
        textures.push(sky);
        Ok(Self {
            constants: world_constants(&world, &gpu_scene),
            raster: RasterPasses::new(ctx)?,
            rays: RayPasses::new(ctx, config.path)?,
            images: ImagePasses::new(ctx)?,
            ctx: ctx.clone(),
            config: *config,
            gpu_scene,
            animation,
            moving_passes,
            top_level,
            targets,
            indices,
            camera: scene::camera(0.0),
            phase: 0.0,
            wanted: PendingSettings::new(*config),
            _held: (textures, samplers),
        })
    }

    /// Moves the camera and all moving objects to their positions at `phase` of the animation's round: 0 to 1, beyond
    /// which it goes round again. A phase that is not finite counts as 0. Nothing depends on earlier phases.
    pub fn show(&mut self, phase: f32) {
        self.phase = if phase.is_finite() { phase.rem_euclid(1.0) % 1.0 } else { 0.0 };
        self.camera = scene::camera(self.phase);
    }

    /// Looks from another place than the animation's, until the next [`show`](Self::show).
    pub fn set_camera(&mut self, camera: &Camera) {
        self.camera = *camera;
    }

    /// GPU times of the passes of the first sample, where instances seen under less than `min_angle` are culled;
    /// none where the device has no timestamps.
    pub(super) fn time_sample(&self, min_angle: f32) -> Result<PassTimes, SampleError> {
        let mut ignore = |_| {};
        let mut frame = Frame::waited(&self.ctx, &mut ignore)?;
        self.record_sample(&mut frame, 0, min_angle)?;
        Ok(frame.finish()?)
    }

    /// The texture that shows the last picture.
    pub fn picture(&self) -> TextureHandle {
        *self.targets.picture
    }

    /// Number of instances in the TLAS at the current camera.
    pub fn instance_count(&self) -> InstanceCount {
        self.top_level.count(self.camera.eye.into(), self.config.min_angle)
    }

    /// The configuration.
    pub fn config(&self) -> &ReflectionsConfig {
        &self.config
    }

    /// Settings of the panel, which take effect with the next frame.
    pub fn wanted(&mut self) -> &mut ReflectionsConfig {
        &mut self.wanted.config
    }

    /// Renders by another configuration from now on; by the old one where this fails.
    fn change(&mut self, config: ReflectionsConfig) -> Result<(), SampleError> {
        config.check(self.ctx.capabilities())?;
        let (ctx, before, extent) = (&self.ctx, self.config, [config.width, config.height]);
        let rays = (config.path != before.path).then(|| RayPasses::new(ctx, config.path)).transpose()?;
        let targets = (extent != [before.width, before.height]).then(|| Targets::new(ctx, extent));
        if let Some(targets) = targets.transpose()? {
            self.targets = targets;
            self.targets.name_in(&mut self.indices);
        }
        if let Some(rays) = rays {
            self.rays = rays;
        }
        self.moving_passes.set_skin_update(config.skin_update);
        self.config = config;
        Ok(())
    }

    fn upload_constants(&self, cmd: &mut CommandBuffer, sample_number: u32) -> lvk::Result<u64> {
        let ReflectionsConfig { width, height, samples, .. } = self.config;
        let view = GpuCamera::new(&self.camera, width, height, NEAR_PLANE);
        cmd.upload(&FrameConstants {
            view: view.for_sample(sample_number, samples),
            world: self.constants,
            frame_number: (self.phase * 16_777_216.0) as u32,
            sample_number,
            phase: self.phase,
            indices: self.indices,
        })
    }

    fn record_sample(&self, to: &mut Frame<'_>, sample: u32, min_angle: f32) -> lvk::Result<()> {
        let frame = self.upload_constants(&mut to.cmd, sample)?;
        let extent = [self.config.width, self.config.height];
        let eye = self.camera.eye.into();
        if sample == 0 {
            let move_all = |cmd: &mut _| self.moving_passes.record(cmd, &self.animation, self.phase, frame);
            to.pass("skinning and its builds", move_all)?;
            to.pass(TLAS_BUILD, |cmd| self.top_level.record(cmd, eye, min_angle))?;
        }
        let (written, transparent) = (self.animation.written(), self.gpu_scene.transparent(eye));
        let drawn = Drawn {
            indices: *self.gpu_scene.indices,
            opaque: &self.gpu_scene.opaque,
            transparent: &transparent,
            written: &written,
            frame,
        };
        to.pass("g-buffers", |cmd| self.raster.record_surfaces(cmd, &self.targets, drawn))?;
        for (name, surfaces) in RAYS.into_iter().zip([Surfaces::Transparent, Surfaces::Opaque]) {
            let rays = &self.rays;
            to.pass(name, |cmd| rays.record(cmd, surfaces, extent, &self.targets, &written, frame))?;
        }
        to.pass("filters to picture", |cmd| {
            self.images.record_composite(cmd, &self.targets, frame)?;
            self.raster.record_blend(cmd, &self.targets, drawn)?;
            self.images.record_resolve(cmd, &self.targets, frame, self.config.samples)
        })
    }
}

impl Sample for Reflections {
    fn context(&self) -> &Context {
        &self.ctx
    }

    fn update(&mut self, time: FrameTime) {
        self.show(time.phase());
    }

    /// A step for each sample.
    fn record(&mut self, frame: &mut Frame<'_>) -> Result<TextureHandle, RunError> {
        if let Some(config) = self.wanted.changed_from(self.config) {
            let done = self.change(config);
            self.wanted.finish(done, self.config);
        }
        for sample in 0..self.config.samples {
            if sample > 0 {
                frame.next_step()?;
            }
            self.record_sample(frame, sample, self.config.min_angle)?;
        }
        Ok(*self.targets.picture)
    }

    fn steps_per_frame(&self) -> u64 {
        self.config.samples.into()
    }

    fn resize(&mut self, [width, height]: [u32; 2]) -> Result<(), RunError> {
        self.change(ReflectionsConfig { width, height, ..self.config })?;
        (self.wanted.config.width, self.wanted.config.height) = (width, height);
        Ok(())
    }

    fn view(&mut self) -> Option<Camera> {
        Some(self.camera)
    }

    fn set_view(&mut self, camera: &Camera) {
        self.set_camera(camera);
    }

    #[cfg(feature = "window")]
    fn panel(&mut self, ui: &mut egui::Ui) {
        let capabilities = self.ctx.capabilities();
        self.wanted.show(ui, |ui, config| panel::show_settings(ui, config, capabilities));
        // Nothing is made anew for this one.
        self.config.min_angle = self.wanted.config.min_angle;
        let InstanceCount { kept, total } = self.instance_count();
        ui.label(format!("rays meet {kept} of {total} instances"));
    }

    fn reload(&mut self) -> Result<(), RunError> {
        let (raster, images) = (RasterPasses::new(&self.ctx)?, ImagePasses::new(&self.ctx)?);
        let rays = RayPasses::new(&self.ctx, self.config.path)?;
        self.moving_passes.reload(&self.ctx)?;
        (self.raster, self.rays, self.images) = (raster, rays, images);
        Ok(())
    }
}

fn world_constants(world: &HallScene, gpu_scene: &GpuScene) -> WorldConstants {
    let (lights, light_count) = light_constants(&world.lights);
    WorldConstants {
        materials: gpu_scene.materials,
        geometries: gpu_scene.geometries,
        instances: gpu_scene.instances,
        lights,
        harmonics: harmonics(&world.sky),
        light_count,
    }
}

fn upload_textures(ctx: &Context, world: &HallScene) -> lvk::Result<Vec<Holder<TextureHandle>>> {
    let upload = |picture: &Picture| {
        ctx.create_texture(&TextureDesc {
            format: Format::Rgba8Srgb,
            extent: [picture.size; 2],
            mips: 0,
            data: Some(&picture.pixels),
            generate_mips: true,
            debug_name: "painted texture",
            ..TextureDesc::default()
        })
    };
    world.textures.iter().map(upload).collect()
}

fn sampler(ctx: &Context, debug_name: &str, address: AddressMode) -> lvk::Result<Holder<SamplerHandle>> {
    ctx.create_sampler(&SamplerDesc {
        address: [address; 3],
        max_anisotropy: 8.0,
        debug_name,
        ..SamplerDesc::default()
    })
}
