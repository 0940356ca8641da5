//! Reads and writes of a pass's targets since the last barrier, as plain values.

use crate::bindless::input_attachments::{InputAttachment, InputAttachmentMask};
use crate::pipeline::RenderPipeline;

/// Accesses of draws to the targets of the pass since the last barrier.
#[derive(Default)]
pub(super) struct TargetHazards {
    pub(super) read: InputAttachmentMask,
    pub(super) written: InputAttachmentMask,
    /// True if there was a draw since the bound pipeline was bound, or since the last barrier.
    pub(super) drawn: bool,
    /// True if the library's input attachment indices are set in Vulkan.
    pub(super) finds_inputs: bool,
}

impl TargetHazards {
    /// Adds the accesses of the draws with `pipeline`. They also wrote depth if `writes_depth` is true.
    pub(super) fn record_draws(&mut self, pipeline: Option<&RenderPipeline>, writes_depth: bool) {
        if let Some(pipeline) = pipeline.filter(|_| self.drawn) {
            self.read = self.read.union(pipeline.reads);
            self.written = self.written.union(pipeline.writes);
            if writes_depth {
                self.written.insert(InputAttachment::Depth);
            }
        }
        self.drawn = false;
    }

    /// True if draws with these reads and writes have to wait for earlier draws.
    pub(super) fn needs_barrier(&self, reads: InputAttachmentMask, writes: InputAttachmentMask) -> bool {
        self.written.intersects(reads) || self.read.intersects(writes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn input_mask(inputs: &[InputAttachment]) -> InputAttachmentMask {
        inputs.iter().copied().collect()
    }

    #[test]
    fn draws_wait_where_one_reads_what_another_writes() {
        let (albedo, lit) = (
            input_mask(&[InputAttachment::Color(0), InputAttachment::Depth]),
            input_mask(&[InputAttachment::Color(1)]),
        );
        let drawn = TargetHazards { written: albedo, ..Default::default() };
        assert!(
            drawn.needs_barrier(albedo, lit)
                && drawn.needs_barrier(input_mask(&[InputAttachment::Depth]), lit)
        );
        assert!(
            !drawn.needs_barrier(InputAttachmentMask::default(), albedo),
            "the order of blending is Vulkan's"
        );
        let lights = TargetHazards { read: albedo, written: lit, ..Default::default() };
        assert!(!lights.needs_barrier(albedo, lit), "further lights need not wait");
        assert!(
            lights.needs_barrier(InputAttachmentMask::default(), albedo),
            "nor is changed what they still read"
        );
        assert!(
            !lights.needs_barrier(InputAttachmentMask::default(), input_mask(&[InputAttachment::Color(2)]))
        );
    }
}
