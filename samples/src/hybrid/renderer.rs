//! The sample as a type: give it a scene and a camera, get a picture.

use std::ops::Range;

use lvk::{
    BufferDesc, BufferHandle, Capabilities, CommandBuffer, Context, Holder, TextureHandle, TextureRegion,
};

use super::HybridError;
use super::bands::bands;
use super::config::{Bounces, Geometry, HybridConfig, Method, Raster, RayPath};
use super::film::Film;
use super::frame::{
    BouncePlaces, FRAME_BYTES, FrameConstants, Indices, Lighting, Push, VisibilityPlaces, near_plane,
};
use super::frame_timings::{FrameTimings, Stamps};
use super::geometry_pass::GeometryPass;
use super::gpu_scene::GpuScene;
use super::pixel_order::PixelOrder;
use super::raster_choice::RasterChoice;
use super::ray_pass::{GeometryLeft, RayPass};
use super::visibility_pass::VisibilityPass;
use crate::scene::{Camera, GpuCamera, Scene};

/// Rows that a CPU renders in one go: short enough to show progress, long enough to keep every core busy.
const CPU_BAND_ROWS: u32 = 48;
/// Pixels that a GPU renders in one go: so few that no driver takes it for hung.
const GPU_BAND_PIXELS: u32 = 1 << 23;

/// Geometry passes by each rasteriser whose times the choice tells.
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
    order: Option<PixelOrder>,
    rays: RayPass,
    stamps: Option<Stamps>,
    film: Film,
    sums_address: u64,
    bounce_places: BouncePlaces,
    order_address: u64,
    /// A block for each sample.
    frame_buffer: Holder<BufferHandle>,
    frame_address: u64,
    uploaded: Vec<FrameConstants>,
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
        let config = &suited(config, scene, ctx.capabilities());
        let extent = [config.width, config.height];
        let gpu_scene = GpuScene::new(ctx, scene)?;
        let frame_buffer = frame_buffer(ctx, config.samples)?;
        let film = Film::new(ctx, extent, config.samples)?;
        let geometry = GeometryStage::new(ctx, &gpu_scene, config)?;
        let is_ordered = config.bounces == Some(Bounces::First) && config.max_depth > 0;
        let order = is_ordered.then(|| PixelOrder::new(ctx, extent)).transpose()?;
        let band_rows = band_rows(config, ctx.capabilities().is_cpu).min(config.height);
        let bands = bands(config.height, band_rows);
        let rays = RayPass::new(ctx, config, config.width * band_rows)?;
        let has_stamps = ctx.capabilities().limits.timestamp_bits > 0;
        let stamps = has_stamps.then(|| Stamps::new(ctx, bands.len() as u32, config.samples)).transpose()?;
        Ok(Self {
            indices: indices(&gpu_scene, &geometry, film.picture.index()),
            frame_address: ctx.buffer_address(*frame_buffer)?,
            sums_address: film.sums_address(ctx)?,
            bounce_places: rays.bounce_places(ctx)?,
            uploaded: Vec::new(),
            lighting: Lighting::new(scene),
            near_plane: near_plane(scene),
            ctx: ctx.clone(),
            config: *config,
            scene: gpu_scene,
            geometry,
            order_address: order.as_ref().map_or(Ok(0), |order| order.address(ctx))?,
            order,
            rays,
            stamps,
            film,
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

    /// Renders one frame, a band of rows after the other, once for each sample, and calls `after_band` with the number of
    /// bands done.
    ///
    /// # Errors
    /// [`HybridError::Device`].
    pub fn render_with(
        &mut self,
        camera: &Camera,
        after_band: &mut dyn FnMut(u64),
    ) -> Result<FrameTimings, HybridError> {
        self.upload_constants(camera)?;
        let bands = self.bands.len() as u32;
        for step in 0..self.config.samples * bands {
            let (sample, band) = (step / bands, step % bands);
            let mut cmd = self.ctx.acquire_command_buffer()?;
            if band == 0 {
                self.begin_sample(&mut cmd, sample)?;
            }
            self.record_band(&mut cmd, sample, band)?;
            let submitted = self.ctx.submit(cmd)?;
            self.ctx.wait(submitted)?;
            after_band(u64::from(step) + 1);
        }
        let has_geometry = !matches!(self.geometry, GeometryStage::None);
        let read = |stamps: &Stamps| stamps.read(&self.ctx, has_geometry);
        Ok(self.stamps.as_ref().map(read).transpose()?.unwrap_or_default())
    }

    /// Measures the geometry pass by each rasteriser that there is, where the configuration leaves the choice, which is
    /// compute then. Returns which one is in use, why, and both times; `None` where no visibility is rasterised.
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

    /// The texture with the last frame, sRGB, for a copy to whatever shows it.
    pub fn picture(&self) -> TextureHandle {
        *self.film.picture
    }

    /// The last frame: red, green, blue and alpha of each pixel, 8 bits each, sRGB, rows from the top.
    ///
    /// # Errors
    /// [`HybridError::Device`].
    pub fn read_image(&self) -> Result<Vec<u8>, HybridError> {
        Ok(self.ctx.download_texture(*self.film.picture, &TextureRegion::default())?)
    }

    /// How many bands a frame is rendered in, those of all samples counted.
    pub fn band_count(&self) -> u64 {
        self.bands.len() as u64 * u64::from(self.config.samples)
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
        let view = GpuCamera::new(camera, self.config.width, self.config.height, self.near_plane);
        let sample_count = self.config.samples;
        let constants: Vec<_> = (0..sample_count)
            .map(|sample_number| FrameConstants {
                camera: view.for_sample(sample_number, sample_count),
                scene: self.scene.addresses(),
                lighting: self.lighting,
                indices: self.indices,
                visibility: self.geometry.places(),
                bounces: self.bounce_places,
                order: self.order_address,
                sums: self.sums_address,
                sample_number,
                sample_count,
                padding: [0; 2],
            })
            .collect();
        if self.uploaded != constants {
            self.ctx.upload_buffer(*self.frame_buffer, 0, bytemuck::cast_slice(&constants))?;
            self.uploaded = constants;
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
            self.begin_sample(&mut cmd, 0)?;
            let submitted = self.ctx.submit(cmd)?;
            self.ctx.wait(submitted)?;
            let Some(stamps) = &self.stamps else { break };
            times.push(stamps.read_geometry(&self.ctx)?);
        }
        Ok(times)
    }

    fn begin_sample(&self, cmd: &mut CommandBuffer, sample: u32) -> lvk::Result<()> {
        if let Some(stamps) = &self.stamps {
            stamps.reset(cmd, sample)?;
            stamps.geometry(cmd, sample, false)?;
        }
        let push = self.push(sample, 0..self.config.height);
        self.geometry.record(cmd, &push)?;
        if let Some(order) = &self.order {
            order.record(cmd, &push, &self.geometry.left())?;
        }
        self.stamps.as_ref().map_or(Ok(()), |stamps| stamps.geometry(cmd, sample, true))
    }

    fn record_band(&self, cmd: &mut CommandBuffer, sample: u32, band: u32) -> lvk::Result<()> {
        let stamp = |cmd: &mut CommandBuffer, end| {
            self.stamps.as_ref().map_or(Ok(()), |stamps| stamps.band(cmd, sample, band, end))
        };
        stamp(cmd, false)?;
        let push = self.push(sample, self.bands[band as usize].clone());
        self.rays.record(cmd, self.config.width, &push, &self.left(), &self.film)?;
        stamp(cmd, true)
    }

    /// What the geometry pass and the order of pixels left.
    fn left(&self) -> GeometryLeft {
        let mut left = self.geometry.left();
        left.buffers.extend(self.order.as_ref().map(PixelOrder::buffer));
        left
    }

    fn push(&self, sample: u32, rows: Range<u32>) -> Push {
        let frame = self.frame_address + FRAME_BYTES * u64::from(sample);
        Push { frame, first: rows.start, end: rows.end }
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

/// The configuration with what it leaves open decided, and without bounces where nothing mirrors or refracts.
fn suited(config: &HybridConfig, scene: &Scene, capabilities: &Capabilities) -> HybridConfig {
    let goes_on = scene.materials.iter().any(|m| m.reflectivity > 0.0 || m.is_refractive());
    let can_queue = config.path == RayPath::Query || capabilities.trace_rays_indirect;
    let suits = match (capabilities.is_cpu, config.knows_triangles()) {
        (true, _) if can_queue => Bounces::Queued,
        (false, true) => Bounces::First,
        _ => Bounces::Inline,
    };
    HybridConfig {
        max_depth: if goes_on { config.max_depth } else { 0 },
        bounces: Some(config.bounces.unwrap_or(suits)),
        ..*config
    }
}

fn frame_buffer(ctx: &Context, samples: u32) -> lvk::Result<Holder<BufferHandle>> {
    let size_bytes = FRAME_BYTES * u64::from(samples);
    ctx.create_buffer(&BufferDesc { size_bytes, debug_name: "frame constants", ..BufferDesc::default() })
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
