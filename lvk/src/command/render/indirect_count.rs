//! Indirect draws whose number is in a buffer.

use std::sync::Arc;

use ash::vk;

use super::pass::RenderPass;
use crate::barrier::Use;
use crate::command::compute::check_arguments;
use crate::error::{Result, check_limit};
use crate::gpu::caps::optional_features::OptionalFeature;
use crate::handle::BufferHandle;
use crate::resource::Buffer;

/// The buffers with the arguments of draws and with their number. Both have
/// [`BufferUsage::INDIRECT`](crate::BufferUsage::INDIRECT), and all offsets are multiples of 4.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct IndirectCount {
    /// Buffer with the arguments.
    pub arguments: BufferHandle,
    /// Offset of the first arguments, in bytes.
    pub offset: u64,
    /// Distance from one draw's arguments to the next, in bytes: a multiple of 4, at least their size.
    pub stride: u32,
    /// Buffer with the number of draws, a `u32`.
    pub count: BufferHandle,
    /// Offset of the number, in bytes.
    pub count_offset: u64,
    /// Most draws, whatever number the buffer has. The arguments of this many draws must lie in the buffer.
    pub max_draws: u32,
}

impl RenderPass<'_> {
    /// As [`draw_indirect`](Self::draw_indirect), with the number of draws from a buffer (`vkCmdDrawIndirectCount`).
    ///
    /// # Errors
    /// Those of [`draw_indirect`](Self::draw_indirect); [`Unsupported`](crate::Error::Unsupported) without
    /// [`OptionalFeature::DrawIndirectCount`](crate::OptionalFeature::DrawIndirectCount). Without it, use a fixed
    /// number of draws, the last ones without vertices.
    pub fn draw_indirect_count(&mut self, draws: &IndirectCount) -> Result<()> {
        self.check_draw()?;
        let command = self.cmd.shared.gpu.device.fp_v1_2().cmd_draw_indirect_count;
        self.draw_indirect_count_with(draws, size_of::<vk::DrawIndirectCommand>(), command)
    }

    /// As [`draw_indexed_indirect`](Self::draw_indexed_indirect), with the number of draws from a buffer
    /// (`vkCmdDrawIndexedIndirectCount`).
    ///
    /// # Errors
    /// Those of both [`draw_indexed_indirect`](Self::draw_indexed_indirect) and
    /// [`draw_indirect_count`](Self::draw_indirect_count).
    pub fn draw_indexed_indirect_count(&mut self, draws: &IndirectCount) -> Result<()> {
        self.check_draw()?;
        self.bound_index_buffer()?;
        let command = self.cmd.shared.gpu.device.fp_v1_2().cmd_draw_indexed_indirect_count;
        self.draw_indirect_count_with(draws, size_of::<vk::DrawIndexedIndirectCommand>(), command)
    }

    /// As [`draw_mesh_tasks_indirect`](Self::draw_mesh_tasks_indirect), with the number of draws from a buffer
    /// (`vkCmdDrawMeshTasksIndirectCountEXT`).
    ///
    /// # Errors
    /// Those of both [`draw_mesh_tasks_indirect`](Self::draw_mesh_tasks_indirect) and
    /// [`draw_indirect_count`](Self::draw_indirect_count).
    pub fn draw_mesh_tasks_indirect_count(&mut self, draws: &IndirectCount) -> Result<()> {
        self.check_mesh_draw()?;
        let command = self.cmd.shared.gpu.mesh_functions()?.fp().cmd_draw_mesh_tasks_indirect_count_ext;
        self.draw_indirect_count_with(draws, size_of::<vk::DrawMeshTasksIndirectCommandEXT>(), command)
    }

    /// Records one of the three commands, which have the same signature, for arguments of `size` bytes a draw.
    fn draw_indirect_count_with(
        &mut self,
        draws: &IndirectCount,
        size: usize,
        command: vk::PFN_vkCmdDrawIndirectCount,
    ) -> Result<()> {
        let [arguments, count] = self.indirect_count_buffers(draws, size as u64)?;
        let IndirectCount { offset, stride, count_offset, max_draws, .. } = *draws;
        // SAFETY: the pass is ready for such a draw, as in `draw`, and the arguments and their number lie inside the
        // buffers.
        unsafe {
            command(self.cmd.raw(), arguments.raw, offset, count.raw, count_offset, max_draws, stride);
        }
        Ok(())
    }

    /// Returns the buffers of the arguments and of their number, and declares that the pass reads them.
    fn indirect_count_buffers(&mut self, draws: &IndirectCount, size: u64) -> Result<[Arc<Buffer>; 2]> {
        let gpu = &self.cmd.shared.gpu;
        gpu.require(OptionalFeature::DrawIndirectCount, "a number of draws from a buffer")?;
        let most = gpu.caps.limits.max_indirect_draws;
        let count = self.cmd.shared.store.buffers.get(draws.count)?;
        check_limit(&count.name, "draw count", draws.max_draws.into(), most.into())?;
        check_arguments(&count, draws.count_offset, size_of::<u32>() as u64)?;
        let IndirectCount { arguments, offset, max_draws, stride, .. } = *draws;
        let arguments = self.indirect_buffer(arguments, offset, max_draws, stride, size)?;
        self.read_in_pass(&count, Use::indirect())?;
        Ok([arguments, count])
    }
}
