//! A command pool.

use std::rc::Rc;

use lvk::ash::vk;

use super::RawDevice;
use crate::error::BenchError;

/// A command pool, and the calls on command buffers of it.
pub(super) struct RawCommandPool {
    pool: vk::CommandPool,
    device: Rc<RawDevice>,
}

impl RawCommandPool {
    pub(super) fn new(device: &Rc<RawDevice>) -> Result<Self, BenchError> {
        let info = vk::CommandPoolCreateInfo::default()
            .flags(vk::CommandPoolCreateFlags::TRANSIENT)
            .queue_family_index(device.ctx.raw_queue_family());
        // SAFETY: the queue family is that of the device.
        let pool = unsafe { device.device.create_command_pool(&info, None) }
            .map_err(BenchError::hand_written("vkCreateCommandPool"))?;
        Ok(Self { pool, device: Rc::clone(device) })
    }

    /// Returns a new command buffer, which ends with the pool.
    pub(super) fn allocate(&self) -> Result<vk::CommandBuffer, BenchError> {
        let info = vk::CommandBufferAllocateInfo::default().command_pool(self.pool).command_buffer_count(1);
        // SAFETY: the pool is alive.
        let allocated = unsafe { self.device.device.allocate_command_buffers(&info) };
        Ok(allocated.map_err(BenchError::hand_written("vkAllocateCommandBuffers"))?[0])
    }

    /// Resets all command buffers. The GPU uses none of them.
    pub(super) fn reset(&self) -> Result<(), BenchError> {
        // SAFETY: nothing of the pool is in use.
        unsafe { self.device.device.reset_command_pool(self.pool, vk::CommandPoolResetFlags::empty()) }
            .map_err(BenchError::hand_written("vkResetCommandPool"))
    }

    /// Begins a command buffer of the pool, which is new or was reset.
    pub(super) fn begin(&self, commands: vk::CommandBuffer) -> Result<(), BenchError> {
        let info = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: the command buffer is in its initial state.
        unsafe { self.device.device.begin_command_buffer(commands, &info) }
            .map_err(BenchError::hand_written("vkBeginCommandBuffer"))
    }

    /// Ends a command buffer of the pool, which is being recorded.
    pub(super) fn end(&self, commands: vk::CommandBuffer) -> Result<(), BenchError> {
        // SAFETY: the command buffer is being recorded.
        unsafe { self.device.device.end_command_buffer(commands) }
            .map_err(BenchError::hand_written("vkEndCommandBuffer"))
    }
}

impl Drop for RawCommandPool {
    fn drop(&mut self) {
        // SAFETY: every submission was waited for.
        unsafe { self.device.device.destroy_command_pool(self.pool, None) };
    }
}
