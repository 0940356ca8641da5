//! Submission: command buffers go to the queue in order, with the barriers between them.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use ash::vk;

use super::command_ring::{CommandRing, CommandSlot};
use super::deferred::Deferred;
use super::emit::{Images, emit};
use super::timeline::Timeline;
use crate::barrier::{Barriers, ResourceId, States, Tracker};
use crate::error::{Error, Result};
use crate::gpu::Gpu;

/// A command buffer being recorded, with what the tracker knows of it.
pub(crate) struct Recording {
    /// Rises with every command buffer of the context.
    pub(crate) sequence: u64,
    pub(crate) commands: vk::CommandBuffer,
    pub(crate) tracker: Tracker,
    pub(crate) images: Images,
    slot: CommandSlot,
}

/// The queue with everything that changes when something is submitted. `T` is what is destroyed later.
pub(crate) struct Submitter<T> {
    pub(crate) timeline: Timeline,
    inner: Mutex<Inner<T>>,
    gpu: Arc<Gpu>,
}

struct Inner<T> {
    /// Trackers of command buffers that were submitted, emptied for the next ones.
    spare: Vec<(Tracker, Images)>,
    states: States,
    ring: CommandRing,
    deferred: Deferred<T>,
    submitted: u64,
    /// Why a submission failed: what the states say has not happened on the GPU, so nothing more is submitted.
    broken: Option<Error>,
}

/// What the GPU has finished with.
pub(crate) struct Finished<T> {
    /// Sequence numbers of command buffers.
    pub(crate) sequences: Vec<u64>,
    /// Things to destroy now.
    pub(crate) garbage: Vec<T>,
}

impl<T> Submitter<T> {
    pub(crate) fn new(gpu: &Arc<Gpu>) -> Result<Self> {
        let inner = Inner {
            spare: Vec::new(),
            states: States::default(),
            ring: CommandRing::default(),
            deferred: Deferred::default(),
            submitted: 0,
            broken: None,
        };
        Ok(Self { timeline: Timeline::new(gpu)?, inner: Mutex::new(inner), gpu: Arc::clone(gpu) })
    }

    /// Starts recording a command buffer.
    pub(crate) fn acquire(&self) -> Result<Recording> {
        let mut inner = self.lock();
        let (sequence, slot) = inner.ring.acquire(&self.gpu)?;
        let (tracker, images) = inner.spare.pop().unwrap_or_default();
        drop(inner);
        let recording = Recording { sequence, commands: slot.main, tracker, images, slot };
        match begin(&self.gpu, slot.main) {
            Ok(()) => Ok(recording),
            Err(error) => {
                self.discard(recording);
                Err(error)
            }
        }
    }

    /// Gives a command buffer up.
    pub(crate) fn discard(&self, recording: Recording) {
        self.lock().ring.discard(&self.gpu, recording.sequence, recording.slot);
    }

    /// Submits command buffers in order. `prepare` runs under the lock, right before.
    pub(crate) fn submit(&self, recordings: Vec<Recording>, prepare: impl FnOnce()) -> Result<u64> {
        let mut inner = self.lock();
        let value = inner.submitted + 1;
        let sent = match inner.broken.clone() {
            Some(error) => Err(error),
            None => self.finish(&mut inner.states, &recordings).and_then(|raw| {
                prepare();
                self.send(&raw, value)
            }),
        };
        if let Err(error) = sent {
            inner.broken = Some(error.clone());
            for recording in recordings {
                inner.ring.discard(&self.gpu, recording.sequence, recording.slot);
            }
            return Err(error);
        }
        inner.submitted = value;
        for mut recording in recordings {
            inner.ring.submitted(recording.sequence, recording.slot, value);
            recording.tracker.clear();
            recording.images.clear();
            inner.spare.push((recording.tracker, recording.images));
        }
        Ok(value)
    }

    /// Ends the command buffers and puts the barriers from the queue's state in front of each.
    fn finish(&self, states: &mut States, recordings: &[Recording]) -> Result<Vec<vk::CommandBuffer>> {
        let mut raw = Vec::with_capacity(recordings.len() * 2);
        for recording in recordings {
            end(&self.gpu, recording.commands)?;
            let barriers: Barriers = states.submit(&recording.tracker);
            if !barriers.is_empty() {
                begin(&self.gpu, recording.slot.prologue)?;
                emit(&self.gpu, recording.slot.prologue, &barriers, &recording.images);
                end(&self.gpu, recording.slot.prologue)?;
                raw.push(recording.slot.prologue);
            }
            raw.push(recording.commands);
        }
        Ok(raw)
    }

    fn send(&self, raw: &[vk::CommandBuffer], value: u64) -> Result<()> {
        let commands: Vec<_> =
            raw.iter().map(|raw| vk::CommandBufferSubmitInfo::default().command_buffer(*raw)).collect();
        let signal = [vk::SemaphoreSubmitInfo::default()
            .semaphore(self.timeline.raw)
            .value(value)
            .stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)];
        let submit =
            vk::SubmitInfo2::default().command_buffer_infos(&commands).signal_semaphore_infos(&signal);
        let queue = self.gpu.queue();
        // SAFETY: the command buffers are complete and used once; the queue is locked.
        unsafe { self.gpu.device.queue_submit2(*queue, &[submit], vk::Fence::null()) }
            .map_err(Error::vulkan("vkQueueSubmit2"))
    }

    /// Timeline value of the last submission.
    pub(crate) fn submitted(&self) -> u64 {
        self.lock().submitted
    }

    /// Destroys `item` once no command buffer can use it any more. Answers how many items wait.
    pub(crate) fn retire(&self, item: T) -> usize {
        let mut inner = self.lock();
        let newest = inner.ring.newest_open();
        inner.deferred.push(item, newest);
        inner.deferred.len()
    }

    /// Takes out what the GPU has finished with.
    pub(crate) fn collect(&self) -> Result<Finished<T>> {
        let completed = self.timeline.completed()?;
        let mut inner = self.lock();
        let sequences = inner.ring.collect(&self.gpu, completed);
        let (oldest, submitted) = (inner.ring.oldest_open(), inner.submitted);
        let garbage = inner.deferred.collect(oldest, submitted, completed);
        Ok(Finished { sequences, garbage })
    }

    /// Forgets the state of a destroyed resource.
    pub(crate) fn forget(&self, id: ResourceId) {
        self.lock().states.forget(id);
    }

    /// Takes everything out that waits for destruction. The GPU is idle.
    pub(crate) fn drain(&self) -> Vec<T> {
        let mut inner = self.lock();
        inner.ring.destroy(&self.gpu);
        inner.deferred.drain_all()
    }

    fn lock(&self) -> MutexGuard<'_, Inner<T>> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn begin(gpu: &Gpu, commands: vk::CommandBuffer) -> Result<()> {
    let info = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
    // SAFETY: the command buffer is new or was reset with its pool.
    unsafe { gpu.device.begin_command_buffer(commands, &info) }.map_err(Error::vulkan("vkBeginCommandBuffer"))
}

fn end(gpu: &Gpu, commands: vk::CommandBuffer) -> Result<()> {
    // SAFETY: the command buffer is being recorded, outside of a render pass.
    unsafe { gpu.device.end_command_buffer(commands) }.map_err(Error::vulkan("vkEndCommandBuffer"))
}
