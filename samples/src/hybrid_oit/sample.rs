//! The sample as a type: give it a scene and a time, get a picture.

use crate::app::sample_error::SampleError;
use lvk::{Context, Holder, TextureHandle, TextureRegion};

use super::buffers::Buffers;
use super::config::HybridOitConfig;
use super::frame::{FrameConstants, Numbers, Push};
use super::glass_lists::{GlassLists, NodeUse};
use super::image_passes::ImagePasses;
use super::raster_passes::{PassInputs, RasterPasses};
use super::scene::{OitScene, PERIOD_SECONDS};
use super::shadow_pass::ShadowPass;
use super::structures::Structures;
use super::targets::Targets;
use crate::app::frame::Frame;
use crate::scene::Camera;

/// Renders a scene of blocks, balls and glass. The image depends on the time alone, not on earlier frames.
pub struct HybridOit {
    ctx: Context,
    config: HybridOitConfig,
    buffers: Buffers,
    structures: Structures,
    targets: Targets,
    images: ImagePasses,
    raster: RasterPasses,
    shadows: ShadowPass,
    sphere_count: u32,
    scene: OitScene,
    time: f32,
}

impl HybridOit {
    /// Uploads `scene`, builds what does not move and compiles the pipelines. The time is 0.
    ///
    /// # Errors
    /// [`SampleError`] when the configuration or the scene is beyond the device, or the device fails.
    pub fn new(ctx: &Context, scene: &OitScene, config: &HybridOitConfig) -> Result<Self, SampleError> {
        scene.check()?;
        config.check(ctx.capabilities(), scene.glass.len())?;
        let extent = config.extent();
        let buffers = Buffers::new(ctx, scene, samples(extent), config.nodes())?;
        let structures = Structures::new(ctx, scene, &buffers)?;
        let targets = Targets::new(ctx, extent, [config.width, config.height])?;
        Ok(Self {
            images: ImagePasses::new(ctx)?,
            raster: RasterPasses::new(ctx, scene, &buffers)?,
            shadows: ShadowPass::new(ctx, config.path)?,
            sphere_count: (scene.balls.len() + scene.glass.len()) as u32,
            scene: scene.clone(),
            time: 0.0,
            ctx: ctx.clone(),
            config: *config,
            buffers,
            structures,
            targets,
        })
    }

    /// Puts everything that moves where it is at `seconds`. Times that are not finite count as 0. The animation repeats
    /// itself every [`PERIOD_SECONDS`].
    pub fn update(&mut self, seconds: f64) {
        let time = if seconds.is_finite() { seconds } else { 0.0 };
        self.time = time.rem_euclid(PERIOD_SECONDS) as f32;
    }

    /// Looks at the scene from elsewhere than it says.
    pub fn set_camera(&mut self, camera: &Camera) {
        self.scene.camera = *camera;
    }

    /// The camera.
    #[must_use]
    pub fn camera(&self) -> &Camera {
        &self.scene.camera
    }

    /// The configuration.
    #[must_use]
    pub fn config(&self) -> &HybridOitConfig {
        &self.config
    }

    /// True if the device can render by `config`.
    pub(super) fn can_be(&self, config: &HybridOitConfig) -> bool {
        config.check(self.ctx.capabilities(), self.scene.glass.len()).is_ok()
    }

    /// Renders by another configuration from now on.
    ///
    /// # Errors
    /// [`SampleError`] when that is beyond the device; the configuration is then what it was.
    pub fn change(&mut self, config: &HybridOitConfig) -> Result<(), SampleError> {
        config.check(self.ctx.capabilities(), self.scene.glass.len())?;
        let other_path = config.path != self.config.path;
        let shadows = other_path.then(|| ShadowPass::new(&self.ctx, config.path)).transpose()?;
        let targets = Targets::new(&self.ctx, config.extent(), [config.width, config.height])?;
        self.buffers.resize(&self.ctx, samples(config.extent()), config.nodes())?;
        if let Some(shadows) = shadows {
            self.shadows = shadows;
        }
        (self.targets, self.config) = (targets, *config);
        Ok(())
    }

    /// Renders a frame, waits for it and answers the texture that shows it: 8 bits a channel, sRGB.
    ///
    /// # Errors
    /// [`SampleError::Device`].
    pub fn render(&mut self) -> Result<TextureHandle, SampleError> {
        let mut ignore = |_| {};
        let mut frame = Frame::waited(&self.ctx, &mut ignore)?;
        let picture = self.record(&mut frame)?;
        frame.finish()?;
        Ok(picture)
    }

    /// Records a frame, and answers the texture that shows it: 8 bits a channel, sRGB.
    ///
    /// # Errors
    /// [`SampleError::Device`].
    pub fn record(&mut self, frame: &mut Frame<'_>) -> Result<TextureHandle, SampleError> {
        let push = &Push { frame: frame.cmd.upload(&self.constants()?)?, time: self.time, padding: 0 };
        let Self { buffers, targets, .. } = &*self;
        let (extent, pixels) = (self.config.extent(), [self.config.width, self.config.height]);
        let count = samples(extent);
        frame.pass("animate", |cmd| self.images.record_animate(cmd, buffers, push, self.sphere_count))?;
        frame.pass("build", |cmd| self.structures.record(cmd))?;
        let inputs = PassInputs { targets, buffers, push };
        self.raster.record_depth(&mut frame.cmd, &inputs)?;
        self.raster.record_gbuffer(&mut frame.cmd, &inputs)?;
        frame.pass("shadows", |cmd| self.shadows.record(cmd, targets, buffers, push, extent))?;
        frame.pass("glass lists", |cmd| self.raster.record_glass(cmd, &inputs, count))?;
        frame.pass("composite", |cmd| self.images.record_composite(cmd, targets, buffers, push, pixels))?;
        Ok(*self.targets.picture)
    }

    /// Renders pictures of `extent` pixels from now on.
    ///
    /// # Errors
    /// [`SampleError`] when that is beyond the device; the extent is then what it was.
    pub fn resize(&mut self, [width, height]: [u32; 2]) -> Result<(), SampleError> {
        self.change(&HybridOitConfig { width, height, ..self.config })
    }

    /// Makes all pipelines anew, of shaders that have changed.
    ///
    /// # Errors
    /// [`SampleError::Device`]; the pipelines are then those that were.
    pub fn reload(&mut self) -> Result<(), SampleError> {
        let images = ImagePasses::new(&self.ctx)?;
        let raster = RasterPasses::new(&self.ctx, &self.scene, &self.buffers)?;
        self.shadows = ShadowPass::new(&self.ctx, self.config.path)?;
        (self.images, self.raster) = (images, raster);
        Ok(())
    }

    /// The device.
    #[must_use]
    pub fn context(&self) -> &Context {
        &self.ctx
    }

    /// The texture that shows the last frame.
    #[must_use]
    pub fn texture(&self) -> TextureHandle {
        *self.targets.picture
    }

    /// The last frame: red, green, blue and alpha of each pixel, 8 bits each, sRGB, rows from the top.
    ///
    /// # Errors
    /// [`SampleError::Device`].
    pub fn picture(&self) -> Result<Vec<u8>, SampleError> {
        self.download(&self.targets.picture)
    }

    /// Returns the number of nodes that the glass of the last frame asked for, and the number in the pool.
    ///
    /// # Errors
    /// [`SampleError::Device`].
    pub fn node_use(&self) -> Result<NodeUse, SampleError> {
        let mut asked = [0_u32];
        self.ctx.download_buffer(*self.buffers.node_count, 0, bytemuck::cast_slice_mut(&mut asked))?;
        Ok(NodeUse { asked: asked[0], capacity: self.config.nodes() })
    }

    /// The lists of glass of the last frame, one for each sample.
    ///
    /// # Errors
    /// [`SampleError::Device`].
    pub fn glass_lists(&self) -> Result<GlassLists, SampleError> {
        let NodeUse { asked, capacity } = self.node_use()?;
        let count = samples(self.config.extent()) as usize;
        Ok(GlassLists::read(&self.ctx, &self.buffers, count, asked.min(capacity))?)
    }

    /// Positions of the opaque surface of each sample of the last frame: x, y, z in scene units, and the distance from the
    /// eye, which is 0 where the sky is seen.
    ///
    /// # Errors
    /// [`SampleError::Device`].
    pub fn positions(&self) -> Result<Vec<[f32; 4]>, SampleError> {
        let bytes = self.download(&self.targets.position)?;
        let number = |at: usize| bytes[at..].first_chunk().map_or(0.0, |word| f32::from_le_bytes(*word));
        Ok((0..bytes.len() / 16).map(|texel| [0, 4, 8, 12].map(|at| number(16 * texel + at))).collect())
    }

    /// Share of the sun's red, green and blue that reaches each sample of the last frame (the
    /// fourth number is 1).
    ///
    /// # Errors
    /// [`SampleError::Device`].
    pub fn sunlight(&self) -> Result<Vec<[f32; 4]>, SampleError> {
        let bytes = self.download(&self.targets.shadow)?;
        let number = |at: usize| {
            let bits = bytes[at..].first_chunk().map_or(0, |word| u16::from_le_bytes(*word));
            super::glass_lists::half(bits)
        };
        Ok((0..bytes.len() / 8).map(|texel| [0, 2, 4, 6].map(|at| number(8 * texel + at))).collect())
    }

    fn constants(&self) -> lvk::Result<FrameConstants> {
        let numbers = numbers(&self.scene, &self.config, &self.structures, &self.targets);
        let addresses = self.buffers.addresses()?;
        Ok(FrameConstants::new(&self.scene, self.config.extent(), addresses, numbers))
    }

    fn download(&self, texture: &Holder<TextureHandle>) -> Result<Vec<u8>, SampleError> {
        Ok(self.ctx.download_texture(**texture, &TextureRegion::default())?)
    }
}

fn samples([width, height]: [u32; 2]) -> u64 {
    u64::from(width) * u64::from(height)
}

fn numbers(
    scene: &OitScene,
    config: &HybridOitConfig,
    structures: &Structures,
    targets: &Targets,
) -> Numbers {
    Numbers {
        ball_count: scene.balls.len() as u32,
        glass_count: scene.glass.len() as u32,
        block_count: scene.blocks.len() as u32,
        node_capacity: config.nodes(),
        shadow_rays: config.shadow_rays,
        supersampling: config.supersampling,
        tlas: structures.tlas.index(),
        gbuffer_position: targets.position.index(),
        gbuffer_surface: targets.surface.index(),
        shadow_image: targets.shadow.index(),
        shadow_texture: targets.shadow.index(),
        output: targets.picture.index(),
    }
}
