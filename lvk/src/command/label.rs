//! Labels: what debuggers show of a command buffer, and the scopes of a profile.

use super::CommandBuffer;
use super::render::pass::RenderPass;

impl CommandBuffer {
    /// Opens a labelled range that debuggers show (`vkCmdBeginDebugUtilsLabelEXT`), a scope of
    /// [`Context::last_profile`](crate::Context::last_profile) where profiling is on. What is open when the command buffer
    /// is submitted is closed then.
    pub fn push_label(&mut self, name: &str) {
        self.shared.gpu.begin_label(self.raw(), name);
        self.write_label_timestamp(Some(name));
        self.open_labels += 1;
    }

    /// Closes the innermost labelled range (`vkCmdEndDebugUtilsLabelEXT`); does nothing where none is open.
    pub fn pop_label(&mut self) {
        self.pop_labels(self.open_labels.saturating_sub(1));
    }

    /// Marks a place for debuggers (`vkCmdInsertDebugUtilsLabelEXT`).
    pub fn insert_label(&mut self, name: &str) {
        self.shared.gpu.insert_label(self.raw(), name);
    }

    /// Closes labels until so many are open.
    pub(super) fn pop_labels(&mut self, left: u32) {
        while self.open_labels > left {
            self.write_label_timestamp(None);
            self.shared.gpu.end_label(self.raw());
            self.open_labels -= 1;
        }
    }

    /// Stamps the begin of a scope or the end of the innermost, if the command buffer is profiled.
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

    /// As [`CommandBuffer::pop_label`]; does nothing where none was opened in the pass.
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
