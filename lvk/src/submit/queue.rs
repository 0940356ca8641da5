//! Submission: command buffers go to their queues in order, with the barriers between them.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};

use ash::vk;

use super::batches::Batches;
use super::command_pool::{self, CommandRing, Ticket};
use super::deferred_free::DeferredFree;
use super::emit_barriers::{Images, LastBarrier, Side, emit, emit_ownership_transfers, vulkan_stages};
use super::last_access::{PerQueue, QUEUE_COUNT, TimelineVector};
use super::presentable::{AcquireWait, Presentables};
use super::queue_sync::{OwnershipRelease, QueueCaps, QueueSync, SubmitPlan, SubmitRequest};
use super::recording::{Recording, begin_commands, end_commands};
use super::timeline::Timeline;
use super::unobserved::{Unobserved, must_observe_in_order};
use crate::barrier::{IdMap, Layout, ResourceId, Stages, TextureShape, Tracker};
use crate::error::device_loss::DeviceLossReport;
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::lock_order::{Guard, Mutex, Rank};
use crate::queue::Queue;

/// The contents of one submission.
#[derive(Default)]
pub(crate) struct Submission {
    /// Commands that all later submissions rely on.
    pub(crate) prelude: Option<Box<Recording>>,
    /// Commands that run after the prelude, on the same queue if there is a prelude.
    pub(crate) main: Option<Box<Recording>>,
    /// Waits of the first command buffer, besides those for images that the presentation engine still owns.
    pub(crate) waits: Vec<vk::SemaphoreSubmitInfo<'static>>,
    /// Semaphores to signal when both command buffers are done, besides the timeline.
    pub(crate) signals: Vec<vk::SemaphoreSubmitInfo<'static>>,
    /// The swapchain image that is presented after this submission. No later submission may use it.
    pub(crate) presented: Option<ResourceId>,
    /// True if frames do not wait for the submission.
    pub(crate) in_background: bool,
    /// True if the submission exchanges resources with external code, in either direction.
    pub(crate) exchanges: bool,
}

/// Timeline values at which the parts of a submission are done; 0 for a part that was not submitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct SubmitValues {
    pub(crate) prelude: u64,
    pub(crate) main: u64,
}

impl SubmitValues {
    /// Returns the value at which all parts are done.
    pub(crate) fn last(self) -> u64 {
        self.prelude.max(self.main)
    }
}

/// The queues, with all state that changes at a submission. `T` is the type of items that are destroyed later.
pub(crate) struct Submitter<T> {
    /// One timeline for each hardware queue: a single one, or one for every queue of the library.
    timelines: Vec<Timeline>,
    inner: Mutex<SubmitterState<T>>,
    /// True once a submission has used external semaphores.
    uses_external_semaphores: AtomicBool,
    /// True if the host observes each timeline value once, those of all queues together.
    observes_in_order: bool,
    /// The report of the lost device.
    loss: OnceLock<Arc<DeviceLossReport>>,
    gpu: Arc<Gpu>,
}

struct SubmitterState<T> {
    queue_sync: QueueSync,
    /// Empty if the host observes values in any order.
    unobserved: Unobserved,
    /// Contents of the next submission. Empty between submissions.
    batches: Batches,
    presentables: Presentables,
    /// Resources that only the graphics queue may use, with names for error messages.
    graphics_only: IdMap<Box<str>>,
    ring: CommandRing,
    deferred: DeferredFree<T>,
    /// The last value of each queue that frames wait for.
    foreground: PerQueue<u64>,
    /// Error of a failed submission. The tracked states no longer match the GPU, so later submissions return this
    /// error.
    broken: Option<Error>,
}

/// Work and objects that the GPU is done with.
pub(crate) struct Finished<T> {
    /// Sequence numbers of command buffers that have staging memory.
    pub(crate) staged: Vec<u64>,
    /// Items to destroy now.
    pub(crate) deferred: Vec<T>,
    /// All work up to this value is done, on all queues.
    pub(crate) passed: u64,
}

impl<T> Submitter<T> {
    pub(crate) fn new(gpu: &Arc<Gpu>) -> Result<Self> {
        const NAMES: [&str; QUEUE_COUNT] = [
            "timeline semaphore of the graphics queue",
            "timeline semaphore of the compute queue",
            "timeline semaphore of the transfer queue",
        ];
        let has_several = gpu.queues.has_several();
        let count = if has_several { QUEUE_COUNT } else { 1 };
        let timelines =
            NAMES.iter().take(count).map(|name| Timeline::new(gpu, name)).collect::<Result<_>>()?;
        let queue_caps_of = |queue_index| QueueCaps {
            domain: gpu.queues.domain(queue_index),
            stages: Queue::ALL.map(stages_of)[queue_index],
        };
        let inner = SubmitterState {
            queue_sync: QueueSync::new([queue_caps_of(0), queue_caps_of(1), queue_caps_of(2)], has_several),
            unobserved: Unobserved::default(),
            batches: Batches::default(),
            presentables: Presentables::default(),
            graphics_only: IdMap::default(),
            ring: CommandRing::default(),
            deferred: DeferredFree::default(),
            foreground: [0; QUEUE_COUNT],
            broken: None,
        };
        let inner = Mutex::new(Rank::Submitter, inner);
        Ok(Self {
            timelines,
            inner,
            uses_external_semaphores: AtomicBool::new(false),
            observes_in_order: must_observe_in_order(gpu),
            loss: OnceLock::new(),
            gpu: Arc::clone(gpu),
        })
    }

    /// Starts recording a command buffer.
    pub(crate) fn acquire(&self, queue: Queue) -> Result<Box<Recording>> {
        #[cfg(any(test, feature = "test-hooks"))]
        crate::test_support::submit_hook::run_submit_hook();
        let ticket = self.lock().take_ticket(self.gpu.queues.queue_index(queue));
        self.begin(ticket)
    }

    /// Starts recording like [`acquire`](Self::acquire), and collects finished work.
    pub(crate) fn collect_and_acquire(&self, queue: Queue) -> Result<(Finished<T>, Result<Box<Recording>>)> {
        #[cfg(any(test, feature = "test-hooks"))]
        crate::test_support::submit_hook::run_submit_hook();
        let completed = self.completed_values()?;
        let mut inner = self.lock();
        let finished = inner.take_finished(&completed);
        let ticket = inner.take_ticket(self.gpu.queues.queue_index(queue));
        drop(inner);
        Ok((finished, self.begin(ticket)))
    }

    /// Begins the command buffer for the next acquisition, while the GPU is at work.
    pub(crate) fn begin_ahead(&self, queue_index: usize) {
        let mut inner = self.lock();
        if inner.ring.has_begun(queue_index) {
            return;
        }
        let free = inner.ring.take_free(queue_index);
        drop(inner);
        // On failure, the next acquisition begins a command buffer itself.
        if let Ok(begun) = command_pool::begin_recording(&self.gpu, queue_index, free) {
            self.lock().ring.store_begun(begun);
        }
    }

    fn begin(&self, ticket: Ticket) -> Result<Box<Recording>> {
        let sequence = ticket.sequence;
        ticket.begin(&self.gpu).inspect_err(|_| self.lock().ring.end_recording(sequence))
    }

    /// Destroys a command buffer that was not submitted. To reset and record it anew is not enough: NVIDIA's driver 580.159 then runs a
    /// `vkCmdUpdateBuffer` that it held.
    pub(crate) fn discard(&self, recording: Box<Recording>) {
        self.lock().ring.forget(&recording);
        recording.destroy(&self.gpu);
    }

    /// Restricts a resource to the graphics queue from now on.
    pub(crate) fn restrict_to_graphics(&self, id: ResourceId, name: &str) {
        self.lock().graphics_only.insert(id, name.into());
    }

    /// Fails if a command buffer for another queue uses a resource that is restricted to the graphics queue.
    pub(crate) fn check_queue(&self, tracker: &Tracker) -> Result<()> {
        let inner = self.lock();
        match inner.graphics_only.iter().find(|(id, _)| tracker.uses_resource(**id)) {
            None => Ok(()),
            Some((_, name)) => {
                let message = "images of windows, and what was imported without being concurrent, belong to the graphics queue; \
                               use it there";
                Err(Error::usage(&**name, message))
            }
        }
    }

    /// Fails if a command buffer uses a swapchain image that the application has not acquired. This must be checked
    /// before the submission, because a failed submission makes the queue unusable. The caller prevents other
    /// submissions until its own is complete.
    pub(crate) fn check_presentables(&self, tracker: &Tracker) -> Result<()> {
        self.lock().presentables.check_acquired(tracker)
    }

    /// Submits command buffers in order. `prepare` runs under the lock, right before the submission. On failure, the
    /// returned values tell which command buffers were submitted.
    pub(crate) fn submit(
        &self,
        mut submission: Submission,
        prepare: impl FnOnce(),
    ) -> (SubmitValues, Result<()>) {
        let mut guard = self.lock();
        let inner = &mut *guard;
        if submission.exchanges {
            self.uses_external_semaphores.store(true, Ordering::Relaxed);
        }
        let sent = match inner.broken.clone() {
            Some(error) => Err(error),
            None => self.submit_all(inner, &mut submission, prepare),
        };
        inner.batches.clear();
        match &sent {
            Ok(last) => inner.record_submission(&submission, *last),
            Err(error) => inner.broken = Some(error.clone()),
        }
        let mut put_away = |part: Option<Box<Recording>>| part.map_or(0, |part| inner.file_recording(part));
        let values = SubmitValues { prelude: put_away(submission.prelude), main: put_away(submission.main) };
        (values, sent.map(drop))
    }

    /// Submits all command buffers. Returns the value of the last.
    fn submit_all(
        &self,
        inner: &mut SubmitterState<T>,
        submission: &mut Submission,
        prepare: impl FnOnce(),
    ) -> Result<u64> {
        submission.recordings().try_for_each(|part| end_commands(&self.gpu, part.commands, part.name()))?;
        if inner.queue_sync.is_multi_queue() && submission.recordings().next().is_some() {
            prepare();
            return self.submit_to_several(inner, submission);
        }
        self.fill_batches(inner, submission)?;
        prepare();
        let value = inner.queue_sync.next_signal_value();
        self.submit_batches(inner, 0, value)?;
        submission.recordings().for_each(|part| part.value = value);
        Ok(value)
    }

    /// Adds each command buffer to the batches, after the barriers from the queue's state.
    fn fill_batches(&self, inner: &mut SubmitterState<T>, submission: &mut Submission) -> Result<()> {
        inner.batches.wait(submission.waits.drain(..));
        inner.batches.signal(submission.signals.drain(..));
        for recording in submission.recordings() {
            let images = inner.image_waits(recording);
            inner.batches.wait(images.iter().map(|image| self.image_wait(image)));
            let barriers = inner.queue_sync.submit_single_queue(&recording.tracker);
            if !barriers.is_empty() {
                let prologue = recording.prologue(&self.gpu)?;
                begin_commands(&self.gpu, prologue, recording.name())?;
                emit(&self.gpu, prologue, &barriers, &recording.images, &mut LastBarrier::default());
                end_commands(&self.gpu, prologue, recording.name())?;
                inner.batches.push(prologue);
            }
            inner.batches.push(recording.commands);
        }
        Ok(())
    }

    /// Submits each command buffer with its own waits and timeline value, so that other queues may wait for it. Returns
    /// the last value.
    fn submit_to_several(&self, inner: &mut SubmitterState<T>, submission: &mut Submission) -> Result<u64> {
        let (has_prelude, exchanges) = (submission.prelude.is_some(), submission.exchanges);
        let mut waits = std::mem::take(&mut submission.waits);
        let mut signals = std::mem::take(&mut submission.signals);
        let (mut last, count) = (0, submission.recordings().count());
        for (place, recording) in submission.recordings().enumerate() {
            waits.extend(inner.image_waits(recording).iter().map(|image| self.image_wait(image)));
            let plan = inner.plan_submission(recording, has_prelude && place == 0, exchanges);
            for release in &plan.releases {
                self.submit_release(inner, release, &recording.images)?;
            }
            inner.batches.wait(waits.drain(..).chain(self.queue_waits(&plan.waits)));
            if !plan.acquires.is_empty() || !plan.barriers.is_empty() {
                inner.batches.push(self.record_prologue(recording, &plan)?);
            }
            inner.batches.push(recording.commands);
            if place + 1 == count {
                inner.batches.signal(signals.drain(..));
            }
            self.submit_batches(inner, recording.queue_index, plan.value)?;
            (recording.value, last) = (plan.value, plan.value);
        }
        Ok(last)
    }

    fn record_prologue(&self, recording: &mut Recording, plan: &SubmitPlan) -> Result<vk::CommandBuffer> {
        let commands = recording.prologue(&self.gpu)?;
        let images = &recording.images;
        begin_commands(&self.gpu, commands, recording.name())?;
        if !plan.acquires.is_empty() {
            emit_ownership_transfers(&self.gpu, commands, &plan.acquires, images, Side::Acquire);
        }
        emit(&self.gpu, commands, &plan.barriers, images, &mut LastBarrier::default());
        end_commands(&self.gpu, commands, recording.name())?;
        Ok(commands)
    }

    /// Submits the release of images from a queue.
    fn submit_release(
        &self,
        inner: &mut SubmitterState<T>,
        release: &OwnershipRelease,
        images: &Images,
    ) -> Result<()> {
        let ticket = inner.ring.take_ticket(release.queue_index);
        let sequence = ticket.sequence;
        let mut recording = ticket.begin(&self.gpu).inspect_err(|_| inner.ring.end_recording(sequence))?;
        recording.labels.set_name("ownership transfer");
        let sent = self.record_transfers(inner, release, &recording, images);
        recording.value = if sent.is_ok() { release.value } else { 0 };
        inner.file_recording(recording);
        sent
    }

    fn record_transfers(
        &self,
        inner: &mut SubmitterState<T>,
        release: &OwnershipRelease,
        recording: &Recording,
        images: &Images,
    ) -> Result<()> {
        let commands = recording.commands;
        emit_ownership_transfers(&self.gpu, commands, &release.parts, images, Side::Release);
        end_commands(&self.gpu, commands, recording.name())?;
        inner.batches.wait(self.queue_waits(&release.waits));
        inner.batches.push(commands);
        self.submit_batches(inner, release.queue_index, release.value)
    }

    /// Returns the wait for an image that the presentation engine has not released yet.
    fn image_wait(&self, wait: &AcquireWait) -> vk::SemaphoreSubmitInfo<'static> {
        let stages = vulkan_stages(&self.gpu, wait.stages);
        vk::SemaphoreSubmitInfo::default().semaphore(wait.semaphore).stage_mask(stages)
    }

    /// Returns waits for other queues, at every stage: all later work of the queue relies on them.
    fn queue_waits(&self, vector: &TimelineVector) -> impl Iterator<Item = vk::SemaphoreSubmitInfo<'static>> {
        vector.values().map(|(queue_index, value)| {
            vk::SemaphoreSubmitInfo::default()
                .semaphore(self.timelines[queue_index].raw)
                .value(value)
                .stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
        })
    }

    /// Submits the batches to a queue and signals `value` after them. The value counts as submitted only on success.
    fn submit_batches(&self, inner: &mut SubmitterState<T>, queue_index: usize, value: u64) -> Result<()> {
        let timeline =
            vk::SemaphoreSubmitInfo::default().semaphore(self.timelines[queue_index].raw).value(value);
        inner.batches.signal([timeline.stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)]);
        if let Err(error) = inner.batches.submit(&self.gpu, queue_index) {
            return Err(self.explain_loss_locked(&inner.ring, inner.queue_sync.last_values(), error));
        }
        inner.batches.clear();
        inner.queue_sync.mark_submitted(queue_index, value);
        if self.observes_in_order {
            inner.unobserved.push(queue_index, value);
        }
        self.timelines[queue_index].mark_submitted(value);
        Ok(())
    }

    /// Returns the value of the last submission on any queue.
    pub(crate) fn last_submitted(&self) -> u64 {
        self.lock().queue_sync.last_values().iter().copied().max().unwrap_or_default()
    }

    /// True if a submission has failed, and so none follows.
    #[cfg(feature = "window")]
    pub(crate) fn is_broken(&self) -> bool {
        self.lock().broken.is_some()
    }

    /// Returns the value of the last submission of each queue.
    pub(crate) fn last_of_queues(&self) -> PerQueue<u64> {
        *self.lock().queue_sync.last_values()
    }

    /// Returns the value of the last submission of each queue that frames wait for.
    pub(crate) fn foreground_values(&self) -> PerQueue<u64> {
        self.lock().foreground
    }

    /// Calls `with` with the command buffers and the last value submitted to each queue.
    pub(super) fn with_ring<R>(&self, with: impl FnOnce(&CommandRing, &PerQueue<u64>) -> R) -> R {
        let inner = self.lock();
        with(&inner.ring, inner.queue_sync.last_values())
    }

    pub(crate) fn loss(&self) -> &OnceLock<Arc<DeviceLossReport>> {
        &self.loss
    }

    pub(super) fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    pub(super) fn timelines(&self) -> &[Timeline] {
        &self.timelines
    }

    pub(super) fn uses_external_semaphores(&self) -> bool {
        self.uses_external_semaphores.load(Ordering::Relaxed)
    }

    pub(super) fn observes_in_order(&self) -> bool {
        self.observes_in_order
    }

    /// Calls `with` while nothing is submitted.
    pub(super) fn with_unobserved<R>(&self, with: impl FnOnce(&mut Unobserved) -> R) -> R {
        with(&mut self.lock().unobserved)
    }

    /// Returns the value up to which all submissions are done.
    pub(crate) fn completed_up_to(&self) -> Result<u64> {
        let completed = self.completed_values()?;
        Ok(self.lock().queue_sync.completed_up_to(&completed))
    }

    /// Returns the number of values used so far.
    #[cfg(any(test, feature = "test-hooks"))]
    pub(crate) fn value_count(&self) -> u64 {
        self.lock().queue_sync.value_count()
    }

    /// Returns the queue that a value belongs to.
    pub(crate) fn queue_of(&self, value: u64) -> usize {
        QueueSync::queue_of(value, self.timelines.len() > 1)
    }

    /// Returns the timeline of a queue.
    pub(crate) fn timeline(&self, queue_index: usize) -> &Timeline {
        &self.timelines[queue_index.min(self.timelines.len() - 1)]
    }

    /// Destroys `item` once no command buffer can use it any more. Returns the number of waiting items.
    pub(crate) fn retire(&self, item: T) -> usize {
        let mut inner = self.lock();
        let newest = inner.ring.newest_open();
        inner.deferred.push(item, newest);
        inner.deferred.len()
    }

    /// Returns the sequence number of the latest command buffer acquired.
    pub(crate) fn newest_sequence(&self) -> u64 {
        self.lock().ring.newest_sequence()
    }

    /// Returns the number of items that wait for destruction.
    #[cfg(any(test, feature = "test-hooks"))]
    pub(crate) fn deferred_count(&self) -> usize {
        self.lock().deferred.len()
    }

    /// Collects finished work.
    pub(crate) fn collect(&self) -> Result<Finished<T>> {
        let completed = self.completed_values()?;
        Ok(self.lock().take_finished(&completed))
    }

    /// Collects finished work like [`collect`](Self::collect), but only what is known without a query: at least all
    /// values that were waited for.
    pub(crate) fn collect_known(&self) -> Finished<T> {
        let completed = self.last_seen();
        self.lock().take_finished(&completed)
    }

    /// Changes the owners of swapchain images.
    #[cfg(feature = "window")]
    pub(crate) fn with_presentables<R>(&self, change: impl FnOnce(&mut Presentables) -> R) -> R {
        change(&mut self.lock().presentables)
    }

    /// Sets the layout of an imported image after external use.
    pub(crate) fn import_texture(&self, id: ResourceId, shape: TextureShape, layout: Layout) {
        self.lock().queue_sync.import_image(id, shape, layout);
    }

    /// Records that the host has written a new image, which is ready to be sampled.
    pub(crate) fn mark_host_written(&self, id: ResourceId, shape: TextureShape) {
        self.lock().queue_sync.mark_host_written(id, shape);
    }

    /// Forgets the state of a destroyed resource.
    pub(crate) fn forget(&self, id: ResourceId) {
        let mut inner = self.lock();
        inner.queue_sync.forget(id);
        inner.presentables.forget(id);
        if !inner.graphics_only.is_empty() {
            inner.graphics_only.remove(&id);
        }
    }

    /// Takes all items that wait for destruction. The GPU is idle.
    pub(crate) fn drain(&self) -> Vec<T> {
        let mut inner = self.lock();
        inner.ring.destroy(&self.gpu);
        inner.deferred.drain_all()
    }

    fn lock(&self) -> Guard<'_, SubmitterState<T>> {
        self.inner.lock()
    }
}

impl Submission {
    fn recordings(&mut self) -> impl Iterator<Item = &mut Recording> {
        self.prelude.iter_mut().chain(&mut self.main).map(|part| &mut **part)
    }
}

impl<T> SubmitterState<T> {
    /// Takes a command buffer of a queue to record.
    fn take_ticket(&mut self, queue_index: usize) -> Ticket {
        if queue_index != 0 {
            self.queue_sync.begin_multi_queue();
        }
        self.ring.take_ticket(queue_index)
    }

    /// Stores a command buffer until its queue is done with it, or for good if its submission failed. Returns its value.
    fn file_recording(&mut self, recording: Box<Recording>) -> u64 {
        let value = recording.value;
        if value > 0 {
            self.ring.mark_submitted(recording);
        } else {
            self.ring.keep_failed(recording);
        }
        value
    }

    fn take_finished(&mut self, completed: &PerQueue<u64>) -> Finished<T> {
        self.queue_sync.mark_completed(completed);
        let staged = self.ring.collect(completed);
        let oldest = self.ring.oldest_open();
        let submitted = self.queue_sync.last_values().iter().copied().max().unwrap_or_default();
        let passed = self.queue_sync.completed_up_to(completed);
        let deferred = self.deferred.take_completed(oldest, submitted, passed);
        Finished { staged, deferred, passed }
    }

    /// Returns the waits for images that the presentation engine still owns and the command buffer is the first to use.
    fn image_waits(&mut self, recording: &Recording) -> Vec<AcquireWait> {
        self.presentables.take_waits(&recording.tracker, self.queue_sync.graphics_state())
    }

    fn plan_submission(&mut self, recording: &Recording, is_prelude: bool, exchanges: bool) -> SubmitPlan {
        let sent = SubmitRequest {
            queue_index: recording.queue_index,
            tracker: &recording.tracker,
            references: &recording.references,
            after: recording.after,
            is_prelude,
            exchanges,
        };
        let images = &recording.images;
        self.queue_sync.submit(&sent, |id| images.get(&id).is_some_and(|image| image.is_exclusive))
    }

    /// Records that all of a submission was sent to its queue.
    fn record_submission(&mut self, submission: &Submission, last: u64) {
        submission.presented.into_iter().for_each(|id| self.presentables.present(id));
        if !submission.in_background {
            let part = submission.main.as_ref().or(submission.prelude.as_ref());
            self.foreground[part.map_or(0, |part| part.queue_index)] = last;
        }
    }
}

/// Returns the stages that command buffers of a queue support.
pub(crate) fn stages_of(queue: Queue) -> Stages {
    match queue {
        Queue::Graphics => Stages::all() - Stages::SHADING_RATE,
        Queue::Compute => {
            Stages::HOST
                | Stages::TRANSFER
                | Stages::DRAW_INDIRECT
                | Stages::COMPUTE
                | Stages::RAY_TRACING
                | Stages::ACCEL_BUILD
        }
        Queue::Transfer => Stages::HOST | Stages::TRANSFER,
    }
}
