//! Checkpoints that the GPU passes, for the report of a lost device (`VK_NV_device_diagnostic_checkpoints`).

use std::ffi::c_void;

use ash::vk;

/// A place in a command buffer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Checkpoint {
    /// Sequence number of the command buffer, without the bits that a marker has no place for.
    pub(crate) sequence: u64,
    /// Number of the label event, from 1.
    pub(crate) event: usize,
}

/// The last checkpoints that a queue has passed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct PassedCheckpoints {
    /// The last whose commands have begun.
    pub(crate) begun: Option<Checkpoint>,
    /// The last before which all commands are done.
    pub(crate) done: Option<Checkpoint>,
}

/// Writes and reads checkpoints.
pub(crate) struct Checkpoints(ash::nv::device_diagnostic_checkpoints::Device);

impl Checkpoint {
    /// Bits of a marker for the event: markers are as wide as pointers.
    const EVENT_BITS: u32 = usize::BITS * 3 / 8;
    const MAX_EVENT: usize = (1 << Self::EVENT_BITS) - 1;
    const SEQUENCE_MASK: u64 = (usize::MAX >> Self::EVENT_BITS) as u64;

    /// Returns the place of an event. Events beyond the last that a marker can hold count as that one.
    pub(crate) fn new(sequence: u64, event: usize) -> Self {
        Self { sequence: sequence & Self::SEQUENCE_MASK, event: event.min(Self::MAX_EVENT) }
    }

    /// True if the place is in the command buffer of this sequence number.
    pub(crate) fn is_in(self, sequence: u64) -> bool {
        self.sequence == sequence & Self::SEQUENCE_MASK
    }

    fn marker(self) -> *const c_void {
        std::ptr::without_provenance(((self.sequence as usize) << Self::EVENT_BITS) | self.event)
    }

    fn from_marker(marker: *const c_void) -> Self {
        let bits = marker.addr();
        Self { sequence: (bits >> Self::EVENT_BITS) as u64, event: bits & Self::MAX_EVENT }
    }
}

impl Checkpoints {
    pub(crate) fn new(instance: &ash::Instance, device: &ash::Device) -> Self {
        Self(ash::nv::device_diagnostic_checkpoints::Device::new(instance, device))
    }

    /// Records a checkpoint (`vkCmdSetCheckpointNV`).
    pub(crate) fn record(&self, commands: vk::CommandBuffer, checkpoint: Checkpoint) {
        // SAFETY: the command buffer is being recorded, the extension is on, and the driver does not read through the
        // marker.
        unsafe { self.0.cmd_set_checkpoint(commands, checkpoint.marker()) };
    }

    /// Reads the checkpoints that a queue of a lost device has passed (`vkGetQueueCheckpointDataNV`).
    pub(crate) fn passed(&self, queue: vk::Queue) -> PassedCheckpoints {
        let read = self.0.fp().get_queue_checkpoint_data_nv;
        let mut count = 0;
        // SAFETY: the caller has locked the queue, whose device is lost; without a list, only the count is written.
        unsafe { read(queue, &mut count, std::ptr::null_mut()) };
        // A driver that has just failed may report nonsense.
        let mut data = vec![vk::CheckpointDataNV::default(); count.min(64) as usize];
        count = data.len() as u32;
        // SAFETY: as above, and the list has `count` elements.
        unsafe { read(queue, &mut count, data.as_mut_ptr()) };
        data.truncate(count as usize);
        decode(&data)
    }
}

/// Reads the last checkpoints at the top and at the bottom of the pipe. Other stages lie between them.
fn decode(data: &[vk::CheckpointDataNV<'_>]) -> PassedCheckpoints {
    let at = |stage| {
        let found =
            data.iter().find(|entry| entry.stage.contains(stage) && !entry.p_checkpoint_marker.is_null());
        found.map(|entry| Checkpoint::from_marker(entry.p_checkpoint_marker))
    };
    PassedCheckpoints {
        begun: at(vk::PipelineStageFlags::TOP_OF_PIPE),
        done: at(vk::PipelineStageFlags::BOTTOM_OF_PIPE),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(stage: vk::PipelineStageFlags, checkpoint: Checkpoint) -> vk::CheckpointDataNV<'static> {
        vk::CheckpointDataNV {
            stage,
            p_checkpoint_marker: checkpoint.marker().cast_mut(),
            ..Default::default()
        }
    }

    #[test]
    fn markers_hold_the_command_buffer_and_the_event() {
        for (sequence, event) in [(1, 1), (77, 0), (1 << 19, 4_000), (u64::MAX, usize::MAX)] {
            let checkpoint = Checkpoint::new(sequence, event);
            assert_eq!(Checkpoint::from_marker(checkpoint.marker()), checkpoint);
            assert!(checkpoint.is_in(sequence) && !checkpoint.is_in(sequence ^ 1));
        }
        assert_eq!(Checkpoint::new(1, usize::MAX).event, Checkpoint::MAX_EVENT);
    }

    #[test]
    fn the_ends_of_the_pipe_are_read_and_other_stages_ignored() {
        let (top, middle, bottom) = (Checkpoint::new(9, 4), Checkpoint::new(9, 3), Checkpoint::new(8, 2));
        let stages = vk::PipelineStageFlags::TOP_OF_PIPE;
        let data = [
            entry(vk::PipelineStageFlags::COMPUTE_SHADER, middle),
            entry(stages, top),
            entry(vk::PipelineStageFlags::BOTTOM_OF_PIPE, bottom),
        ];
        assert_eq!(decode(&data), PassedCheckpoints { begun: Some(top), done: Some(bottom) });
        assert_eq!(decode(&data[..2]), PassedCheckpoints { begun: Some(top), done: None });
        assert_eq!(decode(&[]), PassedCheckpoints::default());
        assert_eq!(decode(&[vk::CheckpointDataNV::default().stage(stages)]), PassedCheckpoints::default());
    }
}
