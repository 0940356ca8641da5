//! Culling of instances by the camera's frustum and by what hides them, and the draws that it leaves.

use lvk::{
    BufferDesc, BufferHandle, BufferUsage, CommandBuffer, ComputePipelineHandle, Context, Dependencies,
    Holder, Readback, RenderPass,
};
use lvk_samples::app::array_buffer::{array, buffer};

use super::instances::{Draw, SceneInstances};
use super::layout::{CULLING_LAYOUTS, CullingConstants, GpuMeshRun, Push};
use crate::pipelines::{CULL, SAMPLE};

/// Vertices, instances, first vertex and first instance of an indirect draw.
type Arguments = [u32; 4];

/// Numbers that the shader counts for each mesh: instances that are drawn, and those in the frustum.
const COUNTS: usize = 2;

/// Leaves out instances that the camera does not see when surfaces are rasterised. Rays meet all of them: what is beside or behind
/// the camera, or hidden, casts shadows and is reflected.
pub(crate) struct Culling {
    pipeline: Holder<ComputePipelineHandle>,
    runs: Holder<BufferHandle>,
    visible: Holder<BufferHandle>,
    arguments: Holder<BufferHandle>,
    counts: Holder<BufferHandle>,
    /// A number for each instance: not 0 if it was visible. All are at first: the frame that draws most then hides most of the
    /// next. With none, the first depth would be empty, hide nothing, and call all of the frustum visible a frame later.
    was_visible: Holder<BufferHandle>,
    /// Triangles of an instance of each mesh.
    triangles: Vec<u64>,
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
            pipeline: CULL.create_compute_pipeline(ctx, SAMPLE, CULLING_LAYOUTS)?,
            runs: array(ctx, "instances of meshes", BufferUsage::STORAGE, &runs)?,
            visible: buffer(ctx, "visible instances", 4 * (instances.table.len() as u64 + 1))?,
            arguments: ctx.create_buffer(&desc)?,
            counts: buffer(ctx, "counts of instances", (4 * COUNTS * runs.len()) as u64)?,
            was_visible: array(
                ctx,
                "instances that were visible",
                BufferUsage::STORAGE,
                &vec![1_u32; instances.table.len() + 1],
            )?,
            triangles: instances.runs.iter().map(|run| triangles_of(run, &instances.draws)).collect(),
        })
    }

    pub(super) fn constants(&self) -> lvk::Result<CullingConstants> {
        Ok(CullingConstants {
            runs: self.runs.address()?,
            visible: self.visible.address()?,
            draw_arguments: self.arguments.address()?,
            drawn_counts: self.counts.address()?,
            was_visible: self.was_visible.address()?,
        })
    }

    /// Records the dispatch of a step: a work group for each mesh. The last step reads `depths`.
    pub(crate) fn record(
        &self,
        cmd: &mut CommandBuffer,
        push: &Push,
        depths: Option<BufferHandle>,
    ) -> lvk::Result<()> {
        if self.triangles.is_empty() {
            return Ok(());
        }
        let buffers = [*self.visible, *self.arguments, *self.counts, *self.was_visible];
        let read_buffers = depths.as_slice();
        let dependencies = Dependencies { buffers: &buffers, read_buffers, ..Dependencies::default() };
        cmd.bind_compute_pipeline(*self.pipeline)?;
        cmd.push_constants(push)?;
        cmd.dispatch([self.triangles.len() as u32, 1, 1], &dependencies)
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
        (4 * COUNTS * self.triangles.len()) as u64
    }

    /// Sums what the shader has counted.
    fn sum(&self, counts: &[[u32; COUNTS]]) -> DrawnInstances {
        let pairs = counts.iter().zip(&self.triangles);
        pairs.fold(DrawnInstances::default(), |sum, ([drawn, in_frustum], triangles)| DrawnInstances {
            count: sum.count + drawn,
            triangle_count: sum.triangle_count + u64::from(*drawn) * triangles,
            in_frustum: sum.in_frustum + in_frustum,
        })
    }
}

/// Counts of the instances and triangles that a frame has rasterised.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct DrawnInstances {
    /// Instances that were rasterised.
    pub count: u32,
    /// Their triangles.
    pub triangle_count: u64,
    /// Instances whose boxes reach into the camera's frustum.
    pub in_frustum: u32,
}

/// The number of instances that a frame has drawn, once it is known.
#[derive(Default)]
pub(crate) struct DrawnCounts {
    known: Option<DrawnInstances>,
    coming: Option<Readback>,
}

impl DrawnCounts {
    /// The numbers, once there are any.
    pub(crate) fn known(&self) -> Option<DrawnInstances> {
        self.known
    }

    /// Reads the numbers of the last frame. Waits for the frame.
    pub(crate) fn read(&mut self, ctx: &Context, culling: &Culling) -> lvk::Result<()> {
        let mut counts = vec![[0_u32; COUNTS]; culling.triangles.len()];
        if !counts.is_empty() {
            ctx.download_buffer(*culling.counts, 0, bytemuck::cast_slice_mut(&mut counts))?;
        }
        self.known = Some(culling.sum(&counts));
        Ok(())
    }

    /// Keeps the last numbers that have arrived, of a frame some time ago, and asks for the next.
    pub(crate) fn poll(&mut self, ctx: &Context, culling: &Culling) -> lvk::Result<()> {
        if culling.triangles.is_empty() {
            self.known = Some(DrawnInstances::default());
            return Ok(());
        }
        if let Some(coming) = self.coming.take() {
            if !coming.is_ready()? {
                self.coming = Some(coming);
                return Ok(());
            }
            let counts = bytemuck::pod_collect_to_vec(&coming.wait()?);
            self.known = Some(culling.sum(&counts));
        }
        self.coming = Some(ctx.read_buffer_later(*culling.counts, 0..culling.counts_bytes())?);
        Ok(())
    }
}

/// Triangles of an instance of a mesh.
fn triangles_of(run: &GpuMeshRun, draws: &[Draw]) -> u64 {
    let own = draws.iter().skip(run.first_draw as usize).take(run.draw_count as usize);
    own.map(|draw| u64::from(draw.triangle_count)).sum()
}
