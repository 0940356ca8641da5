//! Checks for commands that the queue of a command buffer does not support. They are the same on every device, even if
//! the device could run the command. Only the granularity of copies and timestamps depend on the device.

use ash::vk;

use super::CommandBuffer;
use crate::barrier::{ResourceId, Use};
use crate::error::{Error, Result};
use crate::queue::Queue;
use crate::resource::Texture;
use crate::resource::region::Region;
use crate::submit::SubmitHandle;
use crate::submit::ownership::QueueAccess;
use crate::submit::queue::stages_of;

/// The name of builds in error messages.
pub(crate) const BUILD_ON_QUEUE: &str = "a build of acceleration structures";

impl CommandBuffer {
    /// Returns the queue that the command buffer was acquired for.
    pub fn queue(&self) -> Queue {
        self.queue
    }

    /// Returns the index of its queue. Work on queue index 0 runs in order with the work of the graphics queue.
    pub(crate) fn queue_index(&self) -> usize {
        self.recording.queue_index
    }

    /// Fails unless the command buffer is for the graphics queue.
    pub(super) fn needs_graphics(&self, command: &'static str) -> Result<()> {
        match self.queue {
            Queue::Graphics => Ok(()),
            queue => Err(Error::WrongQueue { command, queue, remedy: "Queue::Graphics" }),
        }
    }

    /// Fails if the command buffer is for the transfer queue.
    #[inline]
    pub(super) fn needs_compute(&self, command: &'static str) -> Result<()> {
        needs_compute(self.queue, command)
    }

    /// Fails if the device's queue has no timestamps.
    pub(super) fn needs_timestamps(&self) -> Result<()> {
        if self.shared.gpu.caps.queue(self.queue).timestamp_bits > 0 {
            return Ok(());
        }
        Err(self.shared.gpu.unsupported(&format!("timestamps on the {} queue", self.queue.label())))
    }

    /// Fails if copies on this queue do not support the region.
    pub(super) fn check_copy(&self, texture: &Texture, region: &Region) -> Result<()> {
        if self.queue == Queue::Graphics {
            return Ok(());
        }
        if region.part.aspect.intersects(vk::ImageAspectFlags::DEPTH | vk::ImageAspectFlags::STENCIL) {
            return self.needs_graphics("a copy of depth or stencil");
        }
        let granularity = self.shared.gpu.caps.queue(self.queue).copy_granularity;
        let mip = region.part.aspect_extent(texture.image.mip_extent(region.mip));
        let [width, height] = region.part.block;
        let side = |axis: usize| (region.offset[axis], region.extent[axis], mip[axis]);
        let blocks = [width, height, 1];
        if (0..3).all(|axis| is_on_granularity(granularity[axis], blocks[axis], side(axis))) {
            return Ok(());
        }
        let message = format!(
            "copies on the {} queue of this device begin and end at multiples of {granularity:?} texels or blocks (0: whole \
             mips), not at {:?} + {:?}; take another queue",
            self.queue.label(),
            region.offset,
            region.extent
        );
        Err(Error::usage(&texture.name, message))
    }

    /// Makes the command buffer begin after these submissions.
    pub(super) fn wait_for_resource(&mut self, submissions: &[SubmitHandle]) -> Result<()> {
        for submission in submissions.iter().filter(|submission| **submission != SubmitHandle::default()) {
            if submission.context != self.shared.store.context_id {
                return Err(Error::usage("wait_for", "the submission belongs to another context"));
            }
            let queue_index = self.shared.submitter.queue_of(submission.value);
            self.recording.after.max_with_value(queue_index, submission.value);
        }
        Ok(())
    }

    /// Makes the command buffer begin after the submission with this timeline value of the first queue.
    pub(crate) fn wait_for_all_writes(&mut self, value: u64) {
        self.recording.after.max_with_value(0, value);
    }

    /// References a resource that needs no barriers within a queue, for queue synchronisation.
    #[inline]
    pub(crate) fn reference_resource(&mut self, id: ResourceId, access: QueueAccess) {
        if self.shared.gpu.queues.has_several() {
            self.recording.references.push((id, access));
        }
    }

    /// Returns the resource that stands for the BLAS that are built now: all BLAS, or the new ones, which no TLAS references.
    pub(crate) fn built_group(&self, is_first: bool) -> ResourceId {
        if is_first { self.shared.new_blas[self.recording.queue_index] } else { self.shared.all_blas }
    }
}

/// Fails for the transfer queue.
#[inline]
pub(crate) fn needs_compute(queue: Queue, command: &'static str) -> Result<()> {
    match queue {
        Queue::Graphics | Queue::Compute => Ok(()),
        Queue::Transfer => {
            Err(Error::WrongQueue { command, queue, remedy: "Queue::Compute or Queue::Graphics" })
        }
    }
}

/// Returns `read` limited to the stages of a queue. Copies make their results readable by all stages of their own
/// queue; other queues see them through a semaphore.
pub(super) fn limited_to_queue(queue_index: usize, read: Use) -> Use {
    if queue_index == 0 {
        return read;
    }
    let own = read.limited_to(stages_of(Queue::ALL[queue_index]));
    // A queue without shaders reads by transfers only.
    if own.stages.is_empty() { Use::transfer_read().with_layout(read.layout) } else { own }
}

/// True if a copy may have this offset and extent along a mip of `side` texels. The granularity counts blocks of
/// `block` texels.
fn is_on_granularity(granularity: u32, block: u32, (offset, extent, side): (u32, u32, u32)) -> bool {
    if granularity == 0 {
        return offset == 0 && extent == side;
    }
    let step = granularity * block;
    offset.is_multiple_of(step) && (extent.is_multiple_of(step) || offset + extent == side)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regions_of_copies_stand_on_the_granularity_or_reach_the_edge() {
        assert!(is_on_granularity(1, 1, (3, 5, 9)));
        assert!(is_on_granularity(8, 1, (8, 16, 30)) && is_on_granularity(8, 1, (24, 6, 30)));
        assert!(!is_on_granularity(8, 1, (4, 8, 30)) && !is_on_granularity(8, 1, (8, 6, 30)));
        assert!(
            is_on_granularity(2, 4, (8, 8, 20))
                && is_on_granularity(2, 4, (16, 4, 20))
                && !is_on_granularity(2, 4, (4, 8, 20))
        );
        assert!(
            is_on_granularity(0, 1, (0, 30, 30))
                && !is_on_granularity(0, 1, (0, 29, 30))
                && !is_on_granularity(0, 1, (1, 29, 30))
        );
    }
}
