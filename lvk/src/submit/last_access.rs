//! Ownership of resources by queues: the last writer, the readers since, and the resulting waits between queues. It
//! decides only, and records no commands.
//!
//! A queue runs command buffers in order and signals a rising timeline value after each. A wait blocks all later work
//! of the queue, at every stage. Anything that a queue has waited for once is therefore visible to all of its later
//! work, together with everything that the signalling queue had waited for before. A [`TimelineVector`] expresses this
//! as one timeline value for each queue.

use std::collections::VecDeque;

use crate::barrier::{IdMap, ResourceId};

/// Maximum number of queues.
pub(crate) const QUEUE_COUNT: usize = 3;

/// A value for each queue.
pub(crate) type PerQueue<T> = [T; QUEUE_COUNT];

/// A timeline value for each queue. It stands for all work up to that value; 0 stands for none.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct TimelineVector(PerQueue<u64>);

/// Access of a command buffer to a resource, as other queues see it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum QueueAccess {
    /// A read, which may run concurrently with other reads.
    Read,
    /// Changes contents, layout or owner.
    Write,
}

/// The owner and the accesses of a resource.
#[derive(Debug, Clone, Copy, Default)]
struct ResourceOwner {
    /// Index of the queue that wrote last.
    queue_index: usize,
    /// Timeline value at which the last write is done.
    written: u64,
    /// Timeline values of the last reads since then; 0 for queues that have not read.
    read: PerQueue<u64>,
}

/// The owner of every resource, and the values that each queue has waited for.
#[derive(Debug, Default)]
pub(crate) struct Ownership {
    owners: IdMap<ResourceOwner>,
    /// For each queue, the values that precede all of its later work.
    waited_for: PerQueue<TimelineVector>,
    /// For each queue, the same at each submitted value that is not known to be reached, in rising order.
    submitted: PerQueue<VecDeque<(u64, TimelineVector)>>,
}

impl TimelineVector {
    /// Raises the value of `queue_index` to at least `value`.
    pub(crate) fn max_with_value(&mut self, queue_index: usize, value: u64) {
        self.0[queue_index] = self.0[queue_index].max(value);
    }

    /// Raises each value to at least that of `other`.
    pub(crate) fn max_with(&mut self, other: Self) {
        other.values().for_each(|(queue_index, value)| self.max_with_value(queue_index, value));
    }

    /// Returns the value of a queue.
    pub(crate) fn at(&self, queue_index: usize) -> u64 {
        self.0[queue_index]
    }

    /// Returns the queues with a value above 0, and their values.
    pub(crate) fn values(&self) -> impl Iterator<Item = (usize, u64)> + use<> {
        self.0.into_iter().enumerate().filter(|(_, value)| *value > 0)
    }

    fn clear_queue(&mut self, queue_index: usize) {
        self.0[queue_index] = 0;
    }
}

impl Ownership {
    /// Returns the queue whose state of the resource is valid, or `None` if no queue has used the resource.
    pub(crate) fn owner(&self, id: ResourceId) -> Option<usize> {
        self.owners.get(&id).map(|owner| owner.queue_index)
    }

    /// Makes a queue the only user of the resource up to this value.
    pub(crate) fn claim(&mut self, id: ResourceId, queue_index: usize, value: u64) {
        self.owners.insert(id, ResourceOwner { queue_index, written: value, read: [0; QUEUE_COUNT] });
    }

    /// Forgets a destroyed resource.
    pub(crate) fn forget(&mut self, id: ResourceId) {
        self.owners.remove(&id);
    }

    /// Records that the next work of `queue_index`, done at `value`, uses a resource. Adds the required waits to
    /// `waits`. Returns the previous owner if this queue has not synchronised with it before.
    pub(crate) fn record_access(
        &mut self,
        (queue_index, value): (usize, u64),
        id: ResourceId,
        access: QueueAccess,
        waits: &mut TimelineVector,
    ) -> Option<usize> {
        let owner =
            self.owners.entry(id).or_insert(ResourceOwner { queue_index, ..ResourceOwner::default() });
        let from = owner.queue_index;
        let is_known = from == queue_index || owner.read[queue_index] > 0;
        if !is_known {
            waits.max_with_value(from, owner.written);
        }
        match access {
            QueueAccess::Read => owner.read[queue_index] = value,
            QueueAccess::Write => {
                waits.max_with(TimelineVector(owner.read));
                *owner = ResourceOwner { queue_index, written: value, read: [0; QUEUE_COUNT] };
            }
        }
        (!is_known).then_some(from)
    }

    /// Records work of a queue, done at `value`, that must wait for `needed`. Returns the waits that are sufficient.
    /// They omit what the queue has waited for already, and what another of these waits implies.
    pub(crate) fn record_submission(
        &mut self,
        queue_index: usize,
        value: u64,
        mut needed: TimelineVector,
    ) -> TimelineVector {
        needed.clear_queue(queue_index);
        for (other, wanted) in needed.values() {
            let waited = self.waited_for[queue_index].at(other) >= wanted;
            let implied = |(third, at)| third != other && self.waited_for_at(third, at).at(other) >= wanted;
            if waited || needed.values().any(implied) {
                needed.clear_queue(other);
            }
        }
        for (other, wanted) in needed.values() {
            let behind = self.waited_for_at(other, wanted);
            self.waited_for[queue_index].max_with(behind);
            self.waited_for[queue_index].max_with_value(other, wanted);
        }
        self.waited_for[queue_index].max_with_value(queue_index, value);
        self.submitted[queue_index].push_back((value, self.waited_for[queue_index]));
        needed
    }

    /// Records the completed values of the queues. Waits for completed values cost nothing.
    pub(crate) fn mark_completed(&mut self, values: &PerQueue<u64>) {
        for (submitted, value) in self.submitted.iter_mut().zip(values) {
            let done = submitted.partition_point(|(submitted, _)| submitted <= value);
            submitted.drain(..done);
        }
    }

    /// Returns the first value after `value` that was submitted to the queue.
    pub(crate) fn first_value_after(&self, queue_index: usize, value: u64) -> Option<u64> {
        let submitted = &self.submitted[queue_index];
        submitted
            .get(submitted.partition_point(|(submitted, _)| *submitted <= value))
            .map(|(submitted, _)| *submitted)
    }

    /// Returns the values that a queue has reached or waited for at `value`, if they are still recorded.
    fn waited_for_at(&self, queue_index: usize, value: u64) -> TimelineVector {
        let submitted = &self.submitted[queue_index];
        let place = submitted.partition_point(|(submitted, _)| *submitted < value);
        submitted
            .get(place)
            .filter(|(submitted, _)| *submitted == value)
            .map_or_else(TimelineVector::default, |(_, vector)| *vector)
    }
}
