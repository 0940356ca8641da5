//! Timeline semaphores: one for each queue, with a rising value for each of its submissions.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use ash::vk;

use crate::cpu_scope::cpu_scope;
use crate::error::{Error, Result};
use crate::gpu::Gpu;

/// Handle of a submission. It can be compared, copied and waited for with [`Context::wait`](crate::Context::wait).
///
/// The default value stands for "nothing submitted yet" and is always done. Within one context, later submissions are
/// greater.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct SubmitHandle {
    /// Value of its queue's timeline once the submission is done.
    pub(crate) value: u64,
    /// Id of the context that submitted it.
    pub(crate) context: u64,
}

impl SubmitHandle {
    /// Returns the value that the timeline semaphore reaches when the submission is done. The semaphore is
    /// [`Context::raw_timeline`](crate::Context::raw_timeline), or [`raw_timeline_of`](crate::Context::raw_timeline_of)
    /// the queue.
    pub fn raw_value(self) -> u64 {
        self.value
    }
}

/// A timeline semaphore with the last value seen, and the last value submitted.
pub(crate) struct Timeline {
    pub(crate) raw: vk::Semaphore,
    name: &'static str,
    seen: AtomicU64,
    sent: AtomicU64,
    gpu: Arc<Gpu>,
}

impl Timeline {
    pub(crate) fn new(gpu: &Arc<Gpu>, name: &'static str) -> Result<Self> {
        let mut kind = vk::SemaphoreTypeCreateInfo::default().semaphore_type(vk::SemaphoreType::TIMELINE);
        let info = vk::SemaphoreCreateInfo::default().push_next(&mut kind);
        // SAFETY: the feature `timelineSemaphore` is enabled.
        let raw = unsafe { gpu.device.create_semaphore(&info, None) }
            .map_err(Error::vulkan("vkCreateSemaphore", name))?;
        gpu.name(raw, name);
        Ok(Self { raw, name, seen: AtomicU64::new(0), sent: AtomicU64::new(0), gpu: Arc::clone(gpu) })
    }

    /// Returns the last value that the GPU is known to have reached, without a query.
    pub(crate) fn last_seen(&self) -> u64 {
        self.seen.load(Ordering::Acquire)
    }

    /// Records that a queue accepted the work that signals this value.
    pub(crate) fn mark_submitted(&self, value: u64) {
        self.sent.fetch_max(value, Ordering::AcqRel);
    }

    /// Queries the value that the GPU has reached, unless all submitted work is known to be done.
    pub(crate) fn query_completed(&self) -> Result<u64> {
        let seen = self.last_seen();
        if seen == self.sent.load(Ordering::Acquire) {
            return Ok(seen);
        }
        // SAFETY: the semaphore is alive and a timeline.
        let value = unsafe { self.gpu.device.get_semaphore_counter_value(self.raw) }
            .map_err(Error::vulkan("vkGetSemaphoreCounterValue", self.name))?;
        self.seen.fetch_max(value, Ordering::AcqRel);
        Ok(value)
    }

    /// Returns the last value whose work a queue accepted.
    pub(crate) fn last_submitted(&self) -> u64 {
        self.sent.load(Ordering::Acquire)
    }

    /// Returns the value that the GPU of a lost device has reached, as far as it is known. A value beyond `submitted`
    /// is none: a lost device may report any.
    pub(crate) fn last_known(&self, submitted: u64) -> u64 {
        // SAFETY: the semaphore is alive and a timeline. A failure loses only a detail of a report.
        let value = unsafe { self.gpu.device.get_semaphore_counter_value(self.raw) }.unwrap_or(0);
        let seen = self.last_seen();
        if value > submitted { seen } else { value.max(seen) }
    }

    /// Blocks until the GPU reaches `value`, which was submitted.
    pub(crate) fn wait(&self, value: u64) -> Result<()> {
        if self.last_seen() >= value {
            return Ok(());
        }
        cpu_scope!("vkWaitSemaphores");
        if self.reaches(value, u64::MAX)? {
            return Ok(());
        }
        Err(Error::vulkan("vkWaitSemaphores", self.name)(vk::Result::TIMEOUT))
    }

    /// Blocks until the GPU reaches `value`, at most for `timeout_ns` nanoseconds. Returns whether it does.
    pub(crate) fn reaches(&self, value: u64, timeout_ns: u64) -> Result<bool> {
        let (semaphores, values) = ([self.raw], [value]);
        let info = vk::SemaphoreWaitInfo::default().semaphores(&semaphores).values(&values);
        // SAFETY: the semaphore is alive and a timeline.
        match unsafe { self.gpu.device.wait_semaphores(&info, timeout_ns) } {
            Ok(()) => self.seen.fetch_max(value, Ordering::AcqRel),
            Err(vk::Result::TIMEOUT) => return Ok(false),
            Err(error) => return Err(Error::vulkan("vkWaitSemaphores", self.name)(error)),
        };
        Ok(true)
    }
}

impl Drop for Timeline {
    fn drop(&mut self) {
        // SAFETY: the context has waited for the GPU before its parts are dropped.
        unsafe { self.gpu.device.destroy_semaphore(self.raw, None) };
    }
}
