//! Renders the sample at a frame time.

use crate::app::render_target::RenderTarget;
use crate::app::run_error::RunError;
use crate::app::sample_error::SampleError;
use std::f32::consts::TAU;

use bytemuck::{Pod, Zeroable};
use lvk::{
    AccelStructHandle, BlasDesc, BlasGeometry, BufferHandle, BufferUsage, BuildMode, CommandBuffer,
    ComputePipelineHandle, Context, Dependencies, DeviceInstances, Filter, GeometryFlags, Holder,
    IndexFormat, Indices, SamplerDesc, SamplerHandle, TextureHandle, TlasDesc, Triangles, VertexFormat,
};

use super::models::{Models, Vertex};
use super::panel::RtxTexturesSettings;
use super::pipelines::{INSTANCES, RAYS};
use crate::app::array_buffer::{array, buffer};
use crate::app::frame::Frame;
use crate::app::sample::{FrameTime, Sample};
use crate::app::scene_textures;
use crate::rtx::{RtxConfig, Tracer, compute_pipeline};
use crate::scene::{Camera, GpuCamera, painted_textures};

/// Textures that the shaders have room for.
pub(super) const TEXTURES: usize = 6;
/// Things in a row and in a column (`kColumns` in `shaders/rtx_textures/instances.comp.glsl`).
const COLUMNS: u32 = 13;
/// Number of instances: the things and the ground.
pub(super) const INSTANCE_COUNT: u32 = COLUMNS * COLUMNS + 1;
/// Bytes of an instance.
const RECORD_BYTES: u64 = 64;
/// Instances that a work group writes.
const GROUP: u32 = 64;

/// Renders crates and rings.
pub struct RtxTextures {
    target: RenderTarget,
    ctx: Context,
    config: RtxConfig,
    writer: Holder<ComputePipelineHandle>,
    tracer: Tracer,
    tlas: Holder<AccelStructHandle>,
    blas: Vec<AccelStructHandle>,
    records: Holder<BufferHandle>,
    constants: FrameConstants,
    camera: Camera,
    textures: [u32; TEXTURES],
    samplers: [Holder<SamplerHandle>; 2],
    settings: RtxTexturesSettings,
    _held: Held,
}

/// Resources that only the GPU reads.
struct Held {
    _blas: Vec<Holder<AccelStructHandle>>,
    _buffers: [Holder<BufferHandle>; 2],
    _textures: Vec<Holder<TextureHandle>>,
}

lvk::shader_struct! {
    /// `Frame` in `shaders/rtx_textures/frame.glsl`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(super) struct FrameConstants {
        camera: GpuCamera,
        vertices: u64,
        triangles: u64,
        records: u64,
        textures: [u32; TEXTURES],
        first_triangle: [u32; 3],
        tlas: u32,
        image: u32,
        sampler as smp: u32,
        count: u32,
        phase: f32,
    }
}

impl RtxTextures {
    /// Makes models, textures, structures and pipelines. The animation stands at its beginning.
    ///
    /// # Errors
    /// [`SampleError`] when the configuration is beyond the device, or the device fails.
    pub fn new(ctx: &Context, config: &RtxConfig) -> Result<Self, SampleError> {
        let target = config.create_target(ctx)?;
        let models = Models::new();
        let usage = BufferUsage::STORAGE | BufferUsage::ACCEL_INPUT;
        let vertices = array(ctx, "vertices", usage, &models.vertices)?;
        let triangles = array(ctx, "triangles", usage, &models.triangles)?;
        let blas = build_blas(ctx, &models, [*vertices, *triangles])?;
        let tlas = ctx.create_tlas(&TlasDesc { capacity: INSTANCE_COUNT, ..TlasDesc::default() })?;
        let textures: Vec<_> = painted_textures()
            .iter()
            .take(TEXTURES)
            .map(|picture| scene_textures::picture(ctx, picture))
            .collect::<Result<_, _>>()?;
        let records = buffer(ctx, "instances", RECORD_BYTES * u64::from(INSTANCE_COUNT))?;
        let constants = FrameConstants {
            camera: GpuCamera::zeroed(),
            vertices: vertices.address()?,
            triangles: triangles.address()?,
            records: records.address()?,
            textures: [0; TEXTURES],
            first_triangle: std::array::from_fn(|model| models.ranges[model].start),
            tlas: tlas.index(),
            image: target.image_index(),
            sampler: 0,
            count: 0,
            phase: 0.0,
        };
        Ok(Self {
            target,
            ctx: ctx.clone(),
            config: *config,
            writer: compute_pipeline(ctx, RAYS.sample, INSTANCES)?,
            tracer: Tracer::new(ctx, config.path, &RAYS)?,
            tlas,
            blas: blas.iter().map(|blas| **blas).collect(),
            records,
            constants,
            camera: camera(0.0),
            textures: std::array::from_fn(|number| textures[number % textures.len()].index()),
            samplers: [sampler(ctx, Filter::Nearest)?, sampler(ctx, Filter::Linear)?],
            settings: RtxTexturesSettings::default(),
            _held: Held { _blas: blas, _buffers: [vertices, triangles], _textures: textures },
        })
    }

    /// Moves everything to where it is at `phase` of the animation's round, 0 to 1.
    pub fn show(&mut self, phase: f32) {
        self.constants.phase = phase;
        self.camera = camera(phase);
    }

    /// Instances that the compute shader writes where the settings take none away.
    pub fn instance_count(&self) -> u32 {
        INSTANCE_COUNT
    }

    /// Settings of the panel, which take effect with the next frame.
    pub fn settings(&mut self) -> &mut RtxTexturesSettings {
        &mut self.settings
    }

    fn apply_settings(&mut self) {
        let settings = &self.settings;
        self.constants.count = settings.instance_count();
        self.constants.textures = settings.ordered(&self.textures);
        self.constants.sampler = self.samplers[usize::from(settings.is_filtered)].index();
    }

    /// Textures that they show.
    pub fn texture_count(&self) -> usize {
        TEXTURES
    }

    fn write_instances(&self, cmd: &mut CommandBuffer, constants: u64) -> lvk::Result<()> {
        cmd.bind_compute_pipeline(*self.writer)?;
        cmd.push_constants(&constants)?;
        let writes = Dependencies { buffers: &[*self.records], ..Dependencies::default() };
        cmd.dispatch([self.constants.count.div_ceil(GROUP), 1, 1], &writes)
    }

    fn build_tlas(&self, cmd: &mut CommandBuffer) -> lvk::Result<()> {
        let count = self.constants.count;
        let instances = DeviceInstances { buffer: *self.records, offset: 0, count, blas: &self.blas };
        cmd.update_tlas_from_buffer(*self.tlas, &instances, BuildMode::Rebuild)
    }
}

impl Sample for RtxTextures {
    fn context(&self) -> &Context {
        &self.ctx
    }

    fn update(&mut self, time: FrameTime) {
        self.show(time.phase());
    }

    fn record(&mut self, frame: &mut Frame<'_>) -> Result<TextureHandle, RunError> {
        let [width, height] = self.config.extent();
        self.apply_settings();
        self.constants.camera = GpuCamera::new(&self.camera, width, height, 0.1);
        let constants = frame.cmd.upload(&self.constants)?;
        frame.pass("instances", |cmd| self.write_instances(cmd, constants))?;
        frame.pass("TLAS build", |cmd| self.build_tlas(cmd))?;
        Ok(self.tracer.record_image(frame, &self.target, &constants)?)
    }

    fn resize(&mut self, extent: [u32; 2]) -> Result<(), RunError> {
        self.target = self.config.resize(&self.ctx, extent)?;
        self.constants.image = self.target.image_index();
        Ok(())
    }

    fn camera_mut(&mut self) -> Option<&mut Camera> {
        Some(&mut self.camera)
    }

    #[cfg(feature = "window")]
    fn panel(&mut self, ui: &mut egui::Ui) {
        self.settings.show(ui);
    }

    fn reload(&mut self) -> Result<(), RunError> {
        let writer = compute_pipeline(&self.ctx, RAYS.sample, INSTANCES)?;
        self.tracer = Tracer::new(&self.ctx, self.config.path, &RAYS)?;
        self.writer = writer;
        Ok(())
    }
}

/// Between texels, or of the nearest one.
fn sampler(ctx: &Context, filter: Filter) -> lvk::Result<Holder<SamplerHandle>> {
    ctx.create_sampler(&SamplerDesc {
        mag_filter: filter,
        min_filter: filter,
        mip_filter: filter,
        ..SamplerDesc::default()
    })
}

/// The camera of the animation at `phase` of the round, 0 to 1.
fn camera(phase: f32) -> Camera {
    let sway = 0.35 * (TAU * phase).sin();
    let eye = [9.2 * (0.5 + sway).sin(), 3.7, 9.2 * (0.5 + sway).cos()];
    Camera::looking_at(eye, [0.0, 0.2, 0.6], 38.0)
}

fn build_blas(
    ctx: &Context,
    models: &Models,
    [vertices, triangles]: [BufferHandle; 2],
) -> lvk::Result<Vec<Holder<AccelStructHandle>>> {
    let geometry = |range: &std::ops::Range<u32>| {
        let offset = u64::from(range.start) * size_of::<[u32; 3]>() as u64;
        [BlasGeometry::Triangles(Triangles {
            vertex_buffer: vertices,
            vertex_offset: 0,
            vertex_stride: size_of::<Vertex>() as u64,
            vertex_format: VertexFormat::F32x3,
            vertex_count: models.vertices.len() as u32,
            indices: Some(Indices { buffer: triangles, offset, format: IndexFormat::U32 }),
            triangle_count: range.len() as u32,
            transform: None,
            flags: GeometryFlags::OPAQUE,
        })]
    };
    let geometries: Vec<_> = models.ranges.iter().map(geometry).collect();
    let desc = |geometries| BlasDesc { geometries, debug_name: "model", ..BlasDesc::default() };
    let descs: Vec<_> = geometries.iter().map(|geometries| desc(&geometries[..])).collect();
    ctx.create_blas_batch(&descs)
}
