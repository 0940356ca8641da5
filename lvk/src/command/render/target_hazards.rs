//! Reads and writes of a pass's targets since the last barrier, as plain values.

use crate::bindless::input_attachments::{InputAttachment, InputAttachmentMask};
use crate::pipeline::RenderPipeline;

/// What draws of the pass have done to its targets since the last barrier.
#[derive(Default)]
pub(super) struct TargetHazards {
    pub(super) read: InputAttachmentMask,
    pub(super) written: InputAttachmentMask,
    /// Whether there was a draw since the bound pipeline was bound, or since the last barrier.
    pub(super) drawn: bool,
    /// Vulkan knows the library's places of targets.
    pub(super) finds_inputs: bool,
}

impl TargetHazards {
    /// Counts what `pipeline` has drawn, while depth was written or not.
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

    /// Whether draws that read and write these have to wait for those before.
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
