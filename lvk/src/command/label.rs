//! Labels of a command buffer for debuggers and for the report of a lost device, and the scopes of a profile.

use super::CommandBuffer;
use super::render::pass::RenderPass;
use crate::gpu::checkpoints::Checkpoint;
use crate::gpu::debug::label::Label;

impl CommandBuffer {
    /// Names the command buffer for debuggers and for the [report](crate::DeviceLossReport) of a lost device. A later
    /// call replaces the name.
    pub fn set_debug_name(&mut self, name: &str) {
        self.recording.set_name(&self.shared.gpu, name);
    }

    /// Opens a labelled range for debuggers (`vkCmdBeginDebugUtilsLabelEXT`): a name, or a [`Label`] with a colour. It
    /// is also a scope of [`Context::last_profile`](crate::Context::last_profile) if profiling is on, and named in the
    /// [report](crate::DeviceLossReport) of a lost device. Ranges that are open when the command buffer is submitted
    /// are closed then.
    pub fn push_label<'a>(&mut self, label: impl Into<Label<'a>>) {
        let label = label.into();
        self.shared.gpu.begin_label(self.raw(), label);
        let event = self.recording.labels.begin(label.name);
        self.record_checkpoint(event);
        self.write_label_timestamp(Some(label.name));
        self.open_labels += 1;
    }

    /// Closes the innermost labelled range (`vkCmdEndDebugUtilsLabelEXT`). If none is open, records nothing and tells so
    /// by a warning of the `log` crate.
    pub fn pop_label(&mut self) {
        match self.open_labels.checked_sub(1) {
            Some(left) => self.pop_labels(left),
            None => log::warn!("{}: pop_label closes nothing; push a label before", self.recording.name()),
        }
    }

    /// Inserts a label for debuggers (`vkCmdInsertDebugUtilsLabelEXT`): a name, or a [`Label`] with a colour.
    pub fn insert_label<'a>(&mut self, label: impl Into<Label<'a>>) {
        let label = label.into();
        self.shared.gpu.insert_label(self.raw(), label);
        let event = self.recording.labels.insert(label.name);
        self.record_checkpoint(event);
    }

    /// Closes labels until `left` are open.
    pub(super) fn pop_labels(&mut self, left: u32) {
        while self.open_labels > left {
            self.write_label_timestamp(None);
            self.shared.gpu.end_label(self.raw());
            let event = self.recording.labels.end();
            self.record_checkpoint(event);
            self.open_labels -= 1;
        }
    }

    /// Records a label event as a checkpoint, if the context writes checkpoints.
    fn record_checkpoint(&self, event: usize) {
        if let Some(checkpoints) = &self.shared.gpu.checkpoints {
            checkpoints.record(self.raw(), Checkpoint::new(self.recording.sequence, event));
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
    pub fn push_label<'a>(&mut self, label: impl Into<Label<'a>>) {
        self.cmd.push_label(label);
    }

    /// As [`CommandBuffer::pop_label`]. Closes no label that was opened outside of the pass.
    pub fn pop_label(&mut self) {
        if self.cmd.open_labels > self.labels_outside + u32::from(self.labelled) {
            self.cmd.pop_label();
        } else {
            let name = self.cmd.recording.name();
            log::warn!("{name}: pop_label closes nothing in a render pass; push a label in the pass before");
        }
    }

    /// As [`CommandBuffer::insert_label`].
    pub fn insert_label<'a>(&mut self, label: impl Into<Label<'a>>) {
        self.cmd.insert_label(label);
    }
}
