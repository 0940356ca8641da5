//! Submission: command buffers go to their queues in order, with the barriers between them.

use std::sync::Arc;

use ash::vk;

use super::batches::Batches;
use super::command_pool::{self, CommandRing, Ticket};
use super::deferred_free::Deferred;
use super::emit_barriers::{Images, LastBarrier, Side, emit, emit_moves, stages};
use super::ownership::{Clock, LANES, PerLane};
use super::presentable::{AcquireWait, Presentables};
use super::queue_sync::{Departure, Lanes, Sent, Site, Step};
use super::recording::{Recording, begin, end};
use super::timeline::Timeline;
use crate::barrier::{IdMap, Layout, ResourceId, Stages, TextureShape, Tracker};
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::gpu::caps::queues::Queue;
use crate::lock_order::{Guard, Mutex, Rank};

/// What goes to a queue at once.
#[derive(Default)]
pub(crate) struct Submission {
    /// What everything submitted later relies on.
    pub(crate) prelude: Option<Box<Recording>>,
    /// Runs behind the prelude, on the same lane if there is one.
    pub(crate) main: Option<Box<Recording>>,
    /// What the first of both waits for, besides images that the presentation engine still has.
    pub(crate) waits: Vec<vk::SemaphoreSubmitInfo<'static>>,
    /// What is signalled when both are done, besides the timeline.
    pub(crate) signals: Vec<vk::SemaphoreSubmitInfo<'static>>,
    /// The image of a swapchain that goes to the presentation engine with it: nothing submitted later may use it.
    pub(crate) presented: Option<ResourceId>,
    /// Frames do not wait for it.
    pub(crate) in_background: bool,
    /// It takes from others what it uses, or gives it to them.
    pub(crate) exchanges: bool,
}

/// Values of the timeline at which the parts of a submission are done; 0 for what no queue got.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Values {
    pub(crate) prelude: u64,
    pub(crate) main: u64,
}

impl Values {
    /// The value at which everything is done.
    pub(crate) fn last(self) -> u64 {
        self.prelude.max(self.main)
    }
}

/// The queues with everything that changes when something is submitted. `T` is what is destroyed later.
pub(crate) struct Submitter<T> {
    /// One for each lane: one or all.
    timelines: Vec<Timeline>,
    inner: Mutex<Inner<T>>,
    gpu: Arc<Gpu>,
}

struct Inner<T> {
    lanes: Lanes,
    /// What goes to a queue next; empty between submissions.
    batches: Batches,
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
    /// Sequence numbers of command buffers that have staging memory.
    pub(crate) staged: Vec<u64>,
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
            lanes: Lanes::new([site(0), site(1), site(2)], has_several),
            batches: Batches::default(),
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
    pub(crate) fn acquire(&self, queue: Queue) -> Result<Box<Recording>> {
        #[cfg(any(test, feature = "test-hooks"))]
        crate::test_support::submit_hook::interrupt();
        let ticket = self.lock().take(self.gpu.queues.lane(queue));
        self.begin(ticket)
    }

    /// As [`acquire`](Self::acquire), and takes out what the GPU has finished with.
    pub(crate) fn collect_and_acquire(&self, queue: Queue) -> Result<(Finished<T>, Result<Box<Recording>>)> {
        #[cfg(any(test, feature = "test-hooks"))]
        crate::test_support::submit_hook::interrupt();
        let completed = self.completed()?;
        let mut inner = self.lock();
        let finished = inner.take_finished(&completed);
        let ticket = inner.take(self.gpu.queues.lane(queue));
        drop(inner);
        Ok((finished, self.begin(ticket)))
    }

    /// Begins the command buffer that somebody will acquire next, while the GPU is at work.
    pub(crate) fn begin_ahead(&self, lane: usize) {
        let mut inner = self.lock();
        if inner.ring.has_begun(lane) {
            return;
        }
        let free = inner.ring.take_free(lane);
        drop(inner);
        // Where that fails, whoever acquires one begins another.
        if let Ok(begun) = command_pool::begin(&self.gpu, lane, free) {
            self.lock().ring.give_begun(begun);
        }
    }

    fn begin(&self, ticket: Ticket) -> Result<Box<Recording>> {
        let sequence = ticket.sequence;
        ticket.begin(&self.gpu).inspect_err(|_| self.lock().ring.close(sequence))
    }

    /// Gives a command buffer up.
    pub(crate) fn discard(&self, recording: Box<Recording>) {
        self.lock().ring.discard(recording);
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
        inner.batches.clear();
        match &sent {
            Ok(last) => inner.note(&submission, *last),
            Err(error) => inner.broken = Some(error.clone()),
        }
        let mut put_away = |part: Option<Box<Recording>>| part.map_or(0, |part| inner.put_away(part));
        let values = Values { prelude: put_away(submission.prelude), main: put_away(submission.main) };
        (values, sent.map(drop))
    }

    /// Answers the value of the last.
    fn submit_all(
        &self,
        inner: &mut Inner<T>,
        submission: &mut Submission,
        prepare: impl FnOnce(),
    ) -> Result<u64> {
        submission.parts().try_for_each(|part| end(&self.gpu, part.commands))?;
        if inner.lanes.are_several() && submission.parts().next().is_some() {
            prepare();
            return self.submit_to_several(inner, submission);
        }
        self.fill_batches(inner, submission)?;
        prepare();
        let value = inner.lanes.signal();
        self.send(inner, 0, value)?;
        submission.parts().for_each(|part| part.value = value);
        Ok(value)
    }

    /// Puts the barriers from the queue's state in front of each command buffer.
    fn fill_batches(&self, inner: &mut Inner<T>, submission: &mut Submission) -> Result<()> {
        inner.batches.wait(submission.waits.drain(..));
        inner.batches.signal(submission.signals.drain(..));
        for recording in submission.parts() {
            let images = inner.image_waits(recording);
            inner.batches.wait(images.iter().map(|image| self.image_wait(image)));
            let barriers = inner.lanes.submit_alone(&recording.tracker);
            if !barriers.is_empty() {
                let prologue = recording.prologue(&self.gpu)?;
                begin(&self.gpu, prologue)?;
                emit(&self.gpu, prologue, &barriers, &recording.images, &mut LastBarrier::default());
                end(&self.gpu, prologue)?;
                inner.batches.push(prologue);
            }
            inner.batches.push(recording.commands);
        }
        Ok(())
    }

    /// Each command buffer with its own waits, and a value of its own that others may wait for. Answers the last.
    fn submit_to_several(&self, inner: &mut Inner<T>, submission: &mut Submission) -> Result<u64> {
        let (has_prelude, exchanges) = (submission.prelude.is_some(), submission.exchanges);
        let mut waits = std::mem::take(&mut submission.waits);
        let mut signals = std::mem::take(&mut submission.signals);
        let (mut last, count) = (0, submission.parts().count());
        for (place, recording) in submission.parts().enumerate() {
            waits.extend(inner.image_waits(recording).iter().map(|image| self.image_wait(image)));
            let step = inner.step(recording, has_prelude && place == 0, exchanges);
            for departure in &step.departures {
                self.depart(inner, departure, &recording.images)?;
            }
            inner.batches.wait(waits.drain(..).chain(self.lane_waits(&step.waits)));
            if !step.arrivals.is_empty() || !step.barriers.is_empty() {
                inner.batches.push(self.record_prologue(recording, &step)?);
            }
            inner.batches.push(recording.commands);
            if place + 1 == count {
                inner.batches.signal(signals.drain(..));
            }
            self.send(inner, recording.lane, step.value)?;
            (recording.value, last) = (step.value, step.value);
        }
        Ok(last)
    }

    fn record_prologue(&self, recording: &mut Recording, step: &Step) -> Result<vk::CommandBuffer> {
        let commands = recording.prologue(&self.gpu)?;
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
        let ticket = inner.ring.take(departure.lane);
        let sequence = ticket.sequence;
        let mut recording = ticket.begin(&self.gpu).inspect_err(|_| inner.ring.close(sequence))?;
        let sent = self.send_moves(inner, departure, recording.commands, images);
        recording.value = if sent.is_ok() { departure.value } else { 0 };
        inner.put_away(recording);
        sent
    }

    fn send_moves(
        &self,
        inner: &mut Inner<T>,
        departure: &Departure,
        commands: vk::CommandBuffer,
        images: &Images,
    ) -> Result<()> {
        emit_moves(&self.gpu, commands, &departure.parts, images, Side::Release);
        end(&self.gpu, commands)?;
        inner.batches.wait(self.lane_waits(&departure.waits));
        inner.batches.push(commands);
        self.send(inner, departure.lane, departure.value)
    }

    /// Waits for an image that the presentation engine still has.
    fn image_wait(&self, wait: &AcquireWait) -> vk::SemaphoreSubmitInfo<'static> {
        let stages = stages(&self.gpu, wait.stages);
        vk::SemaphoreSubmitInfo::default().semaphore(wait.semaphore).stage_mask(stages)
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

    /// Hands the batches to a lane, which signals `value` behind them. A value that the queue did not take is not one of those
    /// that come.
    fn send(&self, inner: &mut Inner<T>, lane: usize, value: u64) -> Result<()> {
        let timeline = vk::SemaphoreSubmitInfo::default().semaphore(self.timelines[lane].raw).value(value);
        inner.batches.signal([timeline.stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)]);
        inner.batches.submit(&self.gpu, lane)?;
        inner.batches.clear();
        inner.lanes.submitted(lane, value);
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
    #[cfg(any(test, feature = "test-hooks"))]
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

    /// Number of the command buffer that was last given out to record.
    pub(crate) fn newest(&self) -> u64 {
        self.lock().ring.newest()
    }

    /// How many items wait to be destroyed.
    #[cfg(any(test, feature = "test-hooks"))]
    pub(crate) fn waiting(&self) -> usize {
        self.lock().deferred.len()
    }

    /// Takes out what the GPU has finished with.
    pub(crate) fn collect(&self) -> Result<Finished<T>> {
        let completed = self.completed()?;
        Ok(self.lock().take_finished(&completed))
    }

    /// As [`collect`](Self::collect), as far as is known without asking the GPU: all that was waited for, at least.
    pub(crate) fn collect_known(&self) -> Finished<T> {
        let mut completed = [0; LANES];
        for (timeline, completed) in self.timelines.iter().zip(&mut completed) {
            *completed = timeline.seen();
        }
        self.lock().take_finished(&completed)
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

impl Submission {
    fn parts(&mut self) -> impl Iterator<Item = &mut Recording> {
        self.prelude.iter_mut().chain(&mut self.main).map(|part| &mut **part)
    }
}

impl<T> Inner<T> {
    /// A command buffer of a lane is about to be recorded.
    fn take(&mut self, lane: usize) -> Ticket {
        if lane != 0 {
            self.lanes.begin_several();
        }
        self.ring.take(lane)
    }

    /// Keeps what a queue got until that is done with it, and takes back what none got. Answers the value.
    fn put_away(&mut self, recording: Box<Recording>) -> u64 {
        let value = recording.value;
        match value {
            0 => self.ring.discard(recording),
            _ => self.ring.submitted(recording),
        }
        value
    }

    fn take_finished(&mut self, completed: &PerLane<u64>) -> Finished<T> {
        self.lanes.reached(completed);
        let staged = self.ring.collect(completed);
        let oldest = self.ring.oldest_open();
        let submitted = self.lanes.last().iter().copied().max().unwrap_or_default();
        let passed = self.lanes.passed(completed);
        let garbage = self.deferred.collect(oldest, submitted, passed);
        Finished { staged, garbage, passed }
    }

    /// Images that the presentation engine still has and a command buffer is the first to use.
    fn image_waits(&mut self, recording: &Recording) -> Vec<AcquireWait> {
        self.presentables.take_waits(&recording.tracker, self.lanes.first_states())
    }

    fn step(&mut self, recording: &Recording, is_prelude: bool, exchanges: bool) -> Step {
        let sent = Sent {
            lane: recording.lane,
            tracker: &recording.tracker,
            references: &recording.references,
            after: recording.after,
            is_prelude,
            exchanges,
        };
        let images = &recording.images;
        self.lanes.submit(&sent, |id| images.get(&id).is_some_and(|image| image.is_exclusive))
    }

    /// All of a submission went to its queue.
    fn note(&mut self, submission: &Submission, last: u64) {
        submission.presented.into_iter().for_each(|id| self.presentables.present(id));
        if !submission.in_background {
            let part = submission.main.as_ref().or(submission.prelude.as_ref());
            self.foreground[part.map_or(0, |part| part.lane)] = last;
        }
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
