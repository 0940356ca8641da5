//! A command buffer that is recorded and given up, for the cost of recording alone.

use std::rc::Rc;

use lvk::ash::vk;

use super::RawDevice;
use crate::error::BenchError;

/// A command buffer that is recorded and given up, again and again.
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
            .map_err(BenchError::of("vkCreateCommandPool"))?;
        let mut made = Self { pool, commands: vk::CommandBuffer::null(), device: Rc::clone(device) };
        let info = vk::CommandBufferAllocateInfo::default().command_pool(pool).command_buffer_count(1);
        // SAFETY: the pool was just made.
        let allocated = unsafe { device.device.allocate_command_buffers(&info) };
        made.commands = allocated.map_err(BenchError::of("vkAllocateCommandBuffers"))?[0];
        Ok(Rc::new(made))
    }

    /// Begins to record.
    pub(crate) fn begin(&self) -> Result<vk::CommandBuffer, BenchError> {
        let info = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: the command buffer is new, or was given up and reset.
        unsafe { self.device.device.begin_command_buffer(self.commands, &info) }
            .map_err(BenchError::of("vkBeginCommandBuffer"))?;
        Ok(self.commands)
    }

    /// Throws away what was recorded.
    pub(crate) fn give_up(&self) -> Result<(), BenchError> {
        // SAFETY: nothing of the pool was submitted.
        unsafe { self.device.device.reset_command_pool(self.pool, vk::CommandPoolResetFlags::empty()) }
            .map_err(BenchError::of("vkResetCommandPool"))
    }
}

impl Drop for RawRecorder {
    fn drop(&mut self) {
        // SAFETY: nothing of the pool was ever submitted.
        unsafe { self.device.device.destroy_command_pool(self.pool, None) };
    }
}
