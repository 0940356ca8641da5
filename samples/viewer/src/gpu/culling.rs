//! Culling of instances by the camera's frustum, and the draws that it leaves.

use lvk::{
    BufferDesc, BufferHandle, BufferUsage, CommandBuffer, ComputePipelineDesc, ComputePipelineHandle,
    Context, Dependencies, Holder, Readback, RenderPass,
};
use lvk_samples::app::array_buffer::{array, buffer};

use super::instances::SceneInstances;
use super::layout::{CULLING_LAYOUTS, CullingConstants, Push};
use crate::pipelines::{CULL, SAMPLE};

/// Vertices, instances, first vertex and first instance of an indirect draw.
type Arguments = [u32; 4];

/// Leaves out instances that the camera does not see when surfaces are rasterised. Rays meet all of them: what is beside or behind
/// the camera casts shadows and is reflected.
pub(crate) struct Culling {
    pipeline: Holder<ComputePipelineHandle>,
    runs: Holder<BufferHandle>,
    visible: Holder<BufferHandle>,
    arguments: Holder<BufferHandle>,
    counts: Holder<BufferHandle>,
    run_count: u32,
}

impl Culling {
    pub(super) fn new(ctx: &Context, instances: &SceneInstances) -> lvk::Result<Self> {
        // A buffer has at least one element.
        let mut arguments: Vec<Arguments> =
            instances.draws.iter().map(|draw| [3 * draw.triangle_count, 0, 0, 0]).collect();
        arguments.push([0; 4]);
        let mut runs = instances.runs.clone();
        runs.push(bytemuck::Zeroable::zeroed());
        let usage = BufferUsage::STORAGE | BufferUsage::INDIRECT;
        let data = Some(bytemuck::cast_slice(&arguments));
        let desc = BufferDesc { usage, data, debug_name: "draws", ..BufferDesc::default() };
        Ok(Self {
            pipeline: pipeline(ctx)?,
            runs: array(ctx, "instances of meshes", BufferUsage::STORAGE, &runs)?,
            visible: buffer(ctx, "visible instances", 4 * (instances.table.len() as u64 + 1))?,
            arguments: ctx.create_buffer(&desc)?,
            counts: buffer(ctx, "counts of instances", 4 * runs.len() as u64)?,
            run_count: instances.runs.len() as u32,
        })
    }

    pub(super) fn constants(&self) -> lvk::Result<CullingConstants> {
        Ok(CullingConstants {
            runs: self.runs.address()?,
            visible: self.visible.address()?,
            draw_arguments: self.arguments.address()?,
            drawn_counts: self.counts.address()?,
        })
    }

    /// Records the dispatch: a work group for each mesh.
    pub(crate) fn record(&self, cmd: &mut CommandBuffer, push: &Push) -> lvk::Result<()> {
        if self.run_count == 0 {
            return Ok(());
        }
        let buffers = [*self.visible, *self.arguments, *self.counts];
        cmd.bind_compute_pipeline(*self.pipeline)?;
        cmd.push_constants(push)?;
        cmd.dispatch([self.run_count, 1, 1], &Dependencies { buffers: &buffers, ..Dependencies::default() })
    }

    /// Buffers that draws read.
    pub(crate) fn reads(&self) -> [BufferHandle; 2] {
        [*self.visible, *self.arguments]
    }

    /// Draws what is left of the draw with this number.
    pub(crate) fn draw(&self, pass: &mut RenderPass<'_>, number: usize) -> lvk::Result<()> {
        let stride = size_of::<Arguments>();
        pass.draw_indirect(*self.arguments, (stride * number) as u64, 1, stride as u32)
    }

    fn counts_bytes(&self) -> u64 {
        4 * u64::from(self.run_count)
    }
}

/// The number of instances that a frame has drawn.
#[derive(Default)]
pub(crate) struct DrawnInstances {
    count: Option<u32>,
    coming: Option<Readback>,
}

impl DrawnInstances {
    /// The number, once there is one.
    pub(crate) fn count(&self) -> Option<u32> {
        self.count
    }

    /// Reads the number of the last frame. Waits for the frame.
    pub(crate) fn read(&mut self, ctx: &Context, culling: &Culling) -> lvk::Result<()> {
        let mut counts = vec![0_u32; culling.run_count as usize];
        if !counts.is_empty() {
            ctx.download_buffer(*culling.counts, 0, bytemuck::cast_slice_mut(&mut counts))?;
        }
        self.count = Some(counts.iter().sum());
        Ok(())
    }

    /// Keeps the last number that has arrived, of a frame some time ago, and asks for the next.
    pub(crate) fn poll(&mut self, ctx: &Context, culling: &Culling) -> lvk::Result<()> {
        if culling.run_count == 0 {
            self.count = Some(0);
            return Ok(());
        }
        if let Some(coming) = self.coming.take() {
            if !coming.is_ready()? {
                self.coming = Some(coming);
                return Ok(());
            }
            let bytes = coming.wait()?;
            self.count = Some(bytes.chunks_exact(4).map(bytemuck::pod_read_unaligned::<u32>).sum());
        }
        self.coming = Some(ctx.read_buffer_later(*culling.counts, 0..culling.counts_bytes())?);
        Ok(())
    }
}

fn pipeline(ctx: &Context) -> lvk::Result<Holder<ComputePipelineHandle>> {
    let module = CULL.create(ctx, SAMPLE)?;
    ctx.create_compute_pipeline(&ComputePipelineDesc {
        module: Some(*module),
        layouts: CULLING_LAYOUTS,
        debug_name: CULL.name,
        ..ComputePipelineDesc::default()
    })
}
