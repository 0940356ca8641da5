//! Submission: command buffers go to their queues in order, with the barriers between them.

use std::sync::Arc;

use ash::vk;

use super::command_ring::{CommandRing, CommandSlot};
use super::deferred::Deferred;
use super::emit::{Images, LastBarrier, Side, emit, emit_moves, stages};
use super::lanes::{Departure, Lanes, Sent, Site, Step};
use super::ownership::{Access, Clock, LANES, PerLane};
use super::presentable::Presentables;
use super::timeline::Timeline;
use crate::barrier::{IdMap, Layout, ResourceId, Stages, TextureShape, Tracker};
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::gpu::queues::Queue;
use crate::lock::{Guard, Mutex, Rank};

/// What command buffers use without barriers.
type References = Vec<(ResourceId, Access)>;

/// A command buffer being recorded, with what the tracker knows of it.
pub(crate) struct Recording {
    /// Rises with every command buffer of the context.
    pub(crate) sequence: u64,
    pub(crate) commands: vk::CommandBuffer,
    pub(crate) tracker: Tracker,
    pub(crate) images: Images,
    /// What it uses that needs no barriers on one queue, and waits between several.
    pub(crate) references: References,
    /// What the caller has it wait for on other queues.
    pub(crate) after: Clock,
    /// The queue's.
    pub(crate) lane: usize,
    /// Of the timeline, once the queue has it; 0 before.
    value: u64,
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

/// What goes to a queue at once.
#[derive(Default)]
pub(crate) struct Submission {
    /// In their order, all of one lane.
    pub(crate) recordings: Vec<Recording>,
    /// What the first of them waits for, besides images that the presentation engine still has.
    pub(crate) waits: Vec<vk::SemaphoreSubmitInfo<'static>>,
    /// What is signalled when all of them are done, besides the timeline.
    pub(crate) signals: Vec<vk::SemaphoreSubmitInfo<'static>>,
    /// The image of a swapchain that goes to the presentation engine with it: nothing submitted later may use it.
    pub(crate) presented: Option<ResourceId>,
    /// The first recording is what everything submitted later relies on.
    pub(crate) has_prelude: bool,
    /// Frames do not wait for it.
    pub(crate) in_background: bool,
    /// It takes from others what it uses, or gives it to them.
    pub(crate) exchanges: bool,
}

/// Values of the timeline at which the first and the last recording of a submission are done; 0 for what no queue got.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Values {
    pub(crate) first: u64,
    pub(crate) last: u64,
}

/// Command buffers that begin together, once all that they wait for is there.
#[derive(Default)]
struct Batch {
    waits: Vec<vk::SemaphoreSubmitInfo<'static>>,
    commands: Vec<vk::CommandBufferSubmitInfo<'static>>,
    signals: Vec<vk::SemaphoreSubmitInfo<'static>>,
}

/// The queues with everything that changes when something is submitted. `T` is what is destroyed later.
pub(crate) struct Submitter<T> {
    /// One for each lane: one or all.
    timelines: Vec<Timeline>,
    inner: Mutex<Inner<T>>,
    gpu: Arc<Gpu>,
}

struct Inner<T> {
    /// What command buffers that were submitted used, emptied for the next ones.
    spare: Vec<(Tracker, Images, References)>,
    lanes: Lanes,
    presentables: Presentables,
    /// What only the graphics queue may use, with names for messages.
    graphics_only: IdMap<Box<str>>,
    ring: CommandRing,
    deferred: Deferred<T>,
    /// The last value of each lane that frames wait for.
    foreground: PerLane<u64>,
    /// Why a submission failed: what the states say has not happened on the GPU, so nothing more is submitted.
    broken: Option<Error>,
}

/// What the GPU has finished with.
pub(crate) struct Finished<T> {
    /// Sequence numbers of command buffers.
    pub(crate) sequences: Vec<u64>,
    /// Things to destroy now.
    pub(crate) garbage: Vec<T>,
    /// Everything up to this value is done, on all queues.
    pub(crate) passed: u64,
}

impl<T> Submitter<T> {
    pub(crate) fn new(gpu: &Arc<Gpu>) -> Result<Self> {
        const NAMES: [&str; LANES] = ["queue timeline", "compute queue timeline", "transfer queue timeline"];
        let has_several = gpu.queues.several_lanes();
        let count = if has_several { LANES } else { 1 };
        let timelines =
            NAMES.iter().take(count).map(|name| Timeline::new(gpu, name)).collect::<Result<_>>()?;
        let site = |lane| Site { domain: gpu.queues.domain(lane), stages: Queue::ALL.map(stages_of)[lane] };
        let inner = Inner {
            spare: Vec::new(),
            lanes: Lanes::new([site(0), site(1), site(2)], has_several),
            presentables: Presentables::default(),
            graphics_only: IdMap::default(),
            ring: CommandRing::default(),
            deferred: Deferred::default(),
            foreground: [0; LANES],
            broken: None,
        };
        Ok(Self { timelines, inner: Mutex::new(Rank::Submitter, inner), gpu: Arc::clone(gpu) })
    }

    /// Starts recording a command buffer.
    pub(crate) fn acquire(&self, queue: Queue) -> Result<Recording> {
        let lane = self.gpu.queues.lane(queue);
        let mut inner = self.lock();
        if lane != 0 {
            inner.lanes.begin_several();
        }
        let (sequence, slot) = inner.ring.acquire(&self.gpu, lane)?;
        let (tracker, images, references) = inner.spare.pop().unwrap_or_default();
        drop(inner);
        let after = Clock::default();
        let commands = slot.main;
        let recording =
            Recording { sequence, commands, tracker, images, references, after, lane, value: 0, slot };
        match begin(&self.gpu, commands) {
            Ok(()) => Ok(recording),
            Err(error) => {
                self.discard(recording);
                Err(error)
            }
        }
    }

    /// Gives a command buffer up.
    pub(crate) fn discard(&self, recording: Recording) {
        self.lock().ring.discard(&self.gpu, recording.lane, recording.sequence, recording.slot);
    }

    /// Only the graphics queue may use a resource from now on.
    pub(crate) fn keep_to_graphics(&self, id: ResourceId, name: &str) {
        self.lock().graphics_only.insert(id, name.into());
    }

    /// Fails where a command buffer, for another queue, uses what only the graphics queue may.
    pub(crate) fn check_queue(&self, tracker: &Tracker) -> Result<()> {
        let inner = self.lock();
        match inner.graphics_only.iter().find(|(id, _)| tracker.uses(**id)) {
            None => Ok(()),
            Some((_, name)) => {
                let message = "images of windows, and what was imported without being concurrent, belong to the graphics queue; \
                               use it there";
                Err(Error::usage(&**name, message))
            }
        }
    }

    /// Fails where a command buffer uses an image of a swapchain that the application does not have. That is to be known
    /// before anything is submitted, as a failed submission breaks the queue. The caller keeps other submissions off until
    /// its own is made.
    pub(crate) fn check(&self, tracker: &Tracker) -> Result<()> {
        self.lock().presentables.check(tracker)
    }

    /// Submits command buffers in order. `prepare` runs under the lock, right before. Where that fails halfway, queues may have
    /// got the first of them, as the values tell.
    pub(crate) fn submit(&self, mut submission: Submission, prepare: impl FnOnce()) -> (Values, Result<()>) {
        let mut guard = self.lock();
        let inner = &mut *guard;
        let sent = match inner.broken.clone() {
            Some(error) => Err(error),
            None => self.submit_all(inner, &mut submission, prepare),
        };
        match &sent {
            Ok(last) => inner.note(&submission, *last),
            Err(error) => inner.broken = Some(error.clone()),
        }
        let recordings = submission.recordings;
        let value = |recording: Option<&Recording>| recording.map_or(0, |recording| recording.value);
        let values = Values { first: value(recordings.first()), last: value(recordings.last()) };
        recordings.into_iter().for_each(|recording| self.put_away(inner, recording));
        (values, sent.map(drop))
    }

    /// Keeps what a queue got until that is done with it, and takes back what none got.
    fn put_away(&self, inner: &mut Inner<T>, mut recording: Recording) {
        let Recording { lane, sequence, slot, value, .. } = recording;
        if value == 0 {
            return inner.ring.discard(&self.gpu, lane, sequence, slot);
        }
        inner.ring.submitted(lane, sequence, slot, value);
        recording.tracker.clear();
        recording.images.clear();
        recording.references.clear();
        inner.spare.push((recording.tracker, recording.images, recording.references));
    }

    /// Answers the value of the last.
    fn submit_all(
        &self,
        inner: &mut Inner<T>,
        submission: &mut Submission,
        prepare: impl FnOnce(),
    ) -> Result<u64> {
        submission.recordings.iter().try_for_each(|recording| end(&self.gpu, recording.commands))?;
        if inner.lanes.are_several() && !submission.recordings.is_empty() {
            prepare();
            return self.submit_to_several(inner, submission);
        }
        let batches = self.finish(inner, submission)?;
        prepare();
        let value = inner.lanes.signal();
        self.send(&mut inner.lanes, (0, value), batches, std::mem::take(&mut submission.signals))?;
        submission.recordings.iter_mut().for_each(|recording| recording.value = value);
        Ok(value)
    }

    /// Puts the barriers from the queue's state in front of each command buffer. A new batch begins where an image is waited
    /// for, so that what comes before need not wait.
    fn finish(&self, inner: &mut Inner<T>, submission: &mut Submission) -> Result<Vec<Batch>> {
        let mut batches = Vec::new();
        let mut batch = Batch { waits: std::mem::take(&mut submission.waits), ..Batch::default() };
        for recording in &mut submission.recordings {
            let images = self.image_waits(inner, recording);
            if !images.is_empty() && !batch.commands.is_empty() {
                batches.push(std::mem::take(&mut batch));
            }
            batch.waits.extend(images);
            let barriers = inner.lanes.submit_alone(&recording.tracker);
            if !barriers.is_empty() {
                let prologue = recording.slot.prologue(&self.gpu)?;
                begin(&self.gpu, prologue)?;
                emit(&self.gpu, prologue, &barriers, &recording.images, &mut LastBarrier::default());
                end(&self.gpu, prologue)?;
                batch.push(prologue);
            }
            batch.push(recording.commands);
        }
        batches.push(batch);
        Ok(batches)
    }

    /// Each command buffer with its own waits, and a value of its own that others may wait for.
    fn submit_to_several(&self, inner: &mut Inner<T>, submission: &mut Submission) -> Result<u64> {
        let mut waits = std::mem::take(&mut submission.waits);
        let last = submission.recordings.len() - 1;
        for (place, recording) in submission.recordings.iter_mut().enumerate() {
            waits.extend(self.image_waits(inner, recording));
            let is_prelude = submission.has_prelude && place == 0;
            let step = self.step(inner, recording, is_prelude, submission.exchanges);
            for departure in &step.departures {
                self.depart(inner, departure, &recording.images)?;
            }
            waits.extend(self.lane_waits(&step.waits));
            let mut batch = Batch { waits: std::mem::take(&mut waits), ..Batch::default() };
            if !step.arrivals.is_empty() || !step.barriers.is_empty() {
                batch.push(self.record_prologue(recording, &step)?);
            }
            batch.push(recording.commands);
            let signals = if place == last { std::mem::take(&mut submission.signals) } else { Vec::new() };
            self.send(&mut inner.lanes, (recording.lane, step.value), vec![batch], signals)?;
            recording.value = step.value;
        }
        Ok(submission.recordings[last].value)
    }

    fn step(&self, inner: &mut Inner<T>, recording: &Recording, is_prelude: bool, exchanges: bool) -> Step {
        let sent = Sent {
            lane: recording.lane,
            tracker: &recording.tracker,
            references: &recording.references,
            after: recording.after,
            is_prelude,
            exchanges,
        };
        let images = &recording.images;
        inner.lanes.submit(&sent, |id| images.get(&id).is_some_and(|image| image.is_exclusive))
    }

    fn record_prologue(&self, recording: &mut Recording, step: &Step) -> Result<vk::CommandBuffer> {
        let commands = recording.slot.prologue(&self.gpu)?;
        let images = &recording.images;
        begin(&self.gpu, commands)?;
        if !step.arrivals.is_empty() {
            emit_moves(&self.gpu, commands, &step.arrivals, images, Side::Acquire);
        }
        emit(&self.gpu, commands, &step.barriers, images, &mut LastBarrier::default());
        end(&self.gpu, commands)?;
        Ok(commands)
    }

    /// Has a lane give images away.
    fn depart(&self, inner: &mut Inner<T>, departure: &Departure, images: &Images) -> Result<()> {
        let lane = departure.lane;
        let (sequence, slot) = inner.ring.acquire(&self.gpu, lane)?;
        let sent = self.send_moves(&mut inner.lanes, departure, slot.main, images);
        match sent {
            Ok(()) => inner.ring.submitted(lane, sequence, slot, departure.value),
            Err(_) => inner.ring.discard(&self.gpu, lane, sequence, slot),
        }
        sent
    }

    fn send_moves(
        &self,
        lanes: &mut Lanes,
        departure: &Departure,
        commands: vk::CommandBuffer,
        images: &Images,
    ) -> Result<()> {
        begin(&self.gpu, commands)?;
        emit_moves(&self.gpu, commands, &departure.parts, images, Side::Release);
        end(&self.gpu, commands)?;
        let waits = self.lane_waits(&departure.waits).collect();
        let mut batch = Batch { waits, ..Batch::default() };
        batch.push(commands);
        self.send(lanes, (departure.lane, departure.value), vec![batch], Vec::new())
    }

    /// Waits for images that the presentation engine still has.
    fn image_waits(
        &self,
        inner: &mut Inner<T>,
        recording: &Recording,
    ) -> Vec<vk::SemaphoreSubmitInfo<'static>> {
        let found = inner.presentables.take_waits(&recording.tracker, inner.lanes.first_states());
        let wait = |wait: &super::presentable::AcquireWait| {
            vk::SemaphoreSubmitInfo::default()
                .semaphore(wait.semaphore)
                .stage_mask(stages(&self.gpu, wait.stages))
        };
        found.iter().map(wait).collect()
    }

    /// Waits for other lanes, at every stage: everything the lane gets later stands behind them too.
    fn lane_waits(&self, clock: &Clock) -> impl Iterator<Item = vk::SemaphoreSubmitInfo<'static>> {
        clock.values().map(|(lane, value)| {
            vk::SemaphoreSubmitInfo::default()
                .semaphore(self.timelines[lane].raw)
                .value(value)
                .stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
        })
    }

    /// The last batch signals. A value that the queue did not take is not one of those that come.
    fn send(
        &self,
        lanes: &mut Lanes,
        (lane, value): (usize, u64),
        mut batches: Vec<Batch>,
        mut signals: Vec<vk::SemaphoreSubmitInfo<'static>>,
    ) -> Result<()> {
        let timeline = vk::SemaphoreSubmitInfo::default().semaphore(self.timelines[lane].raw).value(value);
        signals.push(timeline.stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS));
        if let Some(last) = batches.last_mut() {
            last.signals = signals;
        }
        let submits: Vec<_> = batches.iter().map(Batch::info).collect();
        let queue = self.gpu.queues.raw(lane);
        // SAFETY: the command buffers are complete and used once; the queue is locked.
        unsafe { self.gpu.device.queue_submit2(*queue, &submits, vk::Fence::null()) }
            .map_err(self.gpu.failed("vkQueueSubmit2"))?;
        lanes.submitted(lane, value);
        self.timelines[lane].submitted(value);
        Ok(())
    }

    /// The value of the last submission of all.
    pub(crate) fn submitted(&self) -> u64 {
        self.lock().lanes.last().iter().copied().max().unwrap_or_default()
    }

    /// The values of the last submission of each lane.
    pub(crate) fn last_of_lanes(&self) -> PerLane<u64> {
        *self.lock().lanes.last()
    }

    /// The same, of those that frames wait for.
    pub(crate) fn foreground(&self) -> PerLane<u64> {
        self.lock().foreground
    }

    /// How many values there were.
    #[cfg(feature = "test-hooks")]
    pub(crate) fn count(&self) -> u64 {
        self.lock().lanes.sent()
    }

    /// The lane of a value.
    pub(crate) fn lane_of(&self, value: u64) -> usize {
        Lanes::lane_of(value, self.timelines.len() > 1)
    }

    /// The timeline of a lane.
    pub(crate) fn timeline(&self, lane: usize) -> &Timeline {
        &self.timelines[lane.min(self.timelines.len() - 1)]
    }

    /// Blocks until the submission of this value is done.
    pub(crate) fn wait(&self, value: u64) -> Result<()> {
        self.timeline(self.lane_of(value)).wait(value)
    }

    /// Blocks until all these are done.
    pub(crate) fn wait_for_lanes(&self, values: &PerLane<u64>) -> Result<()> {
        self.timelines.iter().zip(values).try_for_each(|(timeline, value)| timeline.wait(*value))
    }

    /// Whether the submission of this value is done.
    pub(crate) fn is_done(&self, value: u64) -> Result<bool> {
        Ok(self.timeline(self.lane_of(value)).completed()? >= value)
    }

    /// Up to which value everything is done.
    pub(crate) fn passed(&self) -> Result<u64> {
        let completed = self.completed()?;
        Ok(self.lock().lanes.passed(&completed))
    }

    /// Asks how far the lanes are.
    fn completed(&self) -> Result<PerLane<u64>> {
        let mut completed = [0; LANES];
        for (timeline, completed) in self.timelines.iter().zip(&mut completed) {
            *completed = timeline.completed()?;
        }
        Ok(completed)
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
        Ok(self.take_finished(&self.completed()?))
    }

    /// As [`collect`](Self::collect), as far as is known without asking the GPU: all that was waited for, at least.
    pub(crate) fn collect_known(&self) -> Finished<T> {
        let mut completed = [0; LANES];
        for (timeline, completed) in self.timelines.iter().zip(&mut completed) {
            *completed = timeline.seen();
        }
        self.take_finished(&completed)
    }

    fn take_finished(&self, completed: &PerLane<u64>) -> Finished<T> {
        let mut inner = self.lock();
        inner.lanes.reached(completed);
        let sequences = inner.ring.collect(&self.gpu, completed);
        let oldest = inner.ring.oldest_open();
        let submitted = inner.lanes.last().iter().copied().max().unwrap_or_default();
        let passed = inner.lanes.passed(completed);
        let garbage = inner.deferred.collect(oldest, submitted, passed);
        Finished { sequences, garbage, passed }
    }

    /// Changes who has the images of swapchains.
    pub(crate) fn with_presentables<R>(&self, change: impl FnOnce(&mut Presentables) -> R) -> R {
        change(&mut self.lock().presentables)
    }

    /// An image of somebody else's is in this layout now.
    pub(crate) fn import_texture(&self, id: ResourceId, shape: TextureShape, layout: Layout) {
        self.lock().lanes.import(id, shape, layout);
    }

    /// The host has written a new image, which is ready to be sampled.
    pub(crate) fn filled_texture(&self, id: ResourceId, shape: TextureShape) {
        self.lock().lanes.fill(id, shape);
    }

    /// Forgets the state of a destroyed resource.
    pub(crate) fn forget(&self, id: ResourceId) {
        let mut inner = self.lock();
        inner.lanes.forget(id);
        inner.presentables.forget(id);
        if !inner.graphics_only.is_empty() {
            inner.graphics_only.remove(&id);
        }
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

impl<T> Inner<T> {
    /// All of a submission went to its queue.
    fn note(&mut self, submission: &Submission, last: u64) {
        submission.presented.into_iter().for_each(|id| self.presentables.present(id));
        if !submission.in_background {
            self.foreground[submission.recordings.first().map_or(0, |first| first.lane)] = last;
        }
    }
}

impl Batch {
    fn push(&mut self, raw: vk::CommandBuffer) {
        self.commands.push(vk::CommandBufferSubmitInfo::default().command_buffer(raw));
    }

    fn info(&self) -> vk::SubmitInfo2<'_> {
        vk::SubmitInfo2::default()
            .wait_semaphore_infos(&self.waits)
            .command_buffer_infos(&self.commands)
            .signal_semaphore_infos(&self.signals)
    }
}

/// What the command buffers of a queue can do.
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

fn begin(gpu: &Gpu, commands: vk::CommandBuffer) -> Result<()> {
    let info = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
    // SAFETY: the command buffer is new or was reset with its pool.
    unsafe { gpu.device.begin_command_buffer(commands, &info) }.map_err(Error::vulkan("vkBeginCommandBuffer"))
}

fn end(gpu: &Gpu, commands: vk::CommandBuffer) -> Result<()> {
    // SAFETY: the command buffer is being recorded, outside of a render pass.
    unsafe { gpu.device.end_command_buffer(commands) }.map_err(Error::vulkan("vkEndCommandBuffer"))
}
