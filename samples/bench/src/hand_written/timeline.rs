//! A timeline semaphore.

use std::cell::Cell;
use std::rc::Rc;

use lvk::ash::vk;

use super::RawDevice;
use crate::error::BenchError;

/// A timeline semaphore of which each value is submitted and waited for, one after the other.
pub(super) struct RawTimeline {
    semaphore: vk::Semaphore,
    /// The last value that was waited for.
    reached: Cell<u64>,
    device: Rc<RawDevice>,
}

impl RawTimeline {
    pub(super) fn new(device: &Rc<RawDevice>) -> Result<Self, BenchError> {
        let mut kind = vk::SemaphoreTypeCreateInfo::default().semaphore_type(vk::SemaphoreType::TIMELINE);
        let info = vk::SemaphoreCreateInfo::default().push_next(&mut kind);
        // SAFETY: the description is valid.
        let semaphore = unsafe { device.device.create_semaphore(&info, None) }
            .map_err(BenchError::hand_written("vkCreateSemaphore"))?;
        Ok(Self { semaphore, reached: Cell::new(0), device: Rc::clone(device) })
    }

    /// Returns the signal of the next value.
    pub(super) fn signal(&self) -> vk::SemaphoreSubmitInfo<'static> {
        vk::SemaphoreSubmitInfo::default()
            .semaphore(self.semaphore)
            .value(self.reached.get() + 1)
            .stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
    }

    /// Waits for the next value, whose signal was submitted.
    pub(super) fn wait(&self) -> Result<(), BenchError> {
        let next = self.reached.get() + 1;
        let (semaphores, values) = ([self.semaphore], [next]);
        let wait = vk::SemaphoreWaitInfo::default().semaphores(&semaphores).values(&values);
        // SAFETY: the semaphore is a timeline, and its next value was submitted.
        unsafe { self.device.device.wait_semaphores(&wait, u64::MAX) }
            .map_err(BenchError::hand_written("vkWaitSemaphores"))?;
        self.reached.set(next);
        Ok(())
    }
}

impl Drop for RawTimeline {
    fn drop(&mut self) {
        // SAFETY: every value was waited for.
        unsafe { self.device.device.destroy_semaphore(self.semaphore, None) };
    }
}
