//! Which lane has what: who wrote last, who has read since, and which waits between lanes follow. Decisions only.
//!
//! A lane runs command buffers in one order and signals a rising value after each. Its waits hold up everything behind them,
//! at every stage, so that what a lane has waited for once is there for all it gets later; what the lane waited for had
//! waited for others in turn. A [`Clock`] says so in a number for each lane.

use std::collections::VecDeque;

use crate::barrier::{IdMap, ResourceId};

/// Most lanes there are.
pub(crate) const LANES: usize = 3;

/// Something for each lane.
pub(crate) type PerLane<T> = [T; LANES];

/// A value of each lane: everything up to it is meant; 0 for nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Clock(PerLane<u64>);

/// What a command buffer does to a resource, as other lanes see it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Access {
    /// It may run beside other reads.
    Read,
    /// Contents, layout or owner change.
    Write,
}

/// Who has a resource.
#[derive(Debug, Clone, Copy, Default)]
struct Owner {
    /// Who wrote it last.
    lane: usize,
    /// When: the value after which the write is done.
    written: u64,
    /// The last reads since then; 0 for lanes that have not read.
    read: PerLane<u64>,
}

/// Who has every resource, and what each lane has waited for.
#[derive(Debug, Default)]
pub(crate) struct Ownership {
    owners: IdMap<Owner>,
    /// What everything that a lane gets from now on stands behind.
    known: PerLane<Clock>,
    /// The same for each value that is not known to be reached yet, in rising order.
    sent: PerLane<VecDeque<(u64, Clock)>>,
}

impl Clock {
    /// Has `lane` at `value` at least.
    pub(crate) fn raise(&mut self, lane: usize, value: u64) {
        self.0[lane] = self.0[lane].max(value);
    }

    /// What either has.
    pub(crate) fn join(&mut self, other: Self) {
        other.values().for_each(|(lane, value)| self.raise(lane, value));
    }

    /// The value of a lane.
    pub(crate) fn at(&self, lane: usize) -> u64 {
        self.0[lane]
    }

    /// Lanes with a value, and the value.
    pub(crate) fn values(&self) -> impl Iterator<Item = (usize, u64)> + use<> {
        self.0.into_iter().enumerate().filter(|(_, value)| *value > 0)
    }

    fn clear(&mut self, lane: usize) {
        self.0[lane] = 0;
    }
}

impl Ownership {
    /// Whose state of a resource holds; none where nobody has used it.
    pub(crate) fn owner(&self, id: ResourceId) -> Option<usize> {
        self.owners.get(&id).map(|owner| owner.lane)
    }

    /// A lane had the resource to itself up to this value.
    pub(crate) fn claim(&mut self, id: ResourceId, lane: usize, value: u64) {
        self.owners.insert(id, Owner { lane, written: value, read: [0; LANES] });
    }

    /// The resource is gone.
    pub(crate) fn forget(&mut self, id: ResourceId) {
        self.owners.remove(&id);
    }

    /// What `lane` gets next, done at `value`, uses a resource. Adds to `waits` what that has to wait for, and answers the lane
    /// that it takes the resource over from, if the lane itself does not know it.
    pub(crate) fn touch(
        &mut self,
        (lane, value): (usize, u64),
        id: ResourceId,
        access: Access,
        waits: &mut Clock,
    ) -> Option<usize> {
        let owner = self.owners.entry(id).or_insert(Owner { lane, ..Owner::default() });
        let from = owner.lane;
        let knows = from == lane || owner.read[lane] > 0;
        if !knows {
            waits.raise(from, owner.written);
        }
        match access {
            Access::Read => owner.read[lane] = value,
            Access::Write => {
                waits.join(Clock(owner.read));
                *owner = Owner { lane, written: value, read: [0; LANES] };
            }
        }
        (!knows).then_some(from)
    }

    /// A lane gets something, done at `value`, that has to wait for `needed`. Answers the waits that do it: none for what the
    /// lane stands behind anyway, and none that another of them has made.
    pub(crate) fn send(&mut self, lane: usize, value: u64, mut needed: Clock) -> Clock {
        needed.clear(lane);
        for (other, wanted) in needed.values() {
            let waited = self.known[lane].at(other) >= wanted;
            let implied = |(third, at)| third != other && self.behind(third, at).at(other) >= wanted;
            if waited || needed.values().any(implied) {
                needed.clear(other);
            }
        }
        for (other, wanted) in needed.values() {
            let behind = self.behind(other, wanted);
            self.known[lane].join(behind);
            self.known[lane].raise(other, wanted);
        }
        self.known[lane].raise(lane, value);
        self.sent[lane].push_back((value, self.known[lane]));
        needed
    }

    /// The lanes are there: what was sent up to then is done, and waits for it cost nothing.
    pub(crate) fn reached(&mut self, values: &PerLane<u64>) {
        for (sent, value) in self.sent.iter_mut().zip(values) {
            let done = sent.partition_point(|(sent, _)| sent <= value);
            sent.drain(..done);
        }
    }

    /// The first value behind this one that the lane was sent.
    pub(crate) fn first_after(&self, lane: usize, value: u64) -> Option<u64> {
        let sent = &self.sent[lane];
        sent.get(sent.partition_point(|(sent, _)| *sent <= value)).map(|(sent, _)| *sent)
    }

    /// What a lane has done and waited for at a value, as far as that is still known.
    fn behind(&self, lane: usize, value: u64) -> Clock {
        let sent = &self.sent[lane];
        let place = sent.partition_point(|(sent, _)| *sent < value);
        sent.get(place).filter(|(sent, _)| *sent == value).map_or_else(Clock::default, |(_, clock)| *clock)
    }
}
