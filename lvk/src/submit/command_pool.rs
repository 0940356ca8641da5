//! State of command buffers: free, begun ahead, being recorded, or submitted.

use std::collections::VecDeque;

use super::last_access::PerQueue;
use super::recording::Recording;
use crate::error::Result;
use crate::gpu::Gpu;

/// Command buffers of all queues.
#[derive(Default)]
pub(crate) struct CommandRing {
    queues: PerQueue<QueueCommandBuffers>,
    /// Sequence numbers of command buffers being recorded, in rising order.
    open: Vec<u64>,
    /// Sequence numbers of command buffers that were never submitted, but have staging memory. Kept until the next
    /// collection.
    discarded: Vec<u64>,
    /// Command buffers whose submission failed. The driver may run a part of them all the same.
    #[expect(clippy::vec_box, reason = "handed on as pointers")]
    failed: Vec<Box<Recording>>,
    last_sequence: u64,
}

/// Command buffers of one queue.
#[derive(Default)]
struct QueueCommandBuffers {
    /// A command buffer begun ahead, for the next acquisition.
    begun: Option<Box<Recording>>,
    #[expect(clippy::vec_box, reason = "handed on as pointers")]
    free: Vec<Box<Recording>>,
    /// Submitted command buffers in the order of their timeline values.
    in_flight: VecDeque<Box<Recording>>,
}

/// Permission to record a command buffer.
pub(crate) struct Ticket {
    pub(crate) sequence: u64,
    queue_index: usize,
    begun: Option<Box<Recording>>,
    /// A command buffer to reuse, if one is free.
    free: Option<Box<Recording>>,
}

impl Ticket {
    /// Begins the command buffer without a lock. If that fails, the caller must call
    /// [`end_recording`](CommandRing::end_recording).
    pub(crate) fn begin(self, gpu: &Gpu) -> Result<Box<Recording>> {
        let mut recording = match self.begun {
            Some(begun) => begun,
            None => begin_recording(gpu, self.queue_index, self.free)?,
        };
        recording.sequence = self.sequence;
        Ok(recording)
    }
}

/// Begins `free`, or a new command buffer.
pub(crate) fn begin_recording(
    gpu: &Gpu,
    queue_index: usize,
    free: Option<Box<Recording>>,
) -> Result<Box<Recording>> {
    free.map_or_else(|| Recording::new(gpu, queue_index), Ok)?.begin(gpu)
}

impl CommandRing {
    /// Takes a command buffer of a queue to record.
    pub(crate) fn take_ticket(&mut self, queue_index: usize) -> Ticket {
        self.last_sequence += 1;
        self.open.push(self.last_sequence);
        let begun = self.queues[queue_index].begun.take();
        let free = if begun.is_none() { self.take_free(queue_index) } else { None };
        Ticket { sequence: self.last_sequence, queue_index, begun, free }
    }

    /// Returns true if a command buffer of the queue is begun ahead.
    pub(crate) fn has_begun(&self, queue_index: usize) -> bool {
        self.queues[queue_index].begun.is_some()
    }

    /// Takes a free command buffer of the queue, to begin it ahead.
    pub(crate) fn take_free(&mut self, queue_index: usize) -> Option<Box<Recording>> {
        self.queues[queue_index].free.pop()
    }

    /// Stores a command buffer begun ahead. One that another thread began meanwhile becomes free.
    pub(crate) fn store_begun(&mut self, recording: Box<Recording>) {
        let QueueCommandBuffers { begun, free, .. } = &mut self.queues[recording.queue_index];
        free.extend(begun.replace(recording));
    }

    /// Marks the command buffer of this sequence number as no longer being recorded.
    pub(crate) fn end_recording(&mut self, sequence: u64) {
        if let Ok(place) = self.open.binary_search(&sequence) {
            self.open.remove(place);
        }
    }

    /// Stores a submitted command buffer. It is done when the queue's timeline reaches its value.
    pub(crate) fn mark_submitted(&mut self, recording: Box<Recording>) {
        self.end_recording(recording.sequence);
        self.queues[recording.queue_index].in_flight.push_back(recording);
    }

    /// Keeps a command buffer whose submission failed, with its staging memory, until all are destroyed.
    pub(crate) fn keep_failed(&mut self, recording: Box<Recording>) {
        self.end_recording(recording.sequence);
        self.failed.push(recording);
    }

    /// Forgets a command buffer that was never submitted. The caller destroys it.
    pub(crate) fn forget(&mut self, recording: &Recording) {
        self.end_recording(recording.sequence);
        self.discarded.extend(recording.is_staged.then_some(recording.sequence));
    }

    /// Takes back command buffers that the queues have finished. Returns the sequence numbers of finished and discarded
    /// command buffers that have staging memory.
    pub(crate) fn collect(&mut self, completed: &PerQueue<u64>) -> Vec<u64> {
        let mut staged = std::mem::take(&mut self.discarded);
        for (QueueCommandBuffers { free, in_flight, .. }, completed) in self.queues.iter_mut().zip(completed)
        {
            while in_flight.front().is_some_and(|oldest| oldest.value <= *completed) {
                let Some(done) = in_flight.pop_front() else { break };
                staged.extend(done.is_staged.then_some(done.sequence));
                free.push(done);
            }
        }
        staged
    }

    /// Returns the submitted command buffers of a queue that are not done when its timeline is at `completed`.
    pub(crate) fn unfinished(&self, queue_index: usize, completed: u64) -> impl Iterator<Item = &Recording> {
        let in_flight = self.queues[queue_index].in_flight.iter();
        in_flight.map(|recording| &**recording).filter(move |recording| recording.value > completed)
    }

    /// Returns the sequence number of the latest command buffer taken.
    pub(crate) fn newest_sequence(&self) -> u64 {
        self.last_sequence
    }

    /// Returns the sequence number of the oldest command buffer being recorded.
    pub(crate) fn oldest_open(&self) -> Option<u64> {
        self.open.first().copied()
    }

    /// Returns the sequence number of the newest command buffer being recorded.
    pub(crate) fn newest_open(&self) -> Option<u64> {
        self.open.last().copied()
    }

    /// Destroys all command buffers. The GPU is idle and no command buffer is being recorded.
    pub(crate) fn destroy(&mut self, gpu: &Gpu) {
        for QueueCommandBuffers { begun, free, in_flight } in &mut self.queues {
            let all = begun.take().into_iter().chain(free.drain(..)).chain(in_flight.drain(..));
            all.for_each(|recording| recording.destroy(gpu));
        }
        self.failed.drain(..).for_each(|recording| recording.destroy(gpu));
    }
}
