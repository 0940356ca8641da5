//! Vertex and index buffers, and draws of vertices.

use std::ops::Range;
use std::sync::Arc;

use ash::vk;

use super::pass::{BoundIndexBuffer, RenderPass};
use crate::barrier::Use;
use crate::command::compute::check_arguments;
use crate::error::{Error, Result, check_limit};
use crate::format::IndexFormat;
use crate::gpu::caps::optional_features::OptionalFeature;
use crate::handle::BufferHandle;
use crate::pipeline::FrontEnd;
use crate::resource::Buffer;
use crate::resource::buffer::BufferUsage;

impl RenderPass<'_> {
    /// Binds a buffer to a vertex binding of the pipeline, from `offset` bytes on (`vkCmdBindVertexBuffers`). The
    /// offset is a multiple of 4, so that all attributes of any pipeline are aligned.
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

    /// Binds an index buffer, from `offset` bytes on (`vkCmdBindIndexBuffer`).
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
        check_order("draw", "vertices", &vertices)?;
        check_order("draw", "instances", &instances)?;
        let (count, instance_count) = (vertices.end - vertices.start, instances.end - instances.start);
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
        check_order("draw_indexed", "indices", &indices)?;
        check_order("draw_indexed", "instances", &instances)?;
        let (count, instance_count) = (indices.end - indices.start, instances.end - instances.start);
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
        let (size, gpu) = (size_of::<vk::DrawIndirectCommand>(), &self.cmd.shared.gpu);
        let command = gpu.device.fp_v1_0().cmd_draw_indirect;
        self.draw_indirect_with(arguments, offset, draw_count, stride, size, command)
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
        let (size, gpu) = (size_of::<vk::DrawIndexedIndirectCommand>(), &self.cmd.shared.gpu);
        let command = gpu.device.fp_v1_0().cmd_draw_indexed_indirect;
        self.draw_indirect_with(arguments, offset, draw_count, stride, size, command)
    }

    /// Records one of the three commands, which have the same signature, for arguments of `size` bytes a draw: one call
    /// for all draws, or one for each if the device has no multi-draw.
    pub(super) fn draw_indirect_with(
        &mut self,
        arguments: BufferHandle,
        offset: u64,
        draw_count: u32,
        stride: u32,
        size: usize,
        command: vk::PFN_vkCmdDrawIndirect,
    ) -> Result<()> {
        let buffer = self.indirect_buffer(arguments, offset, draw_count, stride, size as u64)?;
        let multi = self.cmd.shared.gpu.caps.multi_draw_indirect;
        let (calls, draws) = if multi { (draw_count.min(1), draw_count) } else { (draw_count, 1) };
        for call in 0..calls {
            let offset = offset + u64::from(call) * u64::from(stride);
            // SAFETY: the pass is ready for such a draw, as in `draw`, and the arguments lie inside the buffer.
            unsafe { command(self.cmd.raw(), buffer.raw, offset, draws, stride) };
        }
        Ok(())
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

    /// Fails unless a pipeline with a vertex shader is bound, with all its inputs.
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

    /// Returns the error for the state that a draw lacks.
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

    /// Fails unless a pipeline with a mesh shader is bound, with all its inputs.
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
}

/// Fails if the range ends before it begins.
#[inline]
fn check_order(call: &str, what: &str, range: &Range<u32>) -> Result<()> {
    if range.start <= range.end { Ok(()) } else { Err(Error::reversed_range(call, what, range)) }
}
