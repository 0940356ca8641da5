//! Labels of a command buffer for debuggers, and the scopes of a profile.

use super::CommandBuffer;
use super::render::pass::RenderPass;

impl CommandBuffer {
    /// Opens a labelled range for debuggers (`vkCmdBeginDebugUtilsLabelEXT`). It is also a scope of
    /// [`Context::last_profile`](crate::Context::last_profile) if profiling is on. Ranges that are open when the
    /// command buffer is submitted are closed then.
    pub fn push_label(&mut self, name: &str) {
        self.shared.gpu.begin_label(self.raw(), name);
        self.write_label_timestamp(Some(name));
        self.open_labels += 1;
    }

    /// Closes the innermost labelled range (`vkCmdEndDebugUtilsLabelEXT`); does nothing if none is open.
    pub fn pop_label(&mut self) {
        self.pop_labels(self.open_labels.saturating_sub(1));
    }

    /// Inserts a label for debuggers (`vkCmdInsertDebugUtilsLabelEXT`).
    pub fn insert_label(&mut self, name: &str) {
        self.shared.gpu.insert_label(self.raw(), name);
    }

    /// Closes labels until `left` are open.
    pub(super) fn pop_labels(&mut self, left: u32) {
        while self.open_labels > left {
            self.write_label_timestamp(None);
            self.shared.gpu.end_label(self.raw());
            self.open_labels -= 1;
        }
    }

    /// Writes a timestamp for the begin of the scope `name`, or for the end of the innermost one, if the command buffer
    /// is profiled.
    pub(super) fn write_label_timestamp(&mut self, name: Option<&str>) {
        if let Some(scopes) = &mut self.scopes {
            self.shared.profiler.stamp(scopes, self.recording.commands, name, self.views);
        }
    }
}

impl RenderPass<'_> {
    /// As [`CommandBuffer::push_label`]; closed at the end of the pass at the latest.
    pub fn push_label(&mut self, name: &str) {
        self.cmd.push_label(name);
    }

    /// As [`CommandBuffer::pop_label`]; does nothing if none was opened in the pass.
    pub fn pop_label(&mut self) {
        if self.cmd.open_labels > self.labels_outside + u32::from(self.labelled) {
            self.cmd.pop_label();
        }
    }

    /// As [`CommandBuffer::insert_label`].
    pub fn insert_label(&mut self, name: &str) {
        self.cmd.insert_label(name);
    }
}
