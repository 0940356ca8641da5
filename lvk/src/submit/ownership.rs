//! Which queue has what: who wrote last, who has read since, and which waits between queues follow. Decisions only.
//!
//! A queue runs command buffers in one order and signals a rising value after each. Its waits hold up everything behind them,
//! at every stage, so that what a queue has waited for once is there for all it gets later; what the queue waited for had
//! waited for others in turn. A [`TimelineVector`] says so in a number for each queue.

use std::collections::VecDeque;

use crate::barrier::{IdMap, ResourceId};

/// Most queues there are.
pub(crate) const QUEUE_COUNT: usize = 3;

/// Something for each queue.
pub(crate) type PerQueue<T> = [T; QUEUE_COUNT];

/// A value of each queue: everything up to it is meant; 0 for nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct TimelineVector(PerQueue<u64>);

/// What a command buffer does to a resource, as other queues see it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum QueueAccess {
    /// It may run beside other reads.
    Read,
    /// Contents, layout or owner change.
    Write,
}

/// Who has a resource.
#[derive(Debug, Clone, Copy, Default)]
struct ResourceOwner {
    /// Who wrote it last.
    queue_index: usize,
    /// When: the value after which the write is done.
    written: u64,
    /// The last reads since then; 0 for queues that have not read.
    read: PerQueue<u64>,
}

/// Who has every resource, and what each queue has waited for.
#[derive(Debug, Default)]
pub(crate) struct Ownership {
    owners: IdMap<ResourceOwner>,
    /// What everything that a queue gets from now on stands behind.
    waited_for: PerQueue<TimelineVector>,
    /// The same for each value that is not known to be reached yet, in rising order.
    submitted: PerQueue<VecDeque<(u64, TimelineVector)>>,
}

impl TimelineVector {
    /// Has `queue_index` at `value` at least.
    pub(crate) fn max_with_value(&mut self, queue_index: usize, value: u64) {
        self.0[queue_index] = self.0[queue_index].max(value);
    }

    /// What either has.
    pub(crate) fn max_with(&mut self, other: Self) {
        other.values().for_each(|(queue_index, value)| self.max_with_value(queue_index, value));
    }

    /// The value of a queue.
    pub(crate) fn at(&self, queue_index: usize) -> u64 {
        self.0[queue_index]
    }

    /// Queues with a value, and the value.
    pub(crate) fn values(&self) -> impl Iterator<Item = (usize, u64)> + use<> {
        self.0.into_iter().enumerate().filter(|(_, value)| *value > 0)
    }

    fn clear_queue(&mut self, queue_index: usize) {
        self.0[queue_index] = 0;
    }
}

impl Ownership {
    /// Whose state of a resource holds; none where nobody has used it.
    pub(crate) fn owner(&self, id: ResourceId) -> Option<usize> {
        self.owners.get(&id).map(|owner| owner.queue_index)
    }

    /// A queue had the resource to itself up to this value.
    pub(crate) fn claim(&mut self, id: ResourceId, queue_index: usize, value: u64) {
        self.owners.insert(id, ResourceOwner { queue_index, written: value, read: [0; QUEUE_COUNT] });
    }

    /// The resource is gone.
    pub(crate) fn forget(&mut self, id: ResourceId) {
        self.owners.remove(&id);
    }

    /// What `queue_index` gets next, done at `value`, uses a resource. Adds to `waits` what that has to wait for, and answers the queue
    /// that it takes the resource over from, if the queue itself does not know it.
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

    /// A queue gets something, done at `value`, that has to wait for `needed`. Answers the waits that do it: none for what the
    /// queue stands behind anyway, and none that another of them has made.
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

    /// The queues are there: what was sent up to then is done, and waits for it cost nothing.
    pub(crate) fn mark_completed(&mut self, values: &PerQueue<u64>) {
        for (submitted, value) in self.submitted.iter_mut().zip(values) {
            let done = submitted.partition_point(|(submitted, _)| submitted <= value);
            submitted.drain(..done);
        }
    }

    /// The first value behind this one that the queue was sent.
    pub(crate) fn first_value_after(&self, queue_index: usize, value: u64) -> Option<u64> {
        let submitted = &self.submitted[queue_index];
        submitted
            .get(submitted.partition_point(|(submitted, _)| *submitted <= value))
            .map(|(submitted, _)| *submitted)
    }

    /// What a queue has done and waited for at a value, as far as that is still known.
    fn waited_for_at(&self, queue_index: usize, value: u64) -> TimelineVector {
        let submitted = &self.submitted[queue_index];
        let place = submitted.partition_point(|(submitted, _)| *submitted < value);
        submitted
            .get(place)
            .filter(|(submitted, _)| *submitted == value)
            .map_or_else(TimelineVector::default, |(_, vector)| *vector)
    }
}
