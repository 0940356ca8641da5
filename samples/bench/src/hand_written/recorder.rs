//! A command buffer that is recorded and discarded, to measure recording alone.

use std::rc::Rc;

use lvk::ash::vk;

use super::RawDevice;
use crate::error::BenchError;

/// A command buffer that is recorded and discarded repeatedly.
pub(crate) struct RawRecorder {
    pool: vk::CommandPool,
    commands: vk::CommandBuffer,
    device: Rc<RawDevice>,
}

impl RawRecorder {
    pub(crate) fn new(device: &Rc<RawDevice>) -> Result<Rc<Self>, BenchError> {
        let info = vk::CommandPoolCreateInfo::default()
            .flags(vk::CommandPoolCreateFlags::TRANSIENT)
            .queue_family_index(device.ctx.raw_queue_family());
        // SAFETY: the queue family is that of the device.
        let pool = unsafe { device.device.create_command_pool(&info, None) }
            .map_err(BenchError::hand_written("vkCreateCommandPool"))?;
        let mut made = Self { pool, commands: vk::CommandBuffer::null(), device: Rc::clone(device) };
        let info = vk::CommandBufferAllocateInfo::default().command_pool(pool).command_buffer_count(1);
        // SAFETY: the pool was just made.
        let allocated = unsafe { device.device.allocate_command_buffers(&info) };
        made.commands = allocated.map_err(BenchError::hand_written("vkAllocateCommandBuffers"))?[0];
        Ok(Rc::new(made))
    }

    /// Begins the recording.
    pub(crate) fn begin(&self) -> Result<vk::CommandBuffer, BenchError> {
        let info = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: the command buffer is new, or was discarded and reset.
        unsafe { self.device.device.begin_command_buffer(self.commands, &info) }
            .map_err(BenchError::hand_written("vkBeginCommandBuffer"))?;
        Ok(self.commands)
    }

    /// Discards the recorded commands.
    pub(crate) fn discard(&self) -> Result<(), BenchError> {
        // SAFETY: nothing of the pool was submitted.
        unsafe { self.device.device.reset_command_pool(self.pool, vk::CommandPoolResetFlags::empty()) }
            .map_err(BenchError::hand_written("vkResetCommandPool"))
    }
}

impl Drop for RawRecorder {
    fn drop(&mut self) {
        // SAFETY: nothing of the pool was ever submitted.
        unsafe { self.device.device.destroy_command_pool(self.pool, None) };
    }
}
