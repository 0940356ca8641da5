//! Waits for submissions, and queries of the timeline values that the queues have completed.

use std::time::Duration;

use super::last_access::{PerQueue, QUEUE_COUNT};
use super::queue::Submitter;
use super::unobserved::Progress;
use crate::error::Result;
use crate::gpu::caps::queues::IdleFailure;

/// Longest wait for a value that holds the lock of submissions, in nanoseconds.
const LOCKED_WAIT_NS: u64 = 10_000;
/// Pause between two such waits, for other threads to submit.
const PAUSE: Duration = Duration::from_micros(20);

impl<T> Submitter<T> {
    /// Blocks until the submission of this value is done.
    pub(crate) fn wait(&self, value: u64) -> Result<()> {
        self.explain_loss(self.wait_on(self.queue_of(value), value))
    }

    /// Blocks until the submissions of all these values are done.
    pub(crate) fn wait_for_queues(&self, values: &PerQueue<u64>) -> Result<()> {
        let mut queues = 0..self.timelines().len();
        self.explain_loss(queues.try_for_each(|queue_index| self.wait_on(queue_index, values[queue_index])))
    }

    fn wait_on(&self, queue_index: usize, value: u64) -> Result<()> {
        let timeline = self.timeline(queue_index);
        if !self.observes_in_order() {
            return timeline.wait(value);
        }
        while timeline.last_seen() < value {
            match self.observe(LOCKED_WAIT_NS)? {
                Progress::Stalled => return timeline.wait(value),
                Progress::Recent if timeline.last_seen() < value => std::thread::sleep(PAUSE),
                Progress::Recent => {}
            }
        }
        Ok(())
    }

    /// Waits until the driver no longer uses the external semaphores of submissions that are done. Mesa's queue thread
    /// uses the semaphores that a submission waited for after the submission has signalled its own.
    pub(crate) fn wait_for_semaphores(&self) -> Result<()> {
        if self.uses_external_semaphores() {
            let idle = self.gpu().queues.wait_idle(&self.gpu().device);
            self.explain_loss(idle.map_err(IdleFailure::into_error))?;
        }
        Ok(())
    }

    /// Returns true if the submission of this value is done.
    pub(crate) fn is_done(&self, value: u64) -> Result<bool> {
        Ok(self.completed_of(self.queue_of(value))? >= value)
    }

    /// Returns true if all submissions of all queues are done.
    pub(crate) fn is_all_done(&self) -> Result<bool> {
        for (queue_index, timeline) in self.timelines().iter().enumerate() {
            if self.completed_of(queue_index)? < timeline.last_submitted() {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Queries the completed values of the queues.
    pub(super) fn completed_values(&self) -> Result<PerQueue<u64>> {
        for queue_index in 0..self.timelines().len() {
            self.completed_of(queue_index)?;
        }
        Ok(self.last_seen())
    }

    /// Queries the completed value of a queue.
    pub(crate) fn completed_of(&self, queue_index: usize) -> Result<u64> {
        let timeline = self.timeline(queue_index);
        if !self.observes_in_order() {
            return self.explain_loss(timeline.query_completed());
        }
        if timeline.last_seen() < timeline.last_submitted()
            && self.explain_loss(self.observe(0))? == Progress::Stalled
        {
            return self.explain_loss(timeline.query_completed());
        }
        Ok(timeline.last_seen())
    }

    /// Returns the completed values of the queues that are known without a query.
    pub(super) fn last_seen(&self) -> PerQueue<u64> {
        let mut seen = [0; QUEUE_COUNT];
        for (timeline, seen) in self.timelines().iter().zip(&mut seen) {
            *seen = timeline.last_seen();
        }
        seen
    }

    /// Observes all values that the queues have reached, and waits up to `timeout_ns` for each that follows.
    ///
    /// Without progress the caller asks in another way, whatever the validation layer makes of it: a wait that ends by its
    /// timeout need not tell of a lost device.
    fn observe(&self, timeout_ns: u64) -> Result<Progress> {
        self.with_unobserved(|unobserved| {
            unobserved.observe(|queue_index, value| {
                let timeline = self.timeline(queue_index);
                if timeline.last_seen() >= value { Ok(true) } else { timeline.reaches(value, timeout_ns) }
            })
        })
    }
}
