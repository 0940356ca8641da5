//! The contents of one `vkQueueSubmit2` call.

use ash::vk;

use crate::cpu_scope::cpu_scope;
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::queue::Queue;

/// One or two batches. A batch begins once all of its waits are satisfied, and the last one signals. The lists are
/// cleared and reused, so that submissions do not allocate on the heap.
#[derive(Default)]
pub(super) struct Batches {
    waits: Vec<vk::SemaphoreSubmitInfo<'static>>,
    commands: Vec<vk::CommandBufferSubmitInfo<'static>>,
    signals: Vec<vk::SemaphoreSubmitInfo<'static>>,
    /// Start of the second batch in the waits and commands, if there is a second batch.
    second: Option<(usize, usize)>,
}

// SAFETY: none of the Vulkan structures in the lists has a `pNext` pointer.
unsafe impl Send for Batches {}

impl Batches {
    pub(super) fn clear(&mut self) {
        self.waits.clear();
        self.commands.clear();
        self.signals.clear();
        self.second = None;
    }

    /// Adds waits for the commands that are pushed next. Commands pushed earlier do not wait for them.
    pub(super) fn wait(&mut self, waits: impl IntoIterator<Item = vk::SemaphoreSubmitInfo<'static>>) {
        let before = self.waits.len();
        self.waits.extend(waits);
        if self.waits.len() > before && !self.commands.is_empty() {
            self.second = Some((before, self.commands.len()));
        }
    }

    pub(super) fn push(&mut self, raw: vk::CommandBuffer) {
        self.commands.push(vk::CommandBufferSubmitInfo::default().command_buffer(raw));
    }

    /// Signals semaphores when all batches are done.
    pub(super) fn signal(&mut self, signals: impl IntoIterator<Item = vk::SemaphoreSubmitInfo<'static>>) {
        self.signals.extend(signals);
    }

    /// Submits the batches to a queue.
    pub(super) fn submit(&self, gpu: &Gpu, queue_index: usize) -> Result<()> {
        cpu_scope!("vkQueueSubmit2");
        let (waits, commands) = self.second.unwrap_or_default();
        let first = vk::SubmitInfo2::default()
            .wait_semaphore_infos(&self.waits[..waits])
            .command_buffer_infos(&self.commands[..commands]);
        let last = vk::SubmitInfo2::default()
            .wait_semaphore_infos(&self.waits[waits..])
            .command_buffer_infos(&self.commands[commands..])
            .signal_semaphore_infos(&self.signals);
        let both = [first, last];
        let submits = if self.second.is_some() { &both[..] } else { &both[1..] };
        let queue = gpu.queues.raw(queue_index);
        // SAFETY: the command buffers are complete and used once; the queue is locked.
        unsafe { gpu.device.queue_submit2(*queue, submits, vk::Fence::null()) }.map_err(Error::vulkan(
            "vkQueueSubmit2",
            format_args!("{} queue", Queue::ALL[queue_index].label()),
        ))
    }
}
