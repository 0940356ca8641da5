//! What the host knows of finished submissions: waits, and questions for timeline values.

use std::sync::atomic::Ordering;
use std::time::Duration;

use super::last_access::{PerQueue, QUEUE_COUNT};
use super::queue::Submitter;
use crate::error::Result;
use crate::gpu::caps::queues::IdleFailure;

/// Time between two questions while the validation layer listens.
const LISTENING_PAUSE: Duration = Duration::from_micros(20);

impl<T> Submitter<T> {
    /// Blocks until the submission of this value is done.
    pub(crate) fn wait(&self, value: u64) -> Result<()> {
        self.explain_loss(self.wait_on(self.queue_of(value), value))
    }

    /// Blocks until the submissions of all these values are done.
    pub(crate) fn wait_for_queues(&self, values: &PerQueue<u64>) -> Result<()> {
        let mut queues = 0..self.timelines.len();
        self.explain_loss(queues.try_for_each(|queue_index| self.wait_on(queue_index, values[queue_index])))
    }

    fn wait_on(&self, queue_index: usize, value: u64) -> Result<()> {
        let timeline = self.timeline(queue_index);
        if !self.gpu.is_watched() {
            return timeline.wait(value);
        }
        self.hear()?;
        while timeline.last_seen() < value {
            std::thread::sleep(LISTENING_PAUSE);
            self.hear()?;
        }
        Ok(())
    }

    /// Waits until the driver no longer uses the external semaphores of submissions that are done. Mesa's queue thread
    /// uses the semaphores that a submission waited for after the submission has signalled its own.
    pub(crate) fn wait_for_semaphores(&self) -> Result<()> {
        if self.uses_external_semaphores.load(Ordering::Relaxed) {
            let idle = self.gpu.queues.wait_idle(&self.gpu.device);
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
        for (queue_index, timeline) in self.timelines.iter().enumerate() {
            if self.completed_of(queue_index)? < timeline.last_submitted() {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Returns the value up to which all submissions are done.
    pub(crate) fn completed_up_to(&self) -> Result<u64> {
        let completed = self.completed_values()?;
        Ok(self.lock().queue_sync.completed_up_to(&completed))
    }

    /// Queries the completed values of the queues.
    pub(super) fn completed_values(&self) -> Result<PerQueue<u64>> {
        let mut completed = [0; QUEUE_COUNT];
        for (queue_index, completed) in (0..self.timelines.len()).zip(&mut completed) {
            *completed = self.completed_of(queue_index)?;
        }
        Ok(completed)
    }

    /// Queries the completed value of a queue.
    pub(crate) fn completed_of(&self, queue_index: usize) -> Result<u64> {
        let timeline = self.timeline(queue_index);
        let completed = if self.gpu.is_watched() {
            self.hear().map(|()| timeline.last_seen())
        } else {
            timeline.query_completed()
        };
        self.explain_loss(completed)
    }

    /// Returns the completed values of the queues that are known without a query.
    pub(super) fn last_seen(&self) -> PerQueue<u64> {
        let mut seen = [0; QUEUE_COUNT];
        for (timeline, seen) in self.timelines.iter().zip(&mut seen) {
            *seen = timeline.last_seen();
        }
        seen
    }

    /// Lets host and validation layer learn of all values that the queues have reached.
    fn hear(&self) -> Result<()> {
        self.lock().unheard.hear(|queue_index, value| self.timeline(queue_index).reaches(value, 0))
    }
}
