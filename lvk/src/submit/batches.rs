//! What goes to a queue with one `vkQueueSubmit2`.

use ash::vk;

use crate::error::Result;
use crate::gpu::Gpu;

/// One or two batches, which begin once all that they wait for is there; the last signals. Emptied and filled again, so that
/// submissions take nothing from the heap.
#[derive(Default)]
pub(super) struct Batches {
    waits: Vec<vk::SemaphoreSubmitInfo<'static>>,
    commands: Vec<vk::CommandBufferSubmitInfo<'static>>,
    signals: Vec<vk::SemaphoreSubmitInfo<'static>>,
    /// Where the second batch begins among waits and commands, if there is one.
    second: Option<(usize, usize)>,
}

// SAFETY: none of the lists' structures points to a further one.
unsafe impl Send for Batches {}

impl Batches {
    pub(super) fn clear(&mut self) {
        self.waits.clear();
        self.commands.clear();
        self.signals.clear();
        self.second = None;
    }

    /// What is pushed next waits for these; what was pushed before need not.
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

    /// Signals when everything is done.
    pub(super) fn signal(&mut self, signals: impl IntoIterator<Item = vk::SemaphoreSubmitInfo<'static>>) {
        self.signals.extend(signals);
    }

    /// Hands everything to a queue.
    pub(super) fn submit(&self, gpu: &Gpu, queue_index: usize) -> Result<()> {
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
        unsafe { gpu.device.queue_submit2(*queue, submits, vk::Fence::null()) }
            .map_err(gpu.vulkan_error("vkQueueSubmit2"))
    }
}
