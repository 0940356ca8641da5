//! Submission: command buffers go to the queue in order, with the barriers between them.

use std::sync::Arc;

use ash::vk;

use super::command_ring::{CommandRing, CommandSlot};
use super::deferred::Deferred;
use super::emit::{Images, emit, stages};
use super::presentable::Presentables;
use super::timeline::Timeline;
use crate::barrier::{Barriers, Layout, ResourceId, States, TextureShape, Tracker};
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::lock::{Guard, Mutex, Rank};

/// A command buffer being recorded, with what the tracker knows of it.
pub(crate) struct Recording {
    /// Rises with every command buffer of the context.
    pub(crate) sequence: u64,
    pub(crate) commands: vk::CommandBuffer,
    pub(crate) tracker: Tracker,
    pub(crate) images: Images,
    slot: CommandSlot,
}

impl Recording {
    /// A set of `count` input attachments for a pass of the command buffer.
    pub(crate) fn input_set(
        &mut self,
        gpu: &Gpu,
        layout: vk::DescriptorSetLayout,
        count: u32,
    ) -> Result<vk::DescriptorSet> {
        self.slot.inputs.take(gpu, layout, count)
    }
}

/// What goes to the queue at once: one value of the timeline.
#[derive(Default)]
pub(crate) struct Submission {
    /// In their order.
    pub(crate) recordings: Vec<Recording>,
    /// What the first of them waits for, besides images that the presentation engine still has.
    pub(crate) waits: Vec<vk::SemaphoreSubmitInfo<'static>>,
    /// What is signalled when all of them are done, besides the timeline.
    pub(crate) signals: Vec<vk::SemaphoreSubmitInfo<'static>>,
    /// The image of a swapchain that goes to the presentation engine with it: nothing submitted later may use it.
    pub(crate) presented: Option<ResourceId>,
}

/// Command buffers that begin together, once all that they wait for is there.
#[derive(Default)]
struct Batch {
    waits: Vec<vk::SemaphoreSubmitInfo<'static>>,
    commands: Vec<vk::CommandBufferSubmitInfo<'static>>,
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
    presentables: Presentables,
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
            presentables: Presentables::default(),
            ring: CommandRing::default(),
            deferred: Deferred::default(),
            submitted: 0,
            broken: None,
        };
        Ok(Self {
            timeline: Timeline::new(gpu)?,
            inner: Mutex::new(Rank::Submitter, inner),
            gpu: Arc::clone(gpu),
        })
    }

    /// Starts recording a command buffer.
    pub(crate) fn acquire(&self) -> Result<Recording> {
        let mut inner = self.lock();
        let (sequence, slot) = inner.ring.acquire(&self.gpu)?;
        let (tracker, images) = inner.spare.pop().unwrap_or_default();
        drop(inner);
        let recording = Recording { sequence, commands: slot.main, tracker, images, slot };
        match begin(&self.gpu, recording.commands) {
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

    /// Fails where a command buffer uses an image of a swapchain that the application does not have. That is to be known
    /// before anything is submitted, as a failed submission breaks the queue. The caller keeps other submissions off until
    /// its own is made.
    pub(crate) fn check(&self, tracker: &Tracker) -> Result<()> {
        self.lock().presentables.check(tracker)
    }

    /// Submits command buffers in order. `prepare` runs under the lock, right before.
    pub(crate) fn submit(&self, submission: Submission, prepare: impl FnOnce()) -> Result<u64> {
        let mut guard = self.lock();
        let inner = &mut *guard;
        let value = inner.submitted + 1;
        let sent = match inner.broken.clone() {
            Some(error) => Err(error),
            None => self.finish(inner, submission.waits, &submission.recordings).and_then(|batches| {
                prepare();
                self.send(&batches, submission.signals, value)
            }),
        };
        if let Err(error) = sent {
            inner.broken = Some(error.clone());
            for recording in submission.recordings {
                inner.ring.discard(&self.gpu, recording.sequence, recording.slot);
            }
            return Err(error);
        }
        inner.submitted = value;
        submission.presented.into_iter().for_each(|id| inner.presentables.present(id));
        for mut recording in submission.recordings {
            inner.ring.submitted(recording.sequence, recording.slot, value);
            recording.tracker.clear();
            recording.images.clear();
            inner.spare.push((recording.tracker, recording.images));
        }
        Ok(value)
    }

    /// Ends the command buffers and puts the barriers from the queue's state in front of each. A new batch begins where
    /// an image is waited for, so that what comes before need not wait.
    fn finish(
        &self,
        inner: &mut Inner<T>,
        waits: Vec<vk::SemaphoreSubmitInfo<'static>>,
        recordings: &[Recording],
    ) -> Result<Vec<Batch>> {
        let mut batches = Vec::new();
        let mut batch = Batch { waits, ..Batch::default() };
        for recording in recordings {
            end(&self.gpu, recording.commands)?;
            let images = inner.presentables.take_waits(&recording.tracker, &mut inner.states);
            if !images.is_empty() && !batch.commands.is_empty() {
                batches.push(std::mem::take(&mut batch));
            }
            batch.waits.extend(images.iter().map(|wait| {
                vk::SemaphoreSubmitInfo::default()
                    .semaphore(wait.semaphore)
                    .stage_mask(stages(&self.gpu, wait.stages))
            }));
            let barriers: Barriers = inner.states.submit(&recording.tracker);
            if !barriers.is_empty() {
                begin(&self.gpu, recording.slot.prologue)?;
                emit(&self.gpu, recording.slot.prologue, &barriers, &recording.images);
                end(&self.gpu, recording.slot.prologue)?;
                batch.push(recording.slot.prologue);
            }
            batch.push(recording.commands);
        }
        batches.push(batch);
        Ok(batches)
    }

    /// The last batch signals.
    fn send(
        &self,
        batches: &[Batch],
        mut signals: Vec<vk::SemaphoreSubmitInfo<'static>>,
        value: u64,
    ) -> Result<()> {
        let timeline = vk::SemaphoreSubmitInfo::default().semaphore(self.timeline.raw).value(value);
        signals.push(timeline.stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS));
        let mut submits: Vec<_> = batches.iter().map(Batch::info).collect();
        if let Some(last) = submits.last_mut() {
            *last = last.signal_semaphore_infos(&signals);
        }
        let queue = self.gpu.queue();
        // SAFETY: the command buffers are complete and used once; the queue is locked.
        unsafe { self.gpu.device.queue_submit2(*queue, &submits, vk::Fence::null()) }
            .map_err(self.gpu.failed("vkQueueSubmit2"))
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

    /// Number of the command buffer that was begun last.
    pub(crate) fn newest(&self) -> u64 {
        self.lock().ring.newest()
    }

    /// How many items wait to be destroyed.
    #[cfg(feature = "test-hooks")]
    pub(crate) fn waiting(&self) -> usize {
        self.lock().deferred.len()
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

    /// Changes who has the images of swapchains.
    pub(crate) fn with_presentables<R>(&self, change: impl FnOnce(&mut Presentables) -> R) -> R {
        change(&mut self.lock().presentables)
    }

    /// An image of somebody else's is in this layout now.
    pub(crate) fn import_texture(&self, id: ResourceId, shape: TextureShape, layout: Layout) {
        self.lock().states.imported(id, shape, layout);
    }

    /// Forgets the state of a destroyed resource.
    pub(crate) fn forget(&self, id: ResourceId) {
        let mut inner = self.lock();
        inner.states.forget(id);
        inner.presentables.forget(id);
    }

    /// Takes everything out that waits for destruction. The GPU is idle.
    pub(crate) fn drain(&self) -> Vec<T> {
        let mut inner = self.lock();
        inner.ring.destroy(&self.gpu);
        inner.deferred.drain_all()
    }

    fn lock(&self) -> Guard<'_, Inner<T>> {
        self.inner.lock()
    }
}

impl Batch {
    fn push(&mut self, raw: vk::CommandBuffer) {
        self.commands.push(vk::CommandBufferSubmitInfo::default().command_buffer(raw));
    }

    fn info(&self) -> vk::SubmitInfo2<'_> {
        vk::SubmitInfo2::default().wait_semaphore_infos(&self.waits).command_buffer_infos(&self.commands)
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
