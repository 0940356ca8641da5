//! The sample as a type: a renderer of a scene and a camera.

use crate::app::sample_error::SampleError;
use lvk::{Capabilities, CommandBuffer, Context, TextureHandle, TextureRegion};

use super::config::{Bounces, HybridConfig, Method, Raster};
use super::frame::{Lighting, near_plane};
use super::frame_passes::FramePasses;
use super::frame_timings::{FrameTimings, GEOMETRY, RAYS};
use super::gpu_scene::{GpuScene, HitGroups};
use super::raster_choice::RasterChoice;
use crate::app::frame::Frame;
use crate::scene::{Camera, GpuCamera, Scene};

/// Geometry passes by each rasteriser whose times the choice tells.
const MEASURED_FRAMES: u32 = 4;

/// Renders a scene by one method and one path of ray tracing.
pub struct HybridRenderer {
    ctx: Context,
    config: HybridConfig,
    scene: GpuScene,
    passes: FramePasses,
    lighting: Lighting,
    near_plane: f32,
}

impl HybridRenderer {
    /// Uploads `scene`, builds its acceleration structures and compiles the pipelines.
    ///
    /// # Errors
    /// [`SampleError`] when the configuration or the scene is beyond the device, or the device fails.
    pub fn new(ctx: &Context, scene: &Scene, config: &HybridConfig) -> Result<Self, SampleError> {
        config.check(ctx.capabilities())?;
        let config = valid_for(config, scene, ctx.capabilities());
        let gpu_scene = GpuScene::new(ctx, scene, HitGroups::default())?;
        Ok(Self {
            passes: FramePasses::new(ctx, &gpu_scene, &config)?,
            lighting: Lighting::new(scene),
            near_plane: near_plane(scene),
            ctx: ctx.clone(),
            config,
            scene: gpu_scene,
        })
    }

    /// Puts the lamp at `position`, in scene units, from the next frame on.
    pub fn move_lamp(&mut self, position: [f32; 3]) {
        self.lighting.move_lamp(position);
    }

    /// Renders one frame and waits for it.
    ///
    /// # Errors
    /// [`SampleError::Device`].
    pub fn render(&mut self, camera: &Camera) -> Result<FrameTimings, SampleError> {
        let mut ignore = |_| {};
        let mut frame = Frame::waited(&self.ctx, &mut ignore)?;
        self.record(&mut frame, camera)?;
        Ok(FrameTimings::from_pass_times(&frame.finish()?))
    }

    /// Records a frame, a step for each tile of rows of each sample, and answers the texture that shows it: 8 bits a
    /// channel, sRGB.
    ///
    /// # Errors
    /// [`SampleError::Device`].
    pub fn record(&mut self, frame: &mut Frame<'_>, camera: &Camera) -> Result<TextureHandle, SampleError> {
        for sample in 0..self.config.samples {
            for tile in 0..self.passes.launch_tiles.len() {
                if (sample, tile) != (0, 0) {
                    frame.next_step()?;
                }
                let address = self.upload_constants(&mut frame.cmd, camera, sample)?;
                if tile == 0 && self.config.method == Method::Hybrid {
                    frame.pass(GEOMETRY, |cmd| self.passes.record_geometry(cmd, address))?;
                }
                frame.pass(RAYS, |cmd| self.passes.record_tile(cmd, address, tile))?;
            }
        }
        Ok(*self.passes.accumulation.picture)
    }

    /// Renders pictures of `extent` pixels from now on.
    ///
    /// # Errors
    /// [`SampleError`] when that is beyond the device; the extent is then what it was.
    pub fn resize(&mut self, [width, height]: [u32; 2]) -> Result<(), SampleError> {
        self.change(&HybridConfig { width, height, ..self.config })
    }

    /// The configuration with all its open choices decided.
    pub fn config(&self) -> &HybridConfig {
        &self.config
    }

    /// Renders by another configuration from now on.
    ///
    /// # Errors
    /// [`SampleError`] when that is beyond the device; the configuration is then what it was.
    pub fn change(&mut self, config: &HybridConfig) -> Result<(), SampleError> {
        config.check(self.ctx.capabilities())?;
        self.make_passes(*config)
    }

    /// Makes all pipelines anew, of shaders that have changed.
    ///
    /// # Errors
    /// [`SampleError::Device`]; the pipelines are then those that were.
    pub fn reload(&mut self) -> Result<(), SampleError> {
        self.make_passes(self.config)
    }

    fn make_passes(&mut self, config: HybridConfig) -> Result<(), SampleError> {
        let mut passes = FramePasses::new(&self.ctx, &self.scene, &config)?;
        if let Some(choice) = self.passes.geometry.choice() {
            passes.geometry.choose(choice);
        }
        (self.passes, self.config) = (passes, config);
        Ok(())
    }

    /// Measures the geometry pass by each rasteriser, where the configuration leaves the choice and the device has both.
    /// [`Self::raster_choice`] has both times from now on.
    ///
    /// # Errors
    /// [`SampleError::Device`].
    pub fn measure_rasters(&mut self, camera: &Camera) -> Result<(), SampleError> {
        if self.passes.geometry.has_both() {
            let compute = self.measure_raster(camera, Raster::Compute)?;
            let hardware = self.measure_raster(camera, Raster::Hardware)?;
            self.passes.geometry.choose(RasterChoice::compute(&compute, &hardware));
        }
        Ok(())
    }

    /// Returns the rasteriser in use and why; `None` where no visibility is rasterised.
    pub fn raster_choice(&self) -> Option<RasterChoice> {
        self.passes.geometry.choice()
    }

    /// The rasteriser in use, where visible triangles are rasterised.
    pub(super) fn raster(&self) -> Option<Raster> {
        self.raster_choice().map(|choice| choice.raster)
    }

    /// True if another one could be.
    pub(super) fn can_choose_raster(&self) -> bool {
        self.passes.geometry.has_both()
    }

    /// Takes a rasteriser, which must be there, from the next frame on.
    pub(super) fn take_raster(&mut self, raster: Raster) {
        self.passes.geometry.choose(RasterChoice { raster, why: "as asked for".to_owned() });
    }

    /// The texture that shows the last frame.
    pub fn picture(&self) -> TextureHandle {
        *self.passes.accumulation.picture
    }

    /// The last frame: red, green, blue and alpha of each pixel, 8 bits each, sRGB, rows from the top.
    ///
    /// # Errors
    /// [`SampleError::Device`].
    pub fn read_image(&self) -> Result<Vec<u8>, SampleError> {
        Ok(self.ctx.download_texture(*self.passes.accumulation.picture, &TextureRegion::default())?)
    }

    /// Number of launches of a frame, over all samples.
    pub fn tile_count(&self) -> u64 {
        self.passes.launch_tiles.len() as u64 * u64::from(self.config.samples)
    }

    /// Milliseconds that building the bottom-level acceleration structures took, submission and wait included.
    pub fn blas_build_ms(&self) -> f64 {
        self.scene.blas_build_ms
    }

    /// Number of BLASes of the scene.
    pub fn blas_count(&self) -> usize {
        self.scene.blas_count()
    }

    /// Returns the number of parts of the BLASes. It is larger than their number where limits of the device or the profile
    /// are below the scene's size.
    pub fn blas_part_count(&self) -> u32 {
        self.scene.blas_part_count
    }

    /// The device.
    pub fn context(&self) -> &Context {
        &self.ctx
    }

    fn upload_constants(&self, cmd: &mut CommandBuffer, camera: &Camera, sample: u32) -> lvk::Result<u64> {
        let HybridConfig { width, height, samples, .. } = self.config;
        let view = GpuCamera::new(camera, width, height, self.near_plane);
        cmd.upload(&self.passes.constants(&view, &self.scene, self.lighting, [sample, samples]))
    }

    /// Milliseconds of some geometry passes by `raster`; none where the device has no timestamps.
    fn measure_raster(&mut self, camera: &Camera, raster: Raster) -> lvk::Result<Vec<f64>> {
        self.passes.geometry.choose(RasterChoice { raster, why: String::new() });
        let mut times = Vec::new();
        for _ in 0..MEASURED_FRAMES {
            let mut ignore = |_| {};
            let mut frame = Frame::waited(&self.ctx, &mut ignore)?;
            let address = self.upload_constants(&mut frame.cmd, camera, 0)?;
            frame.pass(GEOMETRY, |cmd| self.passes.record_geometry(cmd, address))?;
            let took = frame.finish()?;
            if took.is_empty() {
                break;
            }
            times.push(took.ms(&[GEOMETRY]));
        }
        Ok(times)
    }
}

/// The configuration with what it leaves open decided, and without bounces where nothing mirrors or refracts.
fn valid_for(config: &HybridConfig, scene: &Scene, capabilities: &Capabilities) -> HybridConfig {
    // A CPU driver takes seconds to compile each shader that traces, and a second one saves it no time in a frame.
    let suits =
        if config.knows_triangles() && !capabilities.is_cpu { Bounces::First } else { Bounces::Inline };
    HybridConfig {
        max_depth: if goes_on(scene) { config.max_depth } else { 0 },
        bounces: Some(config.bounces.unwrap_or(suits)),
        ..*config
    }
}

/// True if anything in the scene mirrors or refracts.
pub(super) fn goes_on(scene: &Scene) -> bool {
    scene.materials.iter().any(|material| material.reflectivity > 0.0 || material.is_refractive())
}
