//! Draws inside a render pass.

use std::ops::Range;
use std::sync::Arc;

use ash::vk;

use super::CommandBuffer;
use super::attachments::PassTargets;
use super::compute::check_arguments;
use super::dynamic_state::{DynamicState, READ_ONLY_DEPTH_ERROR};
use super::local_read::TargetHazards;
use super::pass_area::PassArea;
use super::push_constants::word_mask;
use super::recording_state::RecordingState;
use crate::barrier::Use;
use crate::error::{Error, Result, check_limit};
use crate::format::IndexFormat;
use crate::gpu::caps::limits::Limits;
use crate::gpu::caps::optional_features::OptionalFeature;
use crate::handle::{BufferHandle, RenderPipelineHandle};
use crate::pipeline::{FrontEnd, RenderPipeline};
use crate::resource::Buffer;
use crate::resource::buffer::BufferUsage;
use crate::submit::Recording;

/// A render pass being recorded. It borrows the command buffer, so nothing but draws can be recorded until it is
/// dropped, which ends the pass (`vkCmdEndRendering`).
///
/// ```compile_fail,E0499
/// fn no_dispatch_inside(cmd: &mut lvk::CommandBuffer, pass: &lvk::RenderPassDesc<'_>) -> lvk::Result<()> {
///     let mut pass = cmd.begin_rendering(pass)?;
///     cmd.dispatch([1, 1, 1], &lvk::Dependencies::default())?;
///     pass.draw(0..3, 0..1)
/// }
/// ```
pub struct RenderPass<'a> {
    pub(super) cmd: &'a mut CommandBuffer,
    pub(super) targets: PassTargets,
    pub(super) dynamic: DynamicState,
    pub(super) labelled: bool,
    /// Labels open around the pass.
    pub(super) labels_outside: u32,
    pub(super) hazards: TargetHazards,
    pub(super) pipeline: Option<Arc<RenderPipeline>>,
    draws: Option<DrawRequirements>,
    indices: Option<BoundIndexBuffer>,
    vertex_slots: u32,
}

/// What draws with the bound pipeline need, gathered when it is bound so that a draw looks at no more than this.
struct DrawRequirements {
    vertex_slots: u32,
    /// A bit for each 4 bytes of push constants.
    push_constants: u64,
}

impl DrawRequirements {
    /// Nothing for a pipeline that has no vertex shader.
    fn for_pipeline(pipeline: &RenderPipeline) -> Option<Self> {
        (pipeline.front_end == FrontEnd::Vertex).then(|| Self {
            vertex_slots: (1 << pipeline.vertex_binding_count) - 1,
            push_constants: word_mask(0, pipeline.push_constant_bytes),
        })
    }
}

/// The index buffer bound last.
pub(super) struct BoundIndexBuffer {
    buffer: Arc<Buffer>,
    count: u64,
}

impl<'a> RenderPass<'a> {
    pub(super) fn new(cmd: &'a mut CommandBuffer, targets: PassTargets, labelled: bool) -> Self {
        let [width, height] = targets.extent;
        let labels_outside = cmd.open_labels - u32::from(labelled);
        let pass = Self {
            cmd,
            targets,
            dynamic: DynamicState::default(),
            labelled,
            labels_outside,
            hazards: TargetHazards::default(),
            pipeline: None,
            draws: None,
            indices: None,
            vertex_slots: 0,
        };
        pass.set_viewport([0.0, 0.0, width as f32, height as f32], [0.0, 1.0]);
        pass.set_scissor(pass.targets.area);
        pass
    }

    /// Width and height of the targets in pixels.
    pub fn extent(&self) -> [u32; 2] {
        self.targets.extent
    }

    /// Binds a graphics pipeline for the draws that follow. Its formats and views must be those of the pass, and it may
    /// not write to a read-only depth target.
    pub fn bind_render_pipeline(&mut self, pipeline: RenderPipelineHandle) -> Result<()> {
        let pipeline = self.cmd.shared.store.render_pipelines.get(pipeline)?;
        let targets = &self.targets;
        if pipeline.shape != targets.shape {
            let message = format!("it draws to {}, but the pass has {}", pipeline.shape, targets.shape);
            return Err(Error::usage(&*pipeline.name, message));
        }
        let writes = pipeline.writes_stencil || pipeline.pass_state.depth.is_some_and(|depth| depth.write);
        if targets.read_only_depth && writes {
            return Err(Error::usage(&*pipeline.name, READ_ONLY_DEPTH_ERROR));
        }
        targets.inputs.check_reads(&pipeline)?;
        self.check_shading_rates(&pipeline)?;
        if !pipeline.query_stages.is_empty() {
            self.cmd.use_accel_structs(pipeline.query_stages);
            let remedy =
                "create the pipeline before the pass begins, or list a structure in the pass's dependencies";
            self.track_in_pass("what the pipeline's ray queries see", &pipeline.name, remedy)?;
        }
        self.order_target_accesses(&pipeline);
        let point = vk::PipelineBindPoint::GRAPHICS;
        self.cmd.bind_pipeline(point, pipeline.raw, &pipeline.name, pipeline.push_constant_bytes);
        self.draws = DrawRequirements::for_pipeline(&pipeline);
        self.set_pipeline_state(&pipeline.pass_state);
        self.pipeline = Some(pipeline);
        Ok(())
    }

    /// Sets the push constants; see [`CommandBuffer::push_constants`].
    #[inline]
    pub fn push_constants<T: bytemuck::NoUninit>(&mut self, constants: &T) -> Result<()> {
        self.cmd.push_constants(constants)
    }

    /// Maps clip space to pixels: x, y, width, height, and the depth range. Heights may be negative to flip y.
    pub fn viewport(&mut self, rectangle: [f32; 4], depth: [f32; 2]) -> Result<()> {
        let limits = &self.cmd.shared.gpu.caps.limits;
        let depths = depth.iter().all(|end| (0.0..=1.0).contains(end));
        if !depths || !viewport_fits(rectangle, limits) {
            let message = format!(
                "a viewport needs a width over 0, sides up to {:?}, corners between {:?}, and depths from 0 to 1, not \
                 {rectangle:?} and {depth:?}",
                limits.max_viewport, limits.viewport_bounds
            );
            return Err(Error::usage("viewport", message));
        }
        self.set_viewport(rectangle, depth);
        Ok(())
    }

    /// Draws only inside of a rectangle: offset and extent in pixels, inside the pass's area.
    pub fn scissor(&mut self, offset: [u32; 2], extent: [u32; 2]) -> Result<()> {
        let area = self.targets.area;
        let wanted = PassArea { offset, extent };
        if !area.contains(wanted) {
            let message =
                format!("{offset:?} + {extent:?} is outside of {:?} + {:?}", area.offset, area.extent);
            return Err(Error::usage("scissor", message));
        }
        self.set_scissor(wanted);
        Ok(())
    }

    /// Binds a buffer to a vertex binding of the pipeline, from `offset` bytes on (`vkCmdBindVertexBuffers`): a multiple of 4, so
    /// that whatever attributes the pipeline has are aligned.
    pub fn bind_vertex_buffer(&mut self, slot: u32, buffer: BufferHandle, offset: u64) -> Result<()> {
        const SLOTS: u32 = 16;
        let buffer = self.cmd.shared.store.buffers.get(buffer)?;
        buffer.check_usage(BufferUsage::VERTEX)?;
        buffer.check_range(offset, 1)?;
        if !offset.is_multiple_of(4) {
            return Err(Error::usage(
                &buffer.name,
                format!("the vertex offset {offset} is no multiple of 4"),
            ));
        }
        if slot >= SLOTS {
            return Err(Error::usage(
                &buffer.name,
                format!("vertex slot {slot} does not exist, there are {SLOTS}"),
            ));
        }
        self.read_in_pass(&buffer, Use::vertex())?;
        // SAFETY: the buffer has the usage and the offset lies inside of it.
        unsafe {
            let device = &self.cmd.shared.gpu.device;
            device.cmd_bind_vertex_buffers(self.cmd.raw(), slot, &[buffer.raw], &[offset]);
        }
        self.vertex_slots |= 1 << slot;
        Ok(())
    }

    /// Binds indices, from `offset` bytes on (`vkCmdBindIndexBuffer`).
    pub fn bind_index_buffer(
        &mut self,
        buffer: BufferHandle,
        offset: u64,
        format: IndexFormat,
    ) -> Result<()> {
        let buffer = self.cmd.shared.store.buffers.get(buffer)?;
        buffer.check_usage(BufferUsage::INDEX)?;
        if format == IndexFormat::U8 {
            self.cmd.shared.gpu.require(OptionalFeature::IndexTypeUint8, "a buffer of 8-bit indices")?;
        }
        let size = u64::from(format.size_bytes());
        if !offset.is_multiple_of(size) {
            return Err(Error::usage(
                &buffer.name,
                format!("the index offset {offset} is no multiple of {size}"),
            ));
        }
        buffer.check_range(offset, size)?;
        self.read_in_pass(&buffer, Use::index())?;
        // SAFETY: the buffer has the usage and the offset is aligned and inside of it.
        unsafe {
            let device = &self.cmd.shared.gpu.device;
            device.cmd_bind_index_buffer(self.cmd.raw(), buffer.raw, offset, format.raw());
        }
        self.indices = Some(BoundIndexBuffer { count: (buffer.size_bytes - offset) / size, buffer });
        Ok(())
    }

    /// Draws vertices (`vkCmdDraw`).
    #[inline]
    pub fn draw(&mut self, vertices: Range<u32>, instances: Range<u32>) -> Result<()> {
        self.check_draw()?;
        let (count, instance_count) = (range_length(&vertices), range_length(&instances));
        // SAFETY: a pipeline is bound with all its vertex buffers and push constants.
        unsafe {
            let device = &self.cmd.shared.gpu.device;
            device.cmd_draw(self.cmd.raw(), count, instance_count, vertices.start, instances.start);
        }
        Ok(())
    }

    /// Draws vertices by index; `base_vertex` is added to each (`vkCmdDrawIndexed`).
    pub fn draw_indexed(
        &mut self,
        indices: Range<u32>,
        base_vertex: i32,
        instances: Range<u32>,
    ) -> Result<()> {
        self.check_draw()?;
        let bound = self.bound_index_buffer()?;
        if u64::from(indices.end) > bound.count {
            let message = format!("indices {indices:?} are drawn, but {} are bound", bound.count);
            return Err(Error::usage(&bound.buffer.name, message));
        }
        let (count, instance_count) = (range_length(&indices), range_length(&instances));
        // SAFETY: as in `draw`, and the indices lie inside the bound buffer.
        unsafe {
            let device = &self.cmd.shared.gpu.device;
            let raw = self.cmd.raw();
            device.cmd_draw_indexed(raw, count, instance_count, indices.start, base_vertex, instances.start);
        }
        Ok(())
    }

    /// Draws `draw_count` times with arguments (`VkDrawIndirectCommand`) from a buffer with
    /// [`BufferUsage::INDIRECT`], `stride` bytes apart (`vkCmdDrawIndirect`).
    pub fn draw_indirect(
        &mut self,
        arguments: BufferHandle,
        offset: u64,
        draw_count: u32,
        stride: u32,
    ) -> Result<()> {
        self.check_draw()?;
        let size = size_of::<vk::DrawIndirectCommand>() as u64;
        let buffer = self.indirect_buffer(arguments, offset, draw_count, stride, size)?;
        let (device, raw) = (&self.cmd.shared.gpu.device, self.cmd.raw());
        for (offset, count) in self.indirect_calls(offset, draw_count, stride) {
            // SAFETY: as in `draw`, and the arguments lie inside the buffer.
            unsafe { device.cmd_draw_indirect(raw, buffer.raw, offset, count, stride) };
        }
        Ok(())
    }

    /// Draws by index `draw_count` times with arguments (`VkDrawIndexedIndirectCommand`) from a buffer with
    /// [`BufferUsage::INDIRECT`], `stride` bytes apart (`vkCmdDrawIndexedIndirect`).
    pub fn draw_indexed_indirect(
        &mut self,
        arguments: BufferHandle,
        offset: u64,
        draw_count: u32,
        stride: u32,
    ) -> Result<()> {
        self.check_draw()?;
        self.bound_index_buffer()?;
        let size = size_of::<vk::DrawIndexedIndirectCommand>() as u64;
        let buffer = self.indirect_buffer(arguments, offset, draw_count, stride, size)?;
        let (device, raw) = (&self.cmd.shared.gpu.device, self.cmd.raw());
        for (offset, count) in self.indirect_calls(offset, draw_count, stride) {
            // SAFETY: as in `draw`, and the arguments lie inside the buffer.
            unsafe { device.cmd_draw_indexed_indirect(raw, buffer.raw, offset, count, stride) };
        }
        Ok(())
    }

    /// One call for all draws, or one for each where the device takes no more.
    pub(super) fn indirect_calls(
        &self,
        offset: u64,
        draw_count: u32,
        stride: u32,
    ) -> impl Iterator<Item = (u64, u32)> + use<> {
        let multi = self.cmd.shared.gpu.caps.multi_draw_indirect;
        let (calls, draws) = if multi { (draw_count.min(1), draw_count) } else { (draw_count, 1) };
        (0..calls).map(move |call| (offset + u64::from(call) * u64::from(stride), draws))
    }

    pub(super) fn indirect_buffer(
        &mut self,
        arguments: BufferHandle,
        offset: u64,
        draw_count: u32,
        stride: u32,
        size: u64,
    ) -> Result<Arc<Buffer>> {
        let buffer = self.cmd.shared.store.buffers.get(arguments)?;
        if u64::from(stride) < size || !stride.is_multiple_of(4) {
            let message = format!("the stride {stride} must be a multiple of 4 and at least {size} bytes");
            return Err(Error::usage(&buffer.name, message));
        }
        let limits = &self.cmd.shared.gpu.caps.limits;
        if self.cmd.shared.gpu.caps.multi_draw_indirect {
            check_limit(&buffer.name, "draw count", draw_count.into(), limits.max_indirect_draws.into())?;
        }
        let bytes = u64::from(draw_count.saturating_sub(1)) * u64::from(stride) + size;
        check_arguments(&buffer, offset, bytes)?;
        self.read_in_pass(&buffer, Use::indirect())?;
        Ok(buffer)
    }

    pub(super) fn bound_index_buffer(&self) -> Result<&BoundIndexBuffer> {
        self.indices.as_ref().ok_or_else(|| Error::usage("draw_indexed", "bind an index buffer first"))
    }

    /// Fails unless a pipeline with a vertex shader is bound with all it reads.
    #[inline]
    pub(super) fn check_draw(&mut self) -> Result<()> {
        self.hazards.drawn = true;
        match &self.draws {
            Some(needs)
                if self.vertex_slots & needs.vertex_slots == needs.vertex_slots
                    && self.cmd.has_pushed(needs.push_constants) =>
            {
                Ok(())
            }
            _ => Err(self.draw_error()),
        }
    }

    /// What is missing for a draw.
    #[cold]
    fn draw_error(&self) -> Error {
        let pipeline = match self.bound_pipeline("draw") {
            Ok(pipeline) => pipeline,
            Err(nothing_bound) => return nothing_bound,
        };
        if pipeline.front_end != FrontEnd::Vertex {
            let message = "it has a mesh shader; draw with draw_mesh_tasks or draw_mesh_tasks_indirect";
            return Error::usage(&*pipeline.name, message);
        }
        let needed = (1_u32 << pipeline.vertex_binding_count) - 1;
        if self.vertex_slots & needed != needed {
            let message = format!("it reads {} vertex buffers; bind them all", pipeline.vertex_binding_count);
            return Error::usage(&*pipeline.name, message);
        }
        self.cmd.missing_constants_error(&pipeline.name, pipeline.push_constant_bytes)
    }

    /// Fails unless a pipeline with a mesh shader is bound with all it reads.
    pub(super) fn check_mesh_draw(&mut self) -> Result<()> {
        self.hazards.drawn = true;
        let pipeline = self.bound_pipeline("draw_mesh_tasks")?;
        if pipeline.front_end == FrontEnd::Vertex {
            let message = "it has no mesh shader; draw with draw, draw_indexed or their indirect forms";
            return Err(Error::usage(&*pipeline.name, message));
        }
        self.cmd.state.queries.check_mesh_draw()?;
        self.cmd.check_pushed(&pipeline.name, pipeline.push_constant_bytes)
    }

    pub(super) fn bound_pipeline(&self, call: &str) -> Result<&RenderPipeline> {
        self.pipeline.as_deref().ok_or_else(|| Error::usage(call, "bind a render pipeline first"))
    }

    /// The pass reads a buffer; no barrier can be placed any more.
    pub(super) fn read_in_pass(&mut self, buffer: &Buffer, next: Use) -> Result<()> {
        self.cmd.use_buffer(buffer, next);
        self.track_in_pass("the buffer", &buffer.name, "list it in the pass's dependencies")
    }

    fn track_in_pass(&mut self, what: &str, name: &str, remedy: &str) -> Result<()> {
        let Recording { tracker, images, .. } = &mut **self.cmd.recording;
        let RecordingState { accesses: uses, texture_cache: found_textures, barriers, .. } =
            &mut **self.cmd.state;
        if uses.needs_barriers(tracker) {
            uses.clear();
            let message = format!("{what} was written earlier in this command buffer; {remedy}");
            return Err(Error::usage(name, message));
        }
        barriers.clear();
        uses.track(found_textures, tracker, images, barriers);
        Ok(())
    }

    fn set_viewport(&self, [x, y, width, height]: [f32; 4], [min_depth, max_depth]: [f32; 2]) {
        let viewport = vk::Viewport { x, y, width, height, min_depth, max_depth };
        // SAFETY: the numbers are checked and a pass is open.
        unsafe { self.cmd.shared.gpu.device.cmd_set_viewport(self.cmd.raw(), 0, &[viewport]) };
    }

    fn set_scissor(&self, area: PassArea) {
        // SAFETY: the rectangle lies inside the targets and a pass is open.
        unsafe { self.cmd.shared.gpu.device.cmd_set_scissor(self.cmd.raw(), 0, &[area.raw()]) };
    }
}

impl Drop for RenderPass<'_> {
    fn drop(&mut self) {
        self.cmd.end_rendering();
        self.cmd.pop_labels(self.labels_outside);
    }
}

impl std::fmt::Debug for RenderPass<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("RenderPass").field("extent", &self.targets.extent).finish()
    }
}

fn viewport_fits([x, y, width, height]: [f32; 4], limits: &Limits) -> bool {
    let [low, high] = limits.viewport_bounds;
    let sides = width > 0.0
        && width <= limits.max_viewport[0] as f32
        && height.abs() <= limits.max_viewport[1] as f32;
    // Comparisons with what is no number are false.
    sides && [x, x + width, y, y + height].iter().all(|at| (low..=high).contains(at))
}

#[inline]
fn range_length(range: &Range<u32>) -> u32 {
    range.end.saturating_sub(range.start)
}
