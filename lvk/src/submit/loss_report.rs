//! The report of a lost device, from the submissions that are not done.

use std::sync::Arc;

use super::command_pool::CommandRing;
use super::label_trail::ReachedEvents;
use super::last_access::{PerQueue, QUEUE_COUNT};
use super::queue::Submitter;
use super::recording::Recording;
use crate::error::device_loss::{DeviceLossReport, QueueLossReport, UnfinishedCommands};
use crate::error::{Error, Result};
use crate::gpu::checkpoints::{Checkpoint, PassedCheckpoints};
use crate::queue::Queue;

impl<T> Submitter<T> {
    /// Adds the unfinished submissions to the error of a lost device. Locks the submitter.
    pub(crate) fn explain_loss<R>(&self, result: Result<R>) -> Result<R> {
        result.map_err(|error| self.explain_error(error))
    }

    /// As [`explain_loss`](Self::explain_loss), for an error.
    pub(crate) fn explain_error(&self, error: Error) -> Error {
        match &error {
            Error::DeviceLost { report } => self.with_ring(|ring, last| self.loss_error(ring, last, report)),
            _ => error,
        }
    }

    /// As [`explain_loss`](Self::explain_loss), for a caller that has locked the submitter. `last` holds the last value
    /// submitted to each queue.
    pub(super) fn explain_loss_locked(
        &self,
        ring: &CommandRing,
        last: &PerQueue<u64>,
        error: Error,
    ) -> Error {
        match &error {
            Error::DeviceLost { report } => self.loss_error(ring, last, report),
            _ => error,
        }
    }

    /// Returns the error with the report of the first loss, which later calls repeat.
    fn loss_error(&self, ring: &CommandRing, last: &PerQueue<u64>, report: &DeviceLossReport) -> Error {
        let complete = || {
            let fault = report.fault.clone().or_else(|| self.gpu().query_fault());
            let queues = self.unfinished_queues(ring, last);
            Arc::new(DeviceLossReport { call: report.call, object: report.object.clone(), fault, queues })
        };
        Error::DeviceLost { report: Arc::clone(self.loss().get_or_init(complete)) }
    }

    fn unfinished_queues(&self, ring: &CommandRing, last: &PerQueue<u64>) -> Vec<QueueLossReport> {
        let queues = Queue::ALL.into_iter().take(self.timelines().len().min(QUEUE_COUNT));
        let report = |queue: Queue| {
            let (queue_index, submitted) = (queue.index(), last[queue.index()]);
            let completed = self.timeline(queue_index).last_known(submitted);
            let recordings: Vec<_> = ring.unfinished(queue_index, completed).collect();
            let unfinished = unfinished_commands(&recordings, self.gpu().passed_checkpoints(queue_index));
            QueueLossReport { queue, completed, submitted, unfinished }
        };
        queues.map(report).filter(|queue| !queue.unfinished.is_empty()).collect()
    }
}

fn unfinished_commands(
    recordings: &[&Recording],
    passed: Option<PassedCheckpoints>,
) -> Vec<UnfinishedCommands> {
    let sequences: Vec<u64> = recordings.iter().map(|recording| recording.sequence).collect();
    let commands = recordings.iter().enumerate().map(|(place, recording)| UnfinishedCommands {
        value: recording.value(),
        name: recording.labels.name().to_owned(),
        labels: recording.labels.report(passed.map(|passed| reached_events(passed, &sequences, place))),
    });
    commands.collect()
}

/// Returns how far the GPU has come in the command buffer at `place` of a queue's unfinished command buffers, which
/// have these sequence numbers in the order of their submission. A checkpoint of a finished command buffer means that
/// none of them has passed one.
fn reached_events(passed: PassedCheckpoints, sequences: &[u64], place: usize) -> ReachedEvents {
    let event = |checkpoint: Option<Checkpoint>| {
        let Some(checkpoint) = checkpoint else { return 0 };
        match sequences.iter().position(|sequence| checkpoint.is_in(*sequence)) {
            Some(last) if last > place => usize::MAX,
            Some(last) if last == place => checkpoint.event,
            _ => 0,
        }
    };
    let done = event(passed.done);
    ReachedEvents { begun: event(passed.begun).max(done), done }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn checkpoints_place_every_command_buffer_before_at_or_behind_them() {
        let sequences = [31, 12, 40];
        let passed =
            PassedCheckpoints { begun: Some(Checkpoint::new(40, 2)), done: Some(Checkpoint::new(12, 5)) };
        let reached = |passed| [0, 1, 2].map(|place| reached_events(passed, &sequences, place));
        let events = |begun, done| ReachedEvents { begun, done };
        let all = usize::MAX;
        assert_eq!(reached(passed), [events(all, all), events(all, 5), events(2, 0)]);
        let stale = PassedCheckpoints { begun: Some(Checkpoint::new(7, 3)), done: None };
        assert_eq!(reached(stale), [events(0, 0); 3]);
        let only_done = PassedCheckpoints { begun: None, ..passed };
        assert_eq!(reached(only_done)[1], events(5, 5));
    }
}
