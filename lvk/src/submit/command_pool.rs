//! Which command buffers are free, begun ahead, being recorded, or with the GPU.

use std::collections::VecDeque;

use super::ownership::PerLane;
use super::recording::Recording;
use crate::error::Result;
use crate::gpu::Gpu;

/// Command buffers of all lanes.
#[derive(Default)]
pub(crate) struct CommandRing {
    lanes: PerLane<Lane>,
    /// Sequence numbers of those being recorded, in rising order.
    open: Vec<u64>,
    /// Of those that never reached the GPU, but have staging memory; until the next collection.
    given_up: Vec<u64>,
    last_sequence: u64,
}

/// Command buffers of one lane.
#[derive(Default)]
struct Lane {
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
    lane: usize,
    begun: Option<Box<Recording>>,
    /// What is recorded again, if there is any.
    free: Option<Box<Recording>>,
}

impl Ticket {
    /// Begins the command buffer, which needs no lock. Where that fails, the ring is to be [told](CommandRing::close).
    pub(crate) fn begin(self, gpu: &Gpu) -> Result<Box<Recording>> {
        let mut recording = match self.begun {
            Some(begun) => begun,
            None => begin(gpu, self.lane, self.free)?,
        };
        recording.sequence = self.sequence;
        Ok(recording)
    }
}

/// Begins what is free, or a new one.
pub(crate) fn begin(gpu: &Gpu, lane: usize, free: Option<Box<Recording>>) -> Result<Box<Recording>> {
    free.map_or_else(|| Recording::new(gpu, lane), Ok)?.begin(gpu)
}

impl CommandRing {
    /// Takes a command buffer of a lane to record.
    pub(crate) fn take(&mut self, lane: usize) -> Ticket {
        self.last_sequence += 1;
        self.open.push(self.last_sequence);
        let begun = self.lanes[lane].begun.take();
        let free = if begun.is_none() { self.take_free(lane) } else { None };
        Ticket { sequence: self.last_sequence, lane, begun, free }
    }

    /// Whether a command buffer of the lane is begun already, for who comes next.
    pub(crate) fn has_begun(&self, lane: usize) -> bool {
        self.lanes[lane].begun.is_some()
    }

    /// A command buffer of the lane to begin.
    pub(crate) fn take_free(&mut self, lane: usize) -> Option<Box<Recording>> {
        self.lanes[lane].free.pop()
    }

    /// A command buffer is begun for who comes next. One that another thread began meanwhile is free again.
    pub(crate) fn give_begun(&mut self, recording: Box<Recording>) {
        let Lane { begun, free, .. } = &mut self.lanes[recording.lane];
        free.extend(begun.replace(recording));
    }

    /// The command buffer of this number is recorded no longer.
    pub(crate) fn close(&mut self, sequence: u64) {
        if let Ok(place) = self.open.binary_search(&sequence) {
            self.open.remove(place);
        }
    }

    /// The command buffer was submitted, and is done when the lane's timeline reaches its value.
    pub(crate) fn submitted(&mut self, recording: Box<Recording>) {
        self.close(recording.sequence);
        self.lanes[recording.lane].in_flight.push_back(recording);
    }

    /// The command buffer was given up before submission.
    pub(crate) fn discard(&mut self, recording: Box<Recording>) {
        self.close(recording.sequence);
        self.given_up.extend(recording.is_staged.then_some(recording.sequence));
        self.lanes[recording.lane].free.push(recording);
    }

    /// Takes command buffers back that the lanes are done with; answers the sequence numbers of those that have staging
    /// memory, and those given up.
    pub(crate) fn collect(&mut self, completed: &PerLane<u64>) -> Vec<u64> {
        let mut staged = std::mem::take(&mut self.given_up);
        for (Lane { free, in_flight, .. }, completed) in self.lanes.iter_mut().zip(completed) {
            while in_flight.front().is_some_and(|oldest| oldest.value <= *completed) {
                let Some(done) = in_flight.pop_front() else { break };
                staged.extend(done.is_staged.then_some(done.sequence));
                free.push(done);
            }
        }
        staged
    }

    /// Sequence number of the command buffer that was taken last.
    pub(crate) fn newest(&self) -> u64 {
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
        for Lane { begun, free, in_flight } in &mut self.lanes {
            let all = begun.take().into_iter().chain(free.drain(..)).chain(in_flight.drain(..));
            all.for_each(|recording| recording.destroy(gpu));
        }
    }
}
