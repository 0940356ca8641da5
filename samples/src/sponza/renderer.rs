//! Renders the sample at a frame time.

use crate::app::render_target::RenderTarget;
use crate::app::run_error::RunError;
use crate::app::sample_error::SampleError;
use glam::{Quat, Vec3};
use lvk::{
    AddressMode, BufferHandle, BufferUsage, CommandBuffer, Context, Dependencies, Holder, Readback,
    RenderPipelineHandle, SamplerDesc, SamplerHandle, TextureHandle,
};

use super::config::{DrawPath, SponzaConfig};
use super::culling::{Culling, VIEWS};
use super::draws::{Draw, split_draws};
use super::frame::{FrameConstants, GpuFinish, GpuSun, GpuView};
use super::frustum::Frustum;
use super::pipelines::{SKY, SURFACES};
use super::shadow::Shadow;
use super::sun_view::SunView;
use crate::app::array_buffer::array;
use crate::app::frame::Frame;
use crate::app::sample::{FrameTime, Sample};
use crate::app::scene_textures;
use crate::hybrid::{SceneArrays, check_promises, near_plane};
use crate::raster::RasterPipeline;
use crate::scene::{Ambient, Camera, CameraTour, DirectionalLight, GpuCamera, Material, PointLight, Scene};

/// Texels on an edge of the sky's cube map.
const SKY_SIZE: u32 = 256;
/// The sun of scenes without one: direction and colour.
const USUAL_SUN: ([f32; 3], [f32; 3]) = ([0.28, 0.9, 0.33], [2.6, 2.35, 1.95]);

/// Renders a scene of many draws.
pub struct Sponza {
    ctx: Context,
    config: SponzaConfig,
    path_of_draws: DrawPath,
    target: RenderTarget,
    culling: Culling,
    shadow: Shadow,
    surfaces: Holder<RenderPipelineHandle>,
    sky: Holder<RenderPipelineHandle>,
    scene: OnDevice,
    draws: Vec<Draw>,
    bounds: ([f32; 3], [f32; 3]),
    light: Light,
    tour: CameraTour,
    near_plane: f32,
    /// The frustum of a view that is kept while the camera goes on, to look at what was culled.
    kept: Option<Frustum>,
    turn: f32,
    draw_counts: DrawCounts,
}

/// The resources of the scene that shaders read.
struct OnDevice {
    arrays: SceneArrays,
    finishes: Holder<BufferHandle>,
    sky: Holder<TextureHandle>,
    surface_sampler: Holder<SamplerHandle>,
    sky_sampler: Holder<SamplerHandle>,
    _textures: [Vec<Holder<TextureHandle>>; 2],
}

/// The lights of the scene.
struct Light {
    sun: DirectionalLight,
    ambient: Ambient,
    lamp: PointLight,
}

/// The latest counts of draws, and the readback of the next.
#[derive(Default)]
struct DrawCounts {
    counts: Option<[u32; VIEWS]>,
    coming: Option<Readback>,
}

impl Sponza {
    /// Uploads `scene`, whose triangles it cuts into draws, and makes all pipelines.
    ///
    /// # Errors
    /// [`SampleError`] when the configuration is beyond the device, or the device fails.
    pub fn new(ctx: &Context, mut scene: Scene, config: &SponzaConfig) -> Result<Self, SampleError> {
        check_promises(&scene)?;
        let config = config.valid_for(ctx)?;
        let target = RenderTarget::with_samples(ctx, config.extent, config.samples)?;
        let draws = split_draws(&mut scene, config.triangles_per_draw);
        Ok(Self {
            target,
            culling: Culling::new(ctx, &draws)?,
            shadow: Shadow::new(ctx, config.shadow_size)?,
            surfaces: pipeline(ctx, &SURFACES, config.samples)?,
            sky: pipeline(ctx, &SKY, config.samples)?,
            scene: OnDevice::new(ctx, &scene)?,
            draws,
            bounds: scene.bounds(),
            light: Light::from_scene(&scene),
            tour: CameraTour::new(&scene, 0),
            near_plane: near_plane(&scene),
            ctx: ctx.clone(),
            path_of_draws: config.draws.unwrap_or(DrawPath::Padded),
            config,
            kept: None,
            turn: 0.0,
            draw_counts: DrawCounts::default(),
        })
    }

    /// Tours the scene's cameras from the one with this index on.
    #[must_use]
    pub fn from_camera(mut self, scene: &Scene, first: usize) -> Self {
        self.tour = CameraTour::new(scene, first);
        self
    }

    /// The configuration.
    pub fn config(&self) -> &SponzaConfig {
        &self.config
    }

    /// Source of the number of draws after culling.
    pub fn draw_path(&self) -> DrawPath {
        self.path_of_draws
    }

    /// All draws, in the order in which they are drawn.
    pub fn draws(&self) -> &[Draw] {
        &self.draws
    }

    /// The frusta that the next frame culls draws by: of the camera and of the sun.
    pub fn frusta(&self) -> [Frustum; 2] {
        if !self.config.culls {
            return [Frustum::ALL; 2];
        }
        let seen = || Frustum::of_camera(&self.tour.camera, self.target.aspect(), self.near_plane);
        [self.kept.unwrap_or_else(seen), Frustum::from_clip_matrix(self.sun_view().rows)]
    }

    /// Returns the number of draws of the camera and of the sun after culling in the last frame. Waits for the frame.
    ///
    /// # Errors
    /// [`SampleError::Device`].
    pub fn counts(&self) -> Result<[u32; 2], SampleError> {
        Ok(self.culling.counts(&self.ctx)?)
    }

    /// First triangles of the draws that the last frame has left, of the camera (0) or the sun (1). Waits for it.
    ///
    /// # Errors
    /// [`SampleError::Device`].
    pub fn survivors(&self, view: usize) -> Result<Vec<u32>, SampleError> {
        Ok(self.culling.survivors(&self.ctx, view.min(VIEWS - 1), self.path_of_draws)?)
    }

    fn to_sun(&self) -> Vec3 {
        let turned = Quat::from_rotation_y(self.turn.to_radians()) * Vec3::from(self.light.sun.direction);
        turned.normalize_or(Vec3::Y)
    }

    fn sun_view(&self) -> SunView {
        SunView::new(self.to_sun(), self.bounds)
    }

    fn sun(&self) -> GpuSun {
        let (view, Light { sun, ambient, lamp }) = (self.sun_view(), &self.light);
        let size = self.config.shadow_size as f32;
        GpuSun {
            rows: view.rows,
            to_sun: self.to_sun().into(),
            map: self.shadow.map.index(),
            color: sun.color,
            sampler: self.shadow.sampler.index(),
            ambient_above: ambient.above,
            filter: self.config.filter,
            ambient_below: ambient.below,
            texel: 1.0 / size,
            lamp: lamp.position,
            lamp_reach: lamp.reach,
            lamp_color: lamp.color,
            texel_size: view.size[0].max(view.size[1]) / size,
        }
    }

    fn upload_frame(&self, cmd: &mut CommandBuffer) -> lvk::Result<u64> {
        let [width, height] = self.target.extent();
        let (draws, arguments, counts) = self.culling.addresses()?;
        let frusta = self.frusta();
        cmd.upload(&FrameConstants {
            camera: GpuCamera::new(&self.tour.camera, width, height, self.near_plane),
            scene: self.scene.arrays.addresses(),
            finishes: self.scene.finishes.address()?,
            draws,
            views: [0, 1].map(|view| GpuView::new(&frusta[view], arguments[view])),
            counts,
            draw_count: self.culling.draw_count(),
            is_packed: u32::from(self.path_of_draws == DrawPath::Counted),
            sun: self.sun(),
            surface_sampler: self.scene.surface_sampler.index(),
            sky: self.scene.sky.index(),
            sky_sampler: self.scene.sky_sampler.index(),
            has_relief: self.config.normal_maps.into(),
        })
    }

    fn draw_surfaces(&self, to: &mut Frame<'_>, address: u64) -> lvk::Result<()> {
        let reads = Dependencies {
            sampled_images: &[*self.shadow.map],
            read_buffers: &self.culling.reads(0),
            ..Dependencies::default()
        };
        let mut pass = self.target.begin(&mut to.cmd, "surfaces", [0.0; 3], &reads)?;
        pass.bind_render_pipeline(*self.surfaces)?;
        pass.push_constants(&address)?;
        self.culling.draw(&mut pass, 0, self.path_of_draws)?;
        pass.bind_render_pipeline(*self.sky)?;
        pass.push_constants(&address)?;
        pass.draw(0..3, 0..1)
    }

    /// Keeps the last counts that have arrived, and asks for the next.
    fn poll_counts(&mut self) -> lvk::Result<()> {
        if let Some(coming) = self.draw_counts.coming.take() {
            if !coming.is_ready()? {
                self.draw_counts.coming = Some(coming);
                return Ok(());
            }
            self.draw_counts.counts = bytemuck::try_pod_read_unaligned(&coming.wait()?).ok();
        }
        let range = 0..(VIEWS * size_of::<u32>()) as u64;
        self.draw_counts.coming = Some(self.ctx.read_buffer_later(self.culling.counts_buffer(), range)?);
        Ok(())
    }

    fn draw_counts_text(&self, counts: [u32; VIEWS]) -> String {
        let all = self.culling.draw_count();
        format!("{} of {all} draws in the picture, {} in the shadow map", counts[0], counts[1])
    }
}

impl Sample for Sponza {
    fn context(&self) -> &Context {
        &self.ctx
    }

    fn update(&mut self, time: FrameTime) {
        self.tour.go_to(time.phase());
    }

    fn record(&mut self, frame: &mut Frame<'_>) -> Result<TextureHandle, RunError> {
        let address = self.upload_frame(&mut frame.cmd)?;
        frame.pass("culling", |cmd| self.culling.record(cmd, address))?;
        self.shadow.record(&mut frame.cmd, &self.culling, self.path_of_draws, address)?;
        self.draw_surfaces(frame, address)?;
        Ok(self.target.image())
    }

    fn after_frame(&mut self) -> Result<(), RunError> {
        self.draw_counts.counts = Some(self.counts()?);
        Ok(())
    }

    fn remark(&self) -> Result<Option<String>, RunError> {
        let text = |counts| format!("culling   {}", self.draw_counts_text(counts));
        Ok(self.draw_counts.counts.map(text))
    }

    fn resize(&mut self, extent: [u32; 2]) -> Result<(), RunError> {
        self.target = RenderTarget::with_samples(&self.ctx, extent, self.config.samples)?;
        self.config.extent = extent;
        Ok(())
    }

    fn camera_mut(&mut self) -> Option<&mut Camera> {
        Some(&mut self.tour.camera)
    }

    #[cfg(feature = "window")]
    fn panel(&mut self, ui: &mut egui::Ui) {
        ui.checkbox(&mut self.config.culls, "culling");
        ui.checkbox(&mut self.config.normal_maps, "normal maps");
        let mut keeps = self.kept.is_some();
        let keep = ui.checkbox(&mut keeps, "keep the frustum");
        if keep.on_hover_text("shows from elsewhere what culling leaves").changed() {
            self.kept = None;
            self.kept = keeps.then(|| self.frusta()[0]);
        }
        ui.add(
            egui::Slider::new(&mut self.config.filter, 0..=SponzaConfig::MAX_FILTER).text("texels of filter"),
        );
        ui.add(egui::Slider::new(&mut self.shadow.bias.constant, 0.0..=20.0).text("depth bias"));
        ui.add(egui::Slider::new(&mut self.shadow.bias.slope, 0.0..=10.0).text("slope bias"));
        ui.add(egui::Slider::new(&mut self.turn, -180.0..=180.0).text("turn of the sun"));
        // The figures are those of a frame some time ago; without them the panel tells nothing.
        if self.poll_counts().is_ok()
            && let Some(counts) = self.draw_counts.counts
        {
            let all = self.culling.draw_count();
            ui.label(format!("{} of {all} draws in the picture", counts[0]));
            ui.label(format!("{} in the shadow map", counts[1]));
        }
    }

    fn reload(&mut self) -> Result<(), RunError> {
        let samples = self.config.samples;
        let (surfaces, sky) = (pipeline(&self.ctx, &SURFACES, samples)?, pipeline(&self.ctx, &SKY, samples)?);
        let (culling, shadow) = (Culling::pipeline(&self.ctx)?, Shadow::pipeline(&self.ctx)?);
        (self.surfaces, self.sky, self.culling.pipeline, self.shadow.pipeline) =
            (surfaces, sky, culling, shadow);
        Ok(())
    }
}

impl OnDevice {
    fn new(ctx: &Context, scene: &Scene) -> lvk::Result<Self> {
        let pictures = scene.textures.iter().map(|texture| scene_textures::picture(ctx, texture));
        let textures: Vec<_> = pictures.collect::<Result<_, _>>()?;
        let maps = scene.normal_maps.iter().map(|map| scene_textures::normal_map(ctx, map));
        let maps: Vec<_> = maps.collect::<Result<_, _>>()?;
        let number = |map: u32| maps[map as usize].index();
        let finish = |material: &Material| GpuFinish {
            is_masked: material.is_masked.into(),
            normal_map: material.normal_map.map_or(scene_textures::NO_TEXTURE, number),
        };
        let finishes: Vec<_> = scene.materials.iter().map(finish).collect();
        let sampler = |debug_name, address, max_anisotropy| {
            let address = [address; 3];
            ctx.create_sampler(&SamplerDesc { address, max_anisotropy, debug_name, ..SamplerDesc::default() })
        };
        Ok(Self {
            arrays: SceneArrays::new(ctx, scene, &textures)?,
            finishes: array(ctx, "finishes of materials", BufferUsage::STORAGE, &finishes)?,
            sky: scene_textures::sky(ctx, &scene.sky, SKY_SIZE)?,
            surface_sampler: sampler("surface sampler", AddressMode::Repeat, 8.0)?,
            sky_sampler: sampler(
                "sky sampler",
                AddressMode::ClampToEdge,
                SamplerDesc::default().max_anisotropy,
            )?,
            _textures: [textures, maps],
        })
    }
}

fn pipeline(ctx: &Context, data: &RasterPipeline, samples: u32) -> lvk::Result<Holder<RenderPipelineHandle>> {
    RasterPipeline { samples, ..*data }.create(ctx)
}

impl Light {
    /// The lights of a scene: its sun, or the usual one and the lamp.
    fn from_scene(scene: &Scene) -> Self {
        let (direction, color) = USUAL_SUN;
        let usual = DirectionalLight { direction: Vec3::from(direction).normalize().into(), color };
        let dark = PointLight { color: [0.0; 3], ..scene.light };
        let lamp = if scene.sun.is_some() { dark } else { scene.light };
        Self { sun: scene.sun.unwrap_or(usual), ambient: scene.ambient, lamp }
    }
}
