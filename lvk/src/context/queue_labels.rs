//! Labels of queues for debuggers.

use super::Context;
use crate::gpu::debug::label::Label;
use crate::queue::Queue;

impl Context {
    /// Opens a labelled range of submissions to a queue for debuggers (`vkQueueBeginDebugUtilsLabelEXT`), for example
    /// all submissions of a frame. Queues that share a Vulkan queue share its labels. Does nothing where no tool reads
    /// labels: see [`ContextDesc::debug_names`](crate::ContextDesc::debug_names).
    ///
    /// The range covers submissions in the order in which they reach the Vulkan queue, from all threads.
    pub fn push_queue_label<'a>(&self, queue: Queue, label: impl Into<Label<'a>>) {
        self.device_state().gpu.begin_queue_label(queue, label.into());
    }

    /// Closes the innermost labelled range of a queue (`vkQueueEndDebugUtilsLabelEXT`). If none is open, does nothing and,
    /// where a tool reads labels, tells so by a warning of the `log` crate.
    pub fn pop_queue_label(&self, queue: Queue) {
        self.device_state().gpu.end_queue_label(queue);
    }

    /// Inserts a label between two submissions to a queue (`vkQueueInsertDebugUtilsLabelEXT`).
    pub fn insert_queue_label<'a>(&self, queue: Queue, label: impl Into<Label<'a>>) {
        self.device_state().gpu.insert_queue_label(queue, label.into());
    }
}
