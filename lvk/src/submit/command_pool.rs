//! Which command buffers are free, begun ahead, being recorded, or with the GPU.

use std::collections::VecDeque;

use super::ownership::PerQueue;
use super::recording::Recording;
use crate::error::Result;
use crate::gpu::Gpu;

/// Command buffers of all queues.
#[derive(Default)]
pub(crate) struct CommandRing {
    queues: PerQueue<QueueCommandBuffers>,
    /// Sequence numbers of those being recorded, in rising order.
    open: Vec<u64>,
    /// Of those that never reached the GPU, but have staging memory; until the next collection.
    discarded: Vec<u64>,
    last_sequence: u64,
}

/// Command buffers of one queue.
#[derive(Default)]
struct QueueCommandBuffers {
    /// Begun already, for who comes next.
    begun: Option<Box<Recording>>,
    #[expect(clippy::vec_box, reason = "handed on as pointers")]
    free: Vec<Box<Recording>>,
    /// In the order of their values.
    in_flight: VecDeque<Box<Recording>>,
}

/// Leave to record a command buffer.
pub(crate) struct Ticket {
    pub(crate) sequence: u64,
    queue_index: usize,
    begun: Option<Box<Recording>>,
    /// What is recorded again, if there is any.
    free: Option<Box<Recording>>,
}

impl Ticket {
    /// Begins the command buffer, which needs no lock. Where that fails, the ring is to be [told](CommandRing::end_recording).
    pub(crate) fn begin(self, gpu: &Gpu) -> Result<Box<Recording>> {
        let mut recording = match self.begun {
            Some(begun) => begun,
            None => begin_recording(gpu, self.queue_index, self.free)?,
        };
        recording.sequence = self.sequence;
        Ok(recording)
    }
}

/// Begins what is free, or a new one.
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

    /// Whether a command buffer of the queue is begun already, for who comes next.
    pub(crate) fn has_begun(&self, queue_index: usize) -> bool {
        self.queues[queue_index].begun.is_some()
    }

    /// A command buffer of the queue to begin.
    pub(crate) fn take_free(&mut self, queue_index: usize) -> Option<Box<Recording>> {
        self.queues[queue_index].free.pop()
    }

    /// A command buffer is begun for who comes next. One that another thread began meanwhile is free again.
    pub(crate) fn store_begun(&mut self, recording: Box<Recording>) {
        let QueueCommandBuffers { begun, free, .. } = &mut self.queues[recording.queue_index];
        free.extend(begun.replace(recording));
    }

    /// The command buffer of this number is recorded no longer.
    pub(crate) fn end_recording(&mut self, sequence: u64) {
        if let Ok(place) = self.open.binary_search(&sequence) {
            self.open.remove(place);
        }
    }

    /// The command buffer was submitted, and is done when the queue's timeline reaches its value.
    pub(crate) fn mark_submitted(&mut self, recording: Box<Recording>) {
        self.end_recording(recording.sequence);
        self.queues[recording.queue_index].in_flight.push_back(recording);
    }

    /// The command buffer was given up before submission.
    pub(crate) fn discard(&mut self, recording: Box<Recording>) {
        self.end_recording(recording.sequence);
        self.discarded.extend(recording.is_staged.then_some(recording.sequence));
        self.queues[recording.queue_index].free.push(recording);
    }

    /// Takes command buffers back that the queues are done with; answers the sequence numbers of those that have staging
    /// memory, and those given up.
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

    /// Sequence number of the command buffer that was taken last.
    pub(crate) fn newest_sequence(&self) -> u64 {
        self.last_sequence
    }

    /// Sequence number of the oldest command buffer being recorded.
    pub(crate) fn oldest_open(&self) -> Option<u64> {
        self.open.first().copied()
    }

    /// Sequence number of the newest command buffer being recorded.
    pub(crate) fn newest_open(&self) -> Option<u64> {
        self.open.last().copied()
    }

    /// Destroys everything. The GPU is idle and nothing is being recorded.
    pub(crate) fn destroy(&mut self, gpu: &Gpu) {
        for QueueCommandBuffers { begun, free, in_flight } in &mut self.queues {
            let all = begun.take().into_iter().chain(free.drain(..)).chain(in_flight.drain(..));
            all.for_each(|recording| recording.destroy(gpu));
        }
    }
}
