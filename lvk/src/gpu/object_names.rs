//! Names of a device's objects, and labels in its command buffers and on its queues, for debuggers.

use std::sync::atomic::Ordering;

use ash::vk;

use super::debug::label::Label;
use super::debug::messenger::c_name;
use super::device::Gpu;
use super::start::driver_workarounds::with_shared_loader_lock;
use crate::queue::Queue;

impl Gpu {
    /// True if a tool reads names and labels.
    pub(crate) fn names_objects(&self) -> bool {
        self.debug_utils.is_some()
    }

    /// Names an object for the validation layer and debuggers, if a tool reads names.
    pub(crate) fn name<H: vk::Handle>(&self, object: H, name: &str) {
        let Some(ext) = &self.debug_utils else { return };
        let name = c_name(name);
        let info = vk::DebugUtilsObjectNameInfoEXT::default().object_handle(object).object_name(&name);
        // SAFETY: the object is alive and belongs to this device. A failure only loses a name.
        let _ = with_shared_loader_lock(|| unsafe { ext.set_debug_utils_object_name(&info) });
    }

    /// Begins a labelled range in a command buffer.
    pub(crate) fn begin_label(&self, commands: vk::CommandBuffer, label: Label<'_>) {
        let Some(ext) = &self.debug_utils else { return };
        // SAFETY: the command buffer is being recorded.
        unsafe { ext.cmd_begin_debug_utils_label(commands, &label.raw(&label.c_name())) };
    }

    /// Inserts a label in a command buffer.
    pub(crate) fn insert_label(&self, commands: vk::CommandBuffer, label: Label<'_>) {
        let Some(ext) = &self.debug_utils else { return };
        // SAFETY: the command buffer is being recorded.
        unsafe { ext.cmd_insert_debug_utils_label(commands, &label.raw(&label.c_name())) };
    }

    /// Ends the innermost labelled range.
    pub(crate) fn end_label(&self, commands: vk::CommandBuffer) {
        if let Some(ext) = &self.debug_utils {
            // SAFETY: the command buffer is being recorded, and the caller balances its labels.
            unsafe { ext.cmd_end_debug_utils_label(commands) };
        }
    }

    /// Begins a labelled range of a queue.
    pub(crate) fn begin_queue_label(&self, queue: Queue, label: Label<'_>) {
        let Some(ext) = &self.debug_utils else { return };
        let raw = self.queues.raw(queue.index());
        self.queues.open_labels(queue).fetch_add(1, Ordering::Relaxed);
        // SAFETY: the queue belongs to the device and is locked.
        unsafe { ext.queue_begin_debug_utils_label(*raw, &label.raw(&label.c_name())) };
    }

    /// Inserts a label between two submissions to a queue.
    pub(crate) fn insert_queue_label(&self, queue: Queue, label: Label<'_>) {
        let Some(ext) = &self.debug_utils else { return };
        let raw = self.queues.raw(queue.index());
        // SAFETY: as above.
        unsafe { ext.queue_insert_debug_utils_label(*raw, &label.raw(&label.c_name())) };
    }

    /// Ends the innermost labelled range of a queue, if one is open.
    pub(crate) fn end_queue_label(&self, queue: Queue) {
        let Some(ext) = &self.debug_utils else { return };
        let raw = self.queues.raw(queue.index());
        let open = self.queues.open_labels(queue);
        // The count changes only while the queue is locked.
        let Some(left) = open.load(Ordering::Relaxed).checked_sub(1) else {
            drop(raw);
            let queue = queue.label();
            log::warn!("{queue} queue: pop_queue_label closes nothing; push a label before");
            return;
        };
        open.store(left, Ordering::Relaxed);
        // SAFETY: as above, and a range is open.
        unsafe { ext.queue_end_debug_utils_label(*raw) };
    }
}
