//! The sample as a type: give it a scene and a camera, get a picture.

use std::ops::Range;

use lvk::{
    BufferDesc, BufferHandle, CommandBuffer, Context, Format, Holder, TextureDesc, TextureHandle,
    TextureRegion, TextureUsage,
};

use super::HybridError;
use super::bands::bands;
use super::config::{Geometry, HybridConfig, Method, Raster};
use super::frame::{FrameConstants, Indices, Lighting, Push, VisibilityPlaces, near_plane};
use super::frame_timings::{FrameTimings, Stamps};
use super::geometry_pass::GeometryPass;
use super::gpu_scene::GpuScene;
use super::raster_choice::RasterChoice;
use super::ray_pass::{GeometryLeft, RayPass};
use super::visibility_pass::VisibilityPass;
use crate::scene::{Camera, GpuCamera, Scene};

/// Rows that a CPU renders in one go: short enough to show progress, long enough to keep every core busy.
const CPU_BAND_ROWS: u32 = 48;
/// Pixels that a GPU renders in one go: so few that no driver takes it for hung.
const GPU_BAND_PIXELS: u32 = 1 << 23;

/// Geometry passes by each rasteriser that decide which one is taken.
const MEASURED_FRAMES: u32 = 4;

/// What comes before the ray pass.
enum GeometryStage {
    None,
    Paper(GeometryPass),
    Visibility(Box<VisibilityPass>),
}

/// Renders a scene by one method and one path of ray tracing.
pub struct HybridRenderer {
    ctx: Context,
    config: HybridConfig,
    scene: GpuScene,
    geometry: GeometryStage,
    rays: RayPass,
    stamps: Option<Stamps>,
    output: Holder<TextureHandle>,
    frame_buffer: Holder<BufferHandle>,
    frame_address: u64,
    uploaded: Option<FrameConstants>,
    lighting: Lighting,
    indices: Indices,
    near_plane: f32,
    bands: Vec<Range<u32>>,
}

impl HybridRenderer {
    /// Uploads `scene`, builds its acceleration structures and compiles the pipelines.
    ///
    /// # Errors
    /// [`HybridError`] when the configuration or the scene is beyond the device, or the device fails.
    pub fn new(ctx: &Context, scene: &Scene, config: &HybridConfig) -> Result<Self, HybridError> {
        config.check(ctx.capabilities())?;
        let extent = [config.width, config.height];
        let gpu_scene = GpuScene::new(ctx, scene)?;
        let frame_buffer = frame_buffer(ctx)?;
        let output = output(ctx, extent)?;
        let geometry = GeometryStage::new(ctx, &gpu_scene, config)?;
        let rays = RayPass::new(ctx, config, *output)?;
        let bands = bands(config.height, band_rows(config, ctx.capabilities().is_cpu));
        let has_stamps = ctx.capabilities().limits.timestamp_bits > 0;
        let stamps = has_stamps.then(|| Stamps::new(ctx, bands.len() as u32)).transpose()?;
        Ok(Self {
            indices: indices(&gpu_scene, &geometry, output.index()),
            frame_address: ctx.buffer_address(*frame_buffer)?,
            uploaded: None,
            lighting: Lighting::new(scene),
            near_plane: near_plane(scene),
            ctx: ctx.clone(),
            config: *config,
            scene: gpu_scene,
            geometry,
            rays,
            stamps,
            output,
            frame_buffer,
            bands,
        })
    }

    /// Puts the lamp at `position`, in scene units, from the next frame on.
    pub fn move_lamp(&mut self, position: [f32; 3]) {
        self.lighting.move_lamp(position);
    }

    /// Renders one frame and waits for it.
    ///
    /// # Errors
    /// [`HybridError::Device`].
    pub fn render(&mut self, camera: &Camera) -> Result<FrameTimings, HybridError> {
        self.render_with(camera, &mut |_| {})
    }

    /// Renders one frame, a band of rows after the other, and calls `after_band` with the number of bands done.
    ///
    /// # Errors
    /// [`HybridError::Device`].
    pub fn render_with(
        &mut self,
        camera: &Camera,
        after_band: &mut dyn FnMut(u64),
    ) -> Result<FrameTimings, HybridError> {
        self.upload_constants(camera)?;
        for band in 0..self.bands.len() {
            let mut cmd = self.ctx.acquire_command_buffer()?;
            if band == 0 {
                self.begin_frame(&mut cmd)?;
            }
            self.record_band(&mut cmd, band)?;
            let submitted = self.ctx.submit(cmd)?;
            self.ctx.wait(submitted)?;
            after_band(band as u64 + 1);
        }
        let has_geometry = !matches!(self.geometry, GeometryStage::None);
        let read = |stamps: &Stamps| stamps.read(&self.ctx, has_geometry);
        Ok(self.stamps.as_ref().map(read).transpose()?.unwrap_or_default())
    }

    /// Measures the geometry pass by each rasteriser that there is, where the configuration leaves the choice, and
    /// takes the faster one from now on. Returns which one is in use and why; `None` where no visibility is rasterised.
    ///
    /// # Errors
    /// [`HybridError::Device`].
    pub fn choose_raster(&mut self, camera: &Camera) -> Result<Option<RasterChoice>, HybridError> {
        if let GeometryStage::Visibility(pass) = &self.geometry
            && pass.has_both()
        {
            let compute = self.measure_raster(camera, Raster::Compute)?;
            let hardware = self.measure_raster(camera, Raster::Hardware)?;
            self.geometry.choose(RasterChoice::by_time(&compute, &hardware));
        }
        Ok(self.geometry.choice())
    }

    /// The last frame: red, green, blue and alpha of each pixel, 8 bits each, sRGB, rows from the top.
    ///
    /// # Errors
    /// [`HybridError::Device`].
    pub fn read_image(&self) -> Result<Vec<u8>, HybridError> {
        Ok(self.ctx.download_texture(*self.output, &TextureRegion::default())?)
    }

    /// How many bands a frame is rendered in.
    pub fn band_count(&self) -> u64 {
        self.bands.len() as u64
    }

    /// Milliseconds that building the bottom-level acceleration structures took, submission and wait included.
    pub fn blas_build_ms(&self) -> f64 {
        self.scene.blas_build_ms
    }

    /// How many bottom-level acceleration structures the scene has.
    pub fn blas_count(&self) -> usize {
        self.scene.blas_count()
    }

    /// Of how many parts these consist: more than there are structures where the device, or the profile, sets limits
    /// that the scene exceeds.
    pub fn blas_part_count(&self) -> u32 {
        self.scene.blas_part_count
    }

    fn upload_constants(&mut self, camera: &Camera) -> lvk::Result<()> {
        let constants = FrameConstants {
            camera: GpuCamera::new(camera, self.config.width, self.config.height, self.near_plane),
            scene: self.scene.addresses(),
            lighting: self.lighting,
            indices: self.indices,
            visibility: self.geometry.places(),
        };
        if self.uploaded != Some(constants) {
            self.ctx.upload_buffer(*self.frame_buffer, 0, bytemuck::bytes_of(&constants))?;
            self.uploaded = Some(constants);
        }
        Ok(())
    }

    /// Milliseconds of some geometry passes by `raster`; none where the device has no timestamps.
    fn measure_raster(&mut self, camera: &Camera, raster: Raster) -> lvk::Result<Vec<f64>> {
        self.geometry.choose(RasterChoice { raster, why: String::new() });
        let mut times = Vec::new();
        for _ in 0..MEASURED_FRAMES {
            self.upload_constants(camera)?;
            let mut cmd = self.ctx.acquire_command_buffer()?;
            self.begin_frame(&mut cmd)?;
            let submitted = self.ctx.submit(cmd)?;
            self.ctx.wait(submitted)?;
            let Some(stamps) = &self.stamps else { break };
            times.push(stamps.read_geometry(&self.ctx)?);
        }
        Ok(times)
    }

    fn begin_frame(&self, cmd: &mut CommandBuffer) -> lvk::Result<()> {
        if let Some(stamps) = &self.stamps {
            stamps.reset(cmd)?;
            stamps.geometry(cmd, false)?;
        }
        self.geometry.record(cmd, &self.push(0..self.config.height))?;
        self.stamps.as_ref().map_or(Ok(()), |stamps| stamps.geometry(cmd, true))
    }

    fn record_band(&self, cmd: &mut CommandBuffer, band: usize) -> lvk::Result<()> {
        let stamp = |cmd: &mut CommandBuffer, end| {
            self.stamps.as_ref().map_or(Ok(()), |stamps| stamps.band(cmd, band as u32, end))
        };
        stamp(cmd, false)?;
        let push = self.push(self.bands[band].clone());
        self.rays.record(cmd, self.config.width, &push, &self.geometry.left())?;
        stamp(cmd, true)
    }

    fn push(&self, rows: Range<u32>) -> Push {
        Push { frame: self.frame_address, first_row: rows.start, end_row: rows.end }
    }
}

impl GeometryStage {
    fn new(ctx: &Context, scene: &GpuScene, config: &HybridConfig) -> lvk::Result<Self> {
        Ok(match (config.method, config.geometry) {
            (Method::Standalone, _) => Self::None,
            (Method::Hybrid, Geometry::Paper) => {
                Self::Paper(GeometryPass::new(ctx, scene, [config.width, config.height])?)
            }
            (Method::Hybrid, Geometry::Visibility(wish)) => {
                Self::Visibility(Box::new(VisibilityPass::new(ctx, scene.triangle_count, config, wish)?))
            }
        })
    }

    fn record(&self, cmd: &mut CommandBuffer, push: &Push) -> lvk::Result<()> {
        match self {
            Self::None => Ok(()),
            Self::Paper(pass) => pass.record(cmd, push),
            Self::Visibility(pass) => pass.record(cmd, push),
        }
    }

    fn left(&self) -> GeometryLeft {
        match self {
            Self::None => GeometryLeft::default(),
            Self::Paper(pass) => {
                GeometryLeft { textures: pass.targets.textures().to_vec(), buffers: Vec::new() }
            }
            Self::Visibility(pass) => GeometryLeft { textures: pass.textures(), buffers: pass.buffers() },
        }
    }

    fn places(&self) -> VisibilityPlaces {
        match self {
            Self::Visibility(pass) => pass.places(),
            _ => bytemuck::Zeroable::zeroed(),
        }
    }

    fn choose(&mut self, choice: RasterChoice) {
        if let Self::Visibility(pass) = self {
            pass.choose(choice);
        }
    }

    fn choice(&self) -> Option<RasterChoice> {
        match self {
            Self::Visibility(pass) => Some(pass.choice()),
            _ => None,
        }
    }
}

fn band_rows(config: &HybridConfig, is_cpu: bool) -> u32 {
    if is_cpu { CPU_BAND_ROWS } else { GPU_BAND_PIXELS / config.width }
}

fn frame_buffer(ctx: &Context) -> lvk::Result<Holder<BufferHandle>> {
    let size_bytes = size_of::<FrameConstants>() as u64;
    ctx.create_buffer(&BufferDesc { size_bytes, debug_name: "frame constants", ..BufferDesc::default() })
}

fn output(ctx: &Context, extent: [u32; 2]) -> lvk::Result<Holder<TextureHandle>> {
    ctx.create_texture(&TextureDesc {
        format: Format::Rgba8Unorm,
        extent,
        usage: TextureUsage::STORAGE,
        debug_name: "picture",
        ..TextureDesc::default()
    })
}

fn indices(scene: &GpuScene, geometry: &GeometryStage, output: u32) -> Indices {
    let mut indices = Indices {
        tlas: scene.tlas.index(),
        sky: scene.sky.index(),
        surface_sampler: scene.surface_sampler.index(),
        sky_sampler: scene.sky_sampler.index(),
        output,
        ..bytemuck::Zeroable::zeroed()
    };
    if let GeometryStage::Paper(pass) = geometry {
        pass.targets.name_in(&mut indices);
    }
    indices
}
