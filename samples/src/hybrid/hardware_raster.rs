//! Visibility by the device's rasteriser: triangles that cover no pixel's centre are culled by compute shaders, the
//! others drawn by one indirect draw into a target of triangle numbers.

use super::pipelines;
use crate::pipelines::SampleStage;
use lvk::{
    BufferDesc, BufferHandle, BufferUsage, ColorAttachment, ColorLoadOp, ColorTarget, CommandBuffer,
    CompareOp, ComputePipelineDesc, ComputePipelineHandle, Context, CullMode, Dependencies, DepthAttachment,
    DepthTest, Format, Holder, IndexFormat, RenderPassDesc, RenderPipelineDesc, RenderPipelineHandle,
    TextureDesc, TextureHandle, TextureUsage,
};

use super::compute_raster::groups_for;
use super::frame::{LAYOUTS, Push, VisibilityAddresses};
use super::geometry_pass::NO_TRIANGLE;
use super::shader_module::module;

/// Triangles of a workgroup (`kTrianglesPerGroup` in `shaders/hybrid/unculled_triangles.glsl`).
const GROUP: u32 = 256;
/// Bytes of the arguments of an indexed draw.
const DRAW_BYTES: u32 = 20;

/// The rasteriser: its pipelines, targets and what is left after culling.
pub(super) struct HardwareRaster {
    cull: Holder<ComputePipelineHandle>,
    compact: Holder<ComputePipelineHandle>,
    draw: Holder<RenderPipelineHandle>,
    image: Holder<TextureHandle>,
    depth: Holder<TextureHandle>,
    survivors: Survivors,
    groups: [u32; 3],
}

/// Triangles that remain after culling.
struct Survivors {
    bits: Holder<BufferHandle>,
    counts: Holder<BufferHandle>,
    indices: Holder<BufferHandle>,
    triangles: Holder<BufferHandle>,
    arguments: Holder<BufferHandle>,
}

impl HardwareRaster {
    /// Format of the target.
    pub(super) const IMAGE: Format = Format::R32Uint;
    /// Format of the depth target.
    pub(super) const DEPTH: Format = Format::D32Float;

    /// The rasteriser of `triangle_count` triangles for a picture of `extent` pixels.
    pub(super) fn new(ctx: &Context, triangle_count: u32, extent: [u32; 2]) -> lvk::Result<Self> {
        let target = |format, debug_name| {
            let usage = TextureUsage::SAMPLED | TextureUsage::TARGET;
            ctx.create_texture(&TextureDesc { format, extent, usage, debug_name, ..TextureDesc::default() })
        };
        Ok(Self {
            cull: compute(ctx, &pipelines::CULL_COMP)?,
            compact: compute(ctx, &pipelines::COMPACT_COMP)?,
            draw: draw(ctx)?,
            image: target(Self::IMAGE, "visible triangles")?,
            depth: target(Self::DEPTH, "visibility depth")?,
            survivors: Survivors::new(ctx, triangle_count)?,
            groups: groups_for(triangle_count, GROUP),
        })
    }

    /// Tells the shaders where its buffers are.
    pub(super) fn name_in(&self, places: &mut VisibilityAddresses) -> lvk::Result<()> {
        let left = &self.survivors;
        places.survivor_bits = left.bits.address()?;
        places.survivor_counts = left.counts.address()?;
        places.survivor_indices = left.indices.address()?;
        places.survivors = left.triangles.address()?;
        places.draw = left.arguments.address()?;
        Ok(())
    }

    /// Resources that the ray pass reads.
    pub(super) fn image(&self) -> &Holder<TextureHandle> {
        &self.image
    }

    /// Records the pass.
    pub(super) fn record(&self, cmd: &mut CommandBuffer, push: &Push) -> lvk::Result<()> {
        let left = &self.survivors;
        let (bits, counts) = (left.bits.handle(), left.counts.handle());
        let written = [left.indices.handle(), left.triangles.handle(), left.arguments.handle()];
        cmd.bind_compute_pipeline(*self.cull)?;
        cmd.push_constants(push)?;
        cmd.dispatch(self.groups, &Dependencies { buffers: &[bits, counts], ..Dependencies::default() })?;
        cmd.bind_compute_pipeline(*self.compact)?;
        cmd.push_constants(push)?;
        let read = [bits, counts];
        let compact = Dependencies { buffers: &written, read_buffers: &read, ..Dependencies::default() };
        cmd.dispatch(self.groups, &compact)?;
        self.record_draw(cmd, push)
    }

    fn record_draw(&self, cmd: &mut CommandBuffer, push: &Push) -> lvk::Result<()> {
        let left = &self.survivors;
        let target = ColorAttachment {
            texture: self.image.handle(),
            mip: 0,
            layer: 0,
            load: ColorLoadOp::ClearUint([NO_TRIANGLE; 4]),
            store: true,
            resolve: None,
        };
        let read = [&left.indices, &left.triangles, &left.arguments].map(Holder::handle);
        let mut pass = cmd.begin_rendering(&RenderPassDesc {
            color: &[target],
            depth: Some(DepthAttachment { store: false, ..DepthAttachment::clear(*self.depth, 0.0) }),
            dependencies: Dependencies { read_buffers: &read, ..Dependencies::default() },
            debug_name: "visibility pass",
            ..Default::default()
        })?;
        pass.bind_render_pipeline(*self.draw)?;
        pass.bind_index_buffer(*left.indices, 0, IndexFormat::U32)?;
        pass.push_constants(push)?;
        pass.draw_indexed_indirect(*left.arguments, 0, 1, DRAW_BYTES)
    }
}

impl Survivors {
    fn new(ctx: &Context, triangle_count: u32) -> lvk::Result<Self> {
        let buffer = |usage, words: u64, debug_name| {
            let usage = BufferUsage::STORAGE | usage;
            ctx.create_buffer(&BufferDesc {
                usage,
                size_bytes: 4 * words,
                debug_name,
                ..BufferDesc::default()
            })
        };
        let groups = u64::from(triangle_count.div_ceil(GROUP));
        let triangles = u64::from(triangle_count);
        // index count, instance count, first index, vertex offset, first instance
        let arguments = [0_u32, 1, 0, 0, 0];
        Ok(Self {
            bits: buffer(BufferUsage::STORAGE, groups * u64::from(GROUP / 32), "survivor bits")?,
            counts: buffer(BufferUsage::STORAGE, groups, "survivor counts")?,
            indices: buffer(BufferUsage::INDEX, 3 * triangles, "survivor indices")?,
            triangles: buffer(BufferUsage::STORAGE, triangles, "survivors")?,
            arguments: ctx.create_buffer(&BufferDesc {
                usage: BufferUsage::STORAGE | BufferUsage::INDIRECT,
                data: Some(bytemuck::cast_slice(&arguments)),
                debug_name: "survivor draw",
                ..BufferDesc::default()
            })?,
        })
    }
}

fn compute(ctx: &Context, stage: &SampleStage) -> lvk::Result<Holder<ComputePipelineHandle>> {
    let shader = module(ctx, stage, &[])?;
    ctx.create_compute_pipeline(&ComputePipelineDesc {
        module: Some(*shader),
        layouts: LAYOUTS,
        debug_name: stage.name,
        ..ComputePipelineDesc::default()
    })
}

fn draw(ctx: &Context) -> lvk::Result<Holder<RenderPipelineHandle>> {
    let vertex = module(ctx, &pipelines::GEOMETRY_VERT, &[])?;
    let fragment = module(ctx, &pipelines::VISIBILITY_FRAG, &[])?;
    ctx.create_render_pipeline(&RenderPipelineDesc {
        vertex: Some(*vertex),
        fragment: Some(*fragment),
        cull: CullMode::None,
        color: &[ColorTarget::from(HardwareRaster::IMAGE)],
        depth: Some(DepthTest {
            format: HardwareRaster::DEPTH,
            compare: CompareOp::GreaterOrEqual,
            write: true,
        }),
        layouts: LAYOUTS,
        debug_name: "visibility pass",
        ..RenderPipelineDesc::default()
    })
}
