//! Renders the sample at a frame time.

use crate::app::render_target::RenderTarget;
use crate::app::run_error::RunError;
use crate::app::sample_error::SampleError;
use bytemuck::{Pod, Zeroable};
use lvk::{
    CommandBuffer, Context, CullMode, Dependencies, Holder, RenderPass, RenderPipelineDesc,
    RenderPipelineHandle, TextureHandle,
};

use super::config::{CubeMapFaces, RenderToCubeMapConfig, has_six_views};
use super::cube_map::{CubeMap, FACES};
use super::pipelines::{self, IN_PICTURE, ON_ALL_FACES, ON_FACE};
use super::surroundings::{Block, DROP, blocks, camera};
use crate::app::frame::Frame;
use crate::app::sample::{FrameTime, Sample};
use crate::scene::{Camera, GpuCamera};

/// Corners of a block, of the sky, and of the drop (`kGrid` in `shaders/render_to_cube_map/drop.glsl`).
const BLOCK_CORNERS: u32 = 36;
const SKY_CORNERS: u32 = 3;
const DROP_CORNERS: u32 = 6 * 96 * 48;
/// Number of the picture's camera, behind those of the faces.
const PICTURE: u32 = FACES;
const NEAR_PLANE: f32 = 0.1;

/// Draws a drop and what it mirrors.
pub struct RenderToCubeMap {
    ctx: Context,
    target: RenderTarget,
    config: RenderToCubeMapConfig,
    cube_map: CubeMap,
    pipelines: Pipelines,
    blocks: Vec<Block>,
    camera: Camera,
    phase: f32,
    waves: f32,
}

/// All of them; none for six views where the device has none.
struct Pipelines {
    in_picture: SurroundingsPipelines,
    on_face: SurroundingsPipelines,
    on_all_faces: Option<SurroundingsPipelines>,
    drop: Holder<RenderPipelineHandle>,
}

/// Pipelines of the surroundings, for one kind of target.
struct SurroundingsPipelines {
    blocks: Holder<RenderPipelineHandle>,
    sky: Holder<RenderPipelineHandle>,
}

/// `Frame` in `shaders/render_to_cube_map/frame.glsl`.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct FrameConstants {
    cameras: [GpuCamera; FACES as usize + 1],
    blocks: u64,
    cube_map: u32,
    sampler: u32,
    phase: f32,
    waves: f32,
    lod: f32,
    padding: u32,
}

/// `Push` there.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Push {
    frame: u64,
    view: u32,
    padding: u32,
}

impl RenderToCubeMap {
    /// Makes the cube map and the pipelines. The animation stands at its beginning.
    ///
    /// # Errors
    /// [`SampleError`] when the configuration is beyond the device, or the device fails.
    pub fn new(ctx: &Context, config: &RenderToCubeMapConfig) -> Result<Self, SampleError> {
        config.faces.check(ctx)?;
        let target = RenderTarget::with_depth(ctx, config.extent)?;
        Ok(Self {
            target,
            config: *config,
            cube_map: CubeMap::new(ctx, config.face_size)?,
            pipelines: Pipelines::new(ctx)?,
            blocks: blocks(0.0),
            camera: camera(0.0),
            phase: 0.0,
            waves: 0.16,
            ctx: ctx.clone(),
        })
    }

    /// Returns the floor and the blocks at the current frame time.
    #[must_use]
    pub fn blocks(&self) -> &[Block] {
        &self.blocks
    }

    /// The cube map: six faces with all mips, in linear light.
    #[must_use]
    pub fn cube_map(&self) -> TextureHandle {
        *self.cube_map.texture
    }

    /// The configuration.
    #[must_use]
    pub fn config(&self) -> &RenderToCubeMapConfig {
        &self.config
    }

    fn upload(&self, cmd: &mut CommandBuffer) -> lvk::Result<u64> {
        let [width, height] = self.config.extent;
        let [a, b, c, d, e, f] = GpuCamera::cube_faces(DROP, self.config.face_size, NEAR_PLANE);
        let constants = FrameConstants {
            cameras: [a, b, c, d, e, f, GpuCamera::new(&self.camera, width, height, NEAR_PLANE)],
            blocks: cmd.upload_slice(&self.blocks)?,
            cube_map: self.cube_map.texture.index(),
            sampler: self.cube_map.sampler.index(),
            phase: self.phase,
            waves: self.waves,
            lod: self.config.roughness * (self.cube_map.mips - 1) as f32,
            padding: 0,
        };
        cmd.upload(&constants)
    }

    /// Draws what stands around the drop.
    fn draw(&self, pass: &mut RenderPass<'_>, by: &SurroundingsPipelines, push: &Push) -> lvk::Result<()> {
        pass.bind_render_pipeline(*by.blocks)?;
        pass.push_constants(push)?;
        pass.draw(0..BLOCK_CORNERS, 0..self.blocks.len() as u32)?;
        pass.bind_render_pipeline(*by.sky)?;
        pass.draw(0..SKY_CORNERS, 0..1)
    }
}

impl Sample for RenderToCubeMap {
    fn context(&self) -> &Context {
        &self.ctx
    }

    fn update(&mut self, time: FrameTime) {
        self.phase = time.phase();
        self.blocks = blocks(self.phase);
        self.camera = camera(self.phase);
    }

    fn record(&mut self, frame: &mut Frame<'_>) -> Result<TextureHandle, RunError> {
        let push = Push { frame: self.upload(&mut frame.cmd)?, view: PICTURE, padding: 0 };
        let (faces, on_faces) = self.pipelines.faces(self.config.faces);
        frame.pass("cube map", |cmd| {
            self.cube_map.record(cmd, faces, |pass, view| self.draw(pass, on_faces, &Push { view, ..push }))
        })?;
        let reads = Dependencies { sampled_images: &[self.cube_map()], ..Dependencies::default() };
        let mut pass = self.target.begin(&mut frame.cmd, "picture", [0.0; 3], &reads)?;
        self.draw(&mut pass, &self.pipelines.in_picture, &push)?;
        pass.bind_render_pipeline(*self.pipelines.drop)?;
        pass.draw(0..DROP_CORNERS, 0..1)?;
        Ok(self.target.image())
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
        let RenderToCubeMapConfig { faces, roughness, .. } = &mut self.config;
        ui.radio_value(faces, CubeMapFaces::SixPasses, "six passes");
        ui.add_enabled_ui(self.pipelines.on_all_faces.is_some(), |ui| {
            ui.radio_value(faces, CubeMapFaces::OnePass, "one pass of six views");
        });
        ui.add(egui::Slider::new(roughness, 0.0..=1.0).text("roughness"));
        ui.add(egui::Slider::new(&mut self.waves, 0.0..=0.3).text("waves"));
    }

    fn reload(&mut self) -> Result<(), RunError> {
        self.pipelines = Pipelines::new(&self.ctx)?;
        Ok(())
    }
}

impl Pipelines {
    fn new(ctx: &Context) -> lvk::Result<Self> {
        let has_six_views = has_six_views(ctx.capabilities());
        let culled = RenderPipelineDesc { cull: CullMode::Back, ..RenderPipelineDesc::default() };
        Ok(Self {
            in_picture: SurroundingsPipelines::new(ctx, &IN_PICTURE)?,
            on_face: SurroundingsPipelines::new(ctx, &ON_FACE)?,
            on_all_faces: has_six_views
                .then(|| SurroundingsPipelines::new(ctx, &ON_ALL_FACES))
                .transpose()?,
            drop: pipelines::DROP.create_with(ctx, &culled)?,
        })
    }

    /// Returns `wish` where the device supports it, else six passes, with the pipelines.
    fn faces(&self, wish: CubeMapFaces) -> (CubeMapFaces, &SurroundingsPipelines) {
        match (wish, &self.on_all_faces) {
            (CubeMapFaces::OnePass, Some(all)) => (CubeMapFaces::OnePass, all),
            _ => (CubeMapFaces::SixPasses, &self.on_face),
        }
    }
}

impl SurroundingsPipelines {
    fn new(ctx: &Context, of: &pipelines::SurroundingsDesc) -> lvk::Result<Self> {
        let state = RenderPipelineDesc {
            cull: CullMode::Back,
            front_face: of.front,
            ..RenderPipelineDesc::default()
        };
        Ok(Self { blocks: of.blocks.create_with(ctx, &state)?, sky: of.sky.create(ctx)? })
    }
}
