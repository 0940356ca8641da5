//! Culling by a compute shader, and the draws that it leaves.

use lvk::{
    BufferDesc, BufferHandle, BufferUsage, CommandBuffer, ComputePipelineHandle, Context, Dependencies,
    Holder, IndirectCount, RenderPass,
};

use super::config::DrawPath;
use super::draws::Draw;
use super::frame::GpuDraw;
use super::pipelines::{CULL, SAMPLE};
use crate::app::array_buffer::array;
use crate::rtx::compute_pipeline;

/// Views that are culled for: the camera's and the sun's.
pub(super) const VIEWS: usize = 2;
/// Numbers of the arguments of a draw: vertices, instances, first vertex, first instance.
const ARGUMENTS: usize = 4;
const STRIDE: u32 = (ARGUMENTS * size_of::<u32>()) as u32;

/// Culls the draws of a scene for both views.
pub(super) struct Culling {
    pub(super) pipeline: Holder<ComputePipelineHandle>,
    draws: Holder<BufferHandle>,
    arguments: [Holder<BufferHandle>; VIEWS],
    counts: Holder<BufferHandle>,
    draw_count: u32,
}

impl Culling {
    pub(super) fn new(ctx: &Context, draws: &[Draw]) -> lvk::Result<Self> {
        let table: Vec<_> = draws.iter().map(gpu_draw).collect();
        let buffer = |debug_name, size: usize| {
            let usage = BufferUsage::STORAGE | BufferUsage::INDIRECT;
            let size_bytes = size as u64;
            ctx.create_buffer(&BufferDesc { usage, size_bytes, debug_name, ..BufferDesc::default() })
        };
        let arguments = |debug_name| buffer(debug_name, draws.len() * STRIDE as usize);
        Ok(Self {
            pipeline: Self::pipeline(ctx)?,
            draws: array(ctx, "draws", BufferUsage::STORAGE, &table)?,
            arguments: [arguments("draws of the camera")?, arguments("draws of the sun")?],
            counts: buffer("counts of draws", VIEWS * size_of::<u32>())?,
            draw_count: draws.len() as u32,
        })
    }

    pub(super) fn pipeline(ctx: &Context) -> lvk::Result<Holder<ComputePipelineHandle>> {
        compute_pipeline(ctx, SAMPLE, CULL)
    }

    pub(super) fn draw_count(&self) -> u32 {
        self.draw_count
    }

    /// Addresses of the draws, of each view's arguments, and of the counts.
    pub(super) fn addresses(&self) -> lvk::Result<(u64, [u64; VIEWS], u64)> {
        let [camera, sun] = &self.arguments;
        let arguments = [camera.address()?, sun.address()?];
        Ok((self.draws.address()?, arguments, self.counts.address()?))
    }

    /// Records the dispatch: a work group for each view.
    pub(super) fn record(&self, cmd: &mut CommandBuffer, frame: u64) -> lvk::Result<()> {
        let [camera, sun] = &self.arguments;
        let buffers = [camera.handle(), sun.handle(), self.counts.handle()];
        cmd.bind_compute_pipeline(*self.pipeline)?;
        cmd.push_constants(&frame)?;
        cmd.dispatch([VIEWS as u32, 1, 1], &Dependencies { buffers: &buffers, ..Dependencies::default() })
    }

    /// Buffers that a pass reads to draw the remaining draws of a view.
    pub(super) fn reads(&self, view: usize) -> [BufferHandle; 2] {
        [self.arguments[view].handle(), self.counts.handle()]
    }

    /// Draws what is left of a view, in a pass that [`reads`](Self::reads) it.
    pub(super) fn draw(&self, pass: &mut RenderPass<'_>, view: usize, path: DrawPath) -> lvk::Result<()> {
        let arguments = self.arguments[view].handle();
        match path {
            DrawPath::Counted => pass.draw_indirect_count(&IndirectCount {
                arguments,
                offset: 0,
                stride: STRIDE,
                count: *self.counts,
                count_offset: (view * size_of::<u32>()) as u64,
                max_draws: self.draw_count,
            }),
            DrawPath::Padded => pass.draw_indirect(arguments, 0, self.draw_count, STRIDE),
        }
    }

    /// Returns the number of draws that the last frame left of each view. Waits for the frame.
    pub(super) fn counts(&self, ctx: &Context) -> lvk::Result<[u32; VIEWS]> {
        let mut counts = [0_u32; VIEWS];
        ctx.download_buffer(*self.counts, 0, bytemuck::cast_slice_mut(&mut counts))?;
        Ok(counts)
    }

    /// The buffer of the counts, to be read later.
    pub(super) fn counts_buffer(&self) -> BufferHandle {
        *self.counts
    }

    /// First triangles of the draws that the last frame left of a view, in the order in which they are drawn. Waits for it.
    pub(super) fn survivors(&self, ctx: &Context, view: usize, path: DrawPath) -> lvk::Result<Vec<u32>> {
        let count = match path {
            DrawPath::Counted => self.counts(ctx)?[view],
            DrawPath::Padded => self.draw_count,
        };
        let mut words = vec![[0_u32; ARGUMENTS]; count as usize];
        if count > 0 {
            ctx.download_buffer(self.arguments[view].handle(), 0, bytemuck::cast_slice_mut(&mut words))?;
        }
        Ok(words.iter().filter(|[vertices, ..]| *vertices > 0).map(|[_, _, first, _]| first / 3).collect())
    }
}

fn gpu_draw(draw: &Draw) -> GpuDraw {
    GpuDraw {
        low: draw.low,
        first_vertex: 3 * draw.first_triangle,
        high: draw.high,
        vertex_count: 3 * draw.triangle_count,
    }
}
