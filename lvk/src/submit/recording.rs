//! Command buffers with their tracker: recorded, run by the GPU, and recorded again with all their memory.

use std::fmt;

use ash::vk;

use super::emit_barriers::Images;
use super::input_attachment_sets::InputSets;
use super::label_trail::LabelTrail;
use super::last_access::{QueueAccess, TimelineVector};
use crate::barrier::{ResourceId, Tracker};
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::queue::Queue;

/// A command buffer that is being recorded, submitted, or free.
pub(crate) struct Recording {
    /// Sequence number. It rises with every acquired command buffer. A command buffer begun ahead keeps its previous
    /// number.
    pub(crate) sequence: u64,
    /// The command buffer that the caller records.
    pub(crate) commands: vk::CommandBuffer,
    pub(crate) tracker: Tracker,
    pub(crate) images: Images,
    /// Resources that need no barriers on one queue, and waits between several queues.
    pub(crate) references: Vec<(ResourceId, QueueAccess)>,
    /// Values of other queues that the caller makes it wait for.
    pub(crate) after: TimelineVector,
    /// Name and labels, for the report of a lost device.
    pub(crate) labels: LabelTrail,
    /// Index of its queue.
    pub(crate) queue_index: usize,
    /// Timeline value, once it is submitted; 0 before.
    pub(super) value: u64,
    /// True if staging memory is kept for it.
    pub(super) is_staged: bool,
    /// Command pool of its own, so that any thread may record without a lock.
    pool: vk::CommandPool,
    /// See [`prologue`](Self::prologue). Allocated at the first barrier.
    prologue: Option<vk::CommandBuffer>,
    /// Input attachment sets of its render passes.
    inputs: InputSets,
}

impl Recording {
    pub(super) fn new(gpu: &Gpu, queue_index: usize) -> Result<Box<Self>> {
        let info = vk::CommandPoolCreateInfo::default()
            .flags(vk::CommandPoolCreateFlags::TRANSIENT)
            .queue_family_index(gpu.queues.family(queue_index));
        // SAFETY: the queue family is the device's own.
        let pool = unsafe { gpu.device.create_command_pool(&info, None) }
            .map_err(Error::vulkan("vkCreateCommandPool", CommandsName { debug_name: "", queue_index }))?;
        gpu.name(pool, "command pool");
        // SAFETY: where there is no command buffer, the pool is unused.
        let commands = allocate(gpu, pool, CommandsName { debug_name: "", queue_index })
            .inspect_err(|_| unsafe { gpu.device.destroy_command_pool(pool, None) })?;
        Ok(Box::new(Self {
            sequence: 0,
            commands,
            tracker: Tracker::default(),
            images: Images::default(),
            references: Vec::new(),
            after: TimelineVector::default(),
            labels: LabelTrail::default(),
            queue_index,
            value: 0,
            is_staged: false,
            pool,
            prologue: None,
            inputs: InputSets::default(),
        }))
    }

    /// Begins recording again. Neither the GPU nor other code uses the command buffer. On failure it is destroyed.
    pub(super) fn begin(mut self: Box<Self>, gpu: &Gpu) -> Result<Box<Self>> {
        match self.reset(gpu).and_then(|()| begin_commands(gpu, self.commands, self.name())) {
            Ok(()) => Ok(self),
            Err(error) => {
                self.destroy(gpu);
                Err(error)
            }
        }
    }

    fn reset(&mut self, gpu: &Gpu) -> Result<()> {
        (self.value, self.is_staged) = (0, false);
        self.after = TimelineVector::default();
        self.tracker.clear();
        self.images.clear();
        self.references.clear();
        self.clear_labels(gpu);
        self.inputs.reset();
        // SAFETY: the command buffers of the pool are not in use.
        unsafe { gpu.device.reset_command_pool(self.pool, vk::CommandPoolResetFlags::empty()) }
            .map_err(Error::vulkan("vkResetCommandPool", self.name()))
    }

    /// Sets the name in reports and in debuggers, until the command buffer is recorded again.
    pub(crate) fn set_name(&mut self, gpu: &Gpu, name: &str) {
        self.labels.set_name(name);
        gpu.name(self.commands, name);
    }

    /// Returns the name of the command buffer in errors.
    pub(crate) fn name(&self) -> CommandsName<'_> {
        CommandsName { debug_name: self.labels.name(), queue_index: self.queue_index }
    }

    fn clear_labels(&mut self, gpu: &Gpu) {
        if !self.labels.name().is_empty() {
            gpu.name(self.commands, "");
        }
        self.labels.clear();
    }

    /// Returns the timeline value of its submission; 0 before it.
    pub(super) fn value(&self) -> u64 {
        self.value
    }

    /// Returns the key of the staging memory for the command buffer, and marks that memory as in use.
    #[inline]
    pub(crate) fn staging_key(&mut self) -> u64 {
        self.is_staged = true;
        self.sequence
    }

    /// Returns a set of `count` input attachments for a render pass of the command buffer.
    pub(crate) fn input_set(
        &mut self,
        gpu: &Gpu,
        layout: vk::DescriptorSetLayout,
        count: u32,
    ) -> Result<vk::DescriptorSet> {
        self.inputs.acquire(gpu, layout, count)
    }

    /// Returns the command buffer that runs before the caller's commands. It holds the barriers between the queue's
    /// state and the first uses of the caller's commands.
    pub(super) fn prologue(&mut self, gpu: &Gpu) -> Result<vk::CommandBuffer> {
        if let Some(made) = self.prologue {
            return Ok(made);
        }
        let made = allocate(gpu, self.pool, self.name())?;
        gpu.name(made, "barriers before a command buffer");
        self.prologue = Some(made);
        Ok(made)
    }

    /// Destroys the command buffer. Neither the GPU nor other code uses it.
    pub(super) fn destroy(self, gpu: &Gpu) {
        // SAFETY: the command buffers of the pool are not in use.
        unsafe { gpu.device.destroy_command_pool(self.pool, None) };
        self.inputs.destroy(gpu);
    }
}

/// The name of a command buffer in errors: its debug name, or its queue where it has none.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CommandsName<'a> {
    /// Name given by [`set_name`](Recording::set_name); empty without one.
    debug_name: &'a str,
    queue_index: usize,
}

impl fmt::Display for CommandsName<'_> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.debug_name {
            "" => write!(out, "command buffer of the {} queue", Queue::ALL[self.queue_index].label()),
            name => out.write_str(name),
        }
    }
}

fn allocate(gpu: &Gpu, pool: vk::CommandPool, name: CommandsName<'_>) -> Result<vk::CommandBuffer> {
    let info = vk::CommandBufferAllocateInfo::default()
        .command_pool(pool)
        .level(vk::CommandBufferLevel::PRIMARY)
        .command_buffer_count(1);
    // SAFETY: the pool is alive, and no other thread uses it.
    let made = unsafe { gpu.device.allocate_command_buffers(&info) };
    made.map(|buffers| buffers[0]).map_err(Error::vulkan("vkAllocateCommandBuffers", name))
}

pub(super) fn begin_commands(gpu: &Gpu, commands: vk::CommandBuffer, name: CommandsName<'_>) -> Result<()> {
    let info = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
    // SAFETY: the command buffer is new or was reset with its pool.
    unsafe { gpu.device.begin_command_buffer(commands, &info) }
        .map_err(Error::vulkan("vkBeginCommandBuffer", name))
}

pub(super) fn end_commands(gpu: &Gpu, commands: vk::CommandBuffer, name: CommandsName<'_>) -> Result<()> {
    // SAFETY: the command buffer is being recorded, outside of a render pass.
    unsafe { gpu.device.end_command_buffer(commands) }.map_err(Error::vulkan("vkEndCommandBuffer", name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn command_buffers_without_a_debug_name_have_that_of_their_queue() {
        let name = |debug_name, queue_index| CommandsName { debug_name, queue_index }.to_string();
        assert_eq!(name("shadows", 0), "shadows");
        assert_eq!(name("", 0), "command buffer of the graphics queue");
        assert_eq!(name("", 2), "command buffer of the transfer queue");
    }
}
