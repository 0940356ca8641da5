//! Synchronisation of command buffers on several queues: the barriers, waits and ownership transfers before each. It
//! decides only, and records no commands.

use super::ownership::{Ownership, PerQueue, QUEUE_COUNT, QueueAccess, TimelineVector};
use crate::barrier::{
    Barriers, Layout, QueueState, ResourceId, Stages, Subresources, TextureShape, TrackedUse, Tracker,
};

/// Properties of the device queue behind a queue of the library.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct QueueCaps {
    /// Index of the ownership domain (queue family). Queues of one domain own images together.
    pub(crate) domain: u32,
    /// Stages that its command buffers support.
    pub(crate) stages: Stages,
}

/// The state of all resources on every queue.
///
/// While only queue 0 is used, only its states are tracked.
pub(crate) struct QueueSync {
    states: PerQueue<QueueState>,
    queue_caps: PerQueue<QueueCaps>,
    ownership: Ownership,
    /// True once another queue than the first was requested.
    multi_queue: bool,
    /// True if the device has several queues.
    has_several: bool,
    sent: u64,
    last: PerQueue<u64>,
    /// The last value of queue 0 before queues were tracked separately.
    last_single_queue: u64,
    /// The value of the last prelude on queue 0, which all later work relies on.
    prelude: u64,
}

/// The work that a command buffer needs before it.
#[derive(Debug, Default)]
pub(crate) struct SubmitPlan {
    /// Releases to submit before the command buffer, one submission each.
    pub(crate) releases: Vec<OwnershipRelease>,
    /// The value that the queue signals after the command buffer.
    pub(crate) value: u64,
    pub(crate) waits: TimelineVector,
    /// Acquire sides of `releases`, on the queue of the command buffer.
    pub(crate) acquires: Vec<OwnershipTransfer>,
    pub(crate) barriers: Barriers,
}

/// A submission in which a queue releases images to another domain.
#[derive(Debug)]
pub(crate) struct OwnershipRelease {
    pub(crate) queue_index: usize,
    pub(crate) value: u64,
    pub(crate) waits: TimelineVector,
    pub(crate) parts: Vec<OwnershipTransfer>,
}

/// A part of an image that changes its owner and keeps its layout.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct OwnershipTransfer {
    pub(crate) id: ResourceId,
    pub(crate) part: Subresources,
    pub(crate) layout: Layout,
    pub(crate) from: usize,
    pub(crate) to: usize,
}

/// A command buffer to submit.
pub(crate) struct SubmitRequest<'a> {
    pub(crate) queue_index: usize,
    pub(crate) tracker: &'a Tracker,
    /// Resources that need no barriers within a queue.
    pub(crate) references: &'a [(ResourceId, QueueAccess)],
    /// Further waits.
    pub(crate) after: TimelineVector,
    /// True if all later submissions rely on it, on queues that support shaders.
    pub(crate) is_prelude: bool,
    /// True if external semaphores are waited for or signalled. External code may then have written the used resources,
    /// or may write them later.
    pub(crate) exchanges: bool,
}

impl QueueSync {
    pub(crate) fn new(queue_caps: PerQueue<QueueCaps>, has_several: bool) -> Self {
        Self {
            states: Default::default(),
            queue_caps,
            ownership: Ownership::default(),
            multi_queue: false,
            has_several,
            sent: 0,
            last: [0; QUEUE_COUNT],
            last_single_queue: 0,
            prelude: 0,
        }
    }

    /// Returns the queue that a value belongs to.
    pub(crate) fn queue_of(value: u64, has_several: bool) -> usize {
        if has_several { (value % QUEUE_COUNT as u64) as usize } else { 0 }
    }

    /// Begins to track the queues separately. Counts all earlier accesses of queue 0 as lasting until now.
    pub(crate) fn begin_multi_queue(&mut self) {
        if std::mem::replace(&mut self.multi_queue, true) {
            return;
        }
        let ids: Vec<_> = self.states[0].ids().collect();
        ids.into_iter().for_each(|id| self.ownership.claim(id, 0, self.last[0]));
        self.last_single_queue = self.last[0];
        self.prelude = self.last[0];
    }

    /// Returns true if the queues are tracked separately.
    pub(crate) fn is_multi_queue(&self) -> bool {
        self.multi_queue
    }

    /// Returns the value for the next work of `queue_index`. Values rise over all queues, and each belongs to one
    /// queue.
    pub(crate) fn next_value(&mut self, queue_index: usize) -> u64 {
        self.sent += 1;
        if self.has_several { self.sent * QUEUE_COUNT as u64 + queue_index as u64 } else { self.sent }
    }

    /// Records that the work which signals `value` was submitted, so that other work may wait for the value. A value
    /// whose submission failed is never signalled.
    pub(crate) fn mark_submitted(&mut self, queue_index: usize, value: u64) {
        self.last[queue_index] = value;
    }

    /// Returns the last value of each queue that will be signalled.
    pub(crate) fn last_values(&self) -> &PerQueue<u64> {
        &self.last
    }

    /// Returns the number of values used so far.
    #[cfg(any(test, feature = "test-hooks"))]
    pub(crate) fn value_count(&self) -> u64 {
        self.sent
    }

    /// Returns the value up to which all work is done, when the queues have reached `completed`. It is one less than
    /// the first unfinished value.
    pub(crate) fn completed_up_to(&self, completed: &PerQueue<u64>) -> u64 {
        let newest = self.last.iter().copied().max().unwrap_or_default();
        let busy = (0..QUEUE_COUNT).filter(|queue_index| completed[*queue_index] < self.last[*queue_index]);
        busy.map(|queue_index| self.first_value_after(queue_index, completed[queue_index]) - 1)
            .min()
            .unwrap_or(newest)
    }

    /// Returns the first value of a busy queue after one that it has reached. Values are not recorded one by one while
    /// the queues are not tracked separately.
    fn first_value_after(&self, queue_index: usize, completed: u64) -> u64 {
        let noted = self.multi_queue && (queue_index != 0 || completed >= self.last_single_queue);
        let first = if noted { self.ownership.first_value_after(queue_index, completed) } else { None };
        first.unwrap_or(completed + 1)
    }

    /// Returns the states of queue 0. Valid while it is the only queue, or for resources that no other queue uses.
    pub(crate) fn graphics_state(&mut self) -> &mut QueueState {
        &mut self.states[0]
    }

    /// Appends a command buffer to queue 0, while that is the only queue.
    pub(crate) fn submit_single_queue(&mut self, tracker: &Tracker) -> Barriers {
        self.states[0].submit(tracker)
    }

    /// Appends a command buffer to a queue. `is_exclusive` returns true for resources that belong to one domain at a
    /// time.
    pub(crate) fn submit(
        &mut self,
        sent: &SubmitRequest<'_>,
        is_exclusive: impl Fn(ResourceId) -> bool,
    ) -> SubmitPlan {
        let queue_index = sent.queue_index;
        let (releases, acquires) = self.plan_ownership_transfers(queue_index, sent.tracker, is_exclusive);
        let value = self.next_value(queue_index);
        let mut waits = sent.after;
        for used in sent.tracker.tracked_uses() {
            let given = sent.exchanges || sent.references.contains(&(used.id, QueueAccess::Write));
            let writes = given || acquires.iter().any(|transfer| transfer.id == used.id);
            self.record_use((queue_index, value), used, writes, &mut waits);
        }
        for (id, access) in sent.references {
            if !sent.tracker.uses_resource(*id) {
                self.ownership.record_access((queue_index, value), *id, *access, &mut waits);
            }
        }
        if queue_index != 0 && self.queue_caps[queue_index].stages.intersects(Stages::SHADERS) {
            waits.max_with_value(0, self.prelude);
        }
        if sent.is_prelude {
            self.prelude = value;
        }
        let waits = self.ownership.record_submission(queue_index, value, waits);
        let barriers = self.states[queue_index].submit(sent.tracker);
        SubmitPlan { releases, value, waits, acquires, barriers }
    }

    /// Records the use of a resource by the command buffer: the waits, and the new state of the resource on the queue.
    /// With `writes`, counts the use as a write for other queues, whether its commands write or not.
    fn record_use(
        &mut self,
        at: (usize, u64),
        used: TrackedUse<'_>,
        writes: bool,
        waits: &mut TimelineVector,
    ) {
        let owner = self.ownership.owner(used.id);
        let before = owner.and_then(|owner| self.states[owner].layouts(used.id));
        let writes = writes || used.changes(before.as_ref());
        let access = if writes { QueueAccess::Write } else { QueueAccess::Read };
        if self.ownership.record_access(at, used.id, access, waits).is_some() {
            let queue_index = at.0;
            self.states[queue_index].take_ownership(
                used,
                before.as_ref(),
                self.queue_caps[queue_index].stages - Stages::HOST,
            );
        }
    }

    /// Plans the release of resources that other domains own and `queue_index` uses: one submission for each releasing
    /// queue.
    fn plan_ownership_transfers(
        &mut self,
        queue_index: usize,
        tracker: &Tracker,
        is_exclusive: impl Fn(ResourceId) -> bool,
    ) -> (Vec<OwnershipRelease>, Vec<OwnershipTransfer>) {
        let domain = self.queue_caps[queue_index].domain;
        let mut transfer = Vec::new();
        for used in tracker.tracked_uses() {
            let Some(from) = self.ownership.owner(used.id) else { continue };
            if self.queue_caps[from].domain == domain || !is_exclusive(used.id) {
                continue;
            }
            let parts = self.states[from]
                .layouts(used.id)
                .map(|layouts| layouts.uniform_ranges())
                .unwrap_or_default();
            // Parts that were never written need no transfer.
            let parts = parts.into_iter().filter(|(_, layout)| *layout != Layout::Undefined);
            transfer.extend(parts.map(|(part, layout)| OwnershipTransfer {
                id: used.id,
                part,
                layout,
                from,
                to: queue_index,
            }));
        }
        let from = |queue_index| {
            transfer.iter().filter(move |part| part.from == queue_index).copied().collect::<Vec<_>>()
        };
        let parts: PerQueue<Vec<_>> = [from(0), from(1), from(2)];
        let leaving = parts.into_iter().enumerate().filter(|(_, parts)| !parts.is_empty());
        let releases = leaving.map(|(from, parts)| self.plan_release(from, parts)).collect();
        (releases, transfer)
    }

    /// Plans the release by one queue. It waits for the readers of the parts in its own domain.
    fn plan_release(&mut self, queue_index: usize, parts: Vec<OwnershipTransfer>) -> OwnershipRelease {
        let value = self.next_value(queue_index);
        let mut waits = TimelineVector::default();
        for transfer in &parts {
            self.ownership.record_access((queue_index, value), transfer.id, QueueAccess::Write, &mut waits);
        }
        let waits = self.ownership.record_submission(queue_index, value, waits);
        OwnershipRelease { queue_index, value, waits, parts }
    }

    /// Returns the value of a signal on queue 0 that has no command buffer.
    pub(crate) fn next_signal_value(&mut self) -> u64 {
        let value = self.next_value(0);
        if self.multi_queue {
            self.ownership.record_submission(0, value, TimelineVector::default());
        }
        value
    }

    /// Sets the layout of an imported image, and makes queue 0 its owner.
    pub(crate) fn import_image(&mut self, id: ResourceId, shape: TextureShape, layout: Layout) {
        self.states[0].mark_imported(id, shape, layout);
        if self.multi_queue {
            self.ownership.claim(id, 0, 0);
        }
    }

    /// Records that the host has written a new image, which is ready to be sampled. Makes queue 0 its owner.
    pub(crate) fn mark_host_written(&mut self, id: ResourceId, shape: TextureShape) {
        self.states[0].mark_host_written(id, shape);
        if self.multi_queue {
            self.ownership.claim(id, 0, 0);
        }
    }

    /// Records the completed values of the queues.
    pub(crate) fn mark_completed(&mut self, completed: &PerQueue<u64>) {
        if self.multi_queue {
            self.ownership.mark_completed(completed);
        }
    }

    /// Forgets a destroyed resource.
    pub(crate) fn forget(&mut self, id: ResourceId) {
        if !self.multi_queue {
            return self.states[0].forget(id);
        }
        self.states.iter_mut().for_each(|states| states.forget(id));
        self.ownership.forget(id);
    }
}
