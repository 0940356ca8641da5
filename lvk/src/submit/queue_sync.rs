//! Command buffers on several lanes: which barriers, waits and changes of owner stand in front of each. Decisions only.

use super::ownership::{Access, Clock, LANES, Ownership, PerLane};
use crate::barrier::{
    Barriers, Layout, ResourceId, Stages, States, Subresources, TextureShape, Tracker, Used,
};

/// What the device has for a lane.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Site {
    /// Lanes of one domain own images together: a family of queues.
    pub(crate) domain: u32,
    /// What its command buffers can do.
    pub(crate) stages: Stages,
}

/// The state of all resources on every lane.
///
/// As long as only lane 0 is used nothing else is kept but its states.
pub(crate) struct Lanes {
    states: PerLane<States>,
    sites: PerLane<Site>,
    ownership: Ownership,
    /// Whether another lane than the first was ever wanted.
    several: bool,
    /// Whether there is another one.
    has_several: bool,
    sent: u64,
    last: PerLane<u64>,
    /// The last of lane 0 before lanes were kept apart.
    alone: u64,
    /// The last of lane 0 that everybody relies on.
    prelude: u64,
}

/// What a command buffer needs in front of it.
#[derive(Debug, Default)]
pub(crate) struct Step {
    /// To be submitted before, each by itself.
    pub(crate) departures: Vec<Departure>,
    /// What the lane signals behind the command buffer.
    pub(crate) value: u64,
    pub(crate) waits: Clock,
    /// What the lane takes from other domains, the other side of the departures.
    pub(crate) arrivals: Vec<MovedPart>,
    pub(crate) barriers: Barriers,
}

/// A submission by which a lane gives images to another domain.
#[derive(Debug)]
pub(crate) struct Departure {
    pub(crate) lane: usize,
    pub(crate) value: u64,
    pub(crate) waits: Clock,
    pub(crate) parts: Vec<MovedPart>,
}

/// A part of an image that changes its owner, and keeps its layout.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct MovedPart {
    pub(crate) id: ResourceId,
    pub(crate) part: Subresources,
    pub(crate) layout: Layout,
    pub(crate) from: usize,
    pub(crate) to: usize,
}

/// A command buffer on its way to a lane.
pub(crate) struct Sent<'a> {
    pub(crate) lane: usize,
    pub(crate) tracker: &'a Tracker,
    /// What it uses that needs no barriers within a lane.
    pub(crate) references: &'a [(ResourceId, Access)],
    /// What else it waits for.
    pub(crate) after: Clock,
    /// Whether all that is sent later, on lanes that run shaders, relies on it.
    pub(crate) is_prelude: bool,
    /// Whether it waits for others than the lanes, or others wait for it: what it uses may have been written by them, or will be.
    pub(crate) exchanges: bool,
}

impl Lanes {
    pub(crate) fn new(sites: PerLane<Site>, has_several: bool) -> Self {
        Self {
            states: Default::default(),
            sites,
            ownership: Ownership::default(),
            several: false,
            has_several,
            sent: 0,
            last: [0; LANES],
            alone: 0,
            prelude: 0,
        }
    }

    /// Which lane a value is of.
    pub(crate) fn lane_of(value: u64, has_several: bool) -> usize {
        if has_several { (value % LANES as u64) as usize } else { 0 }
    }

    /// Begins to keep the lanes apart. What lane 0 has used so far is taken for used until now.
    pub(crate) fn begin_several(&mut self) {
        if std::mem::replace(&mut self.several, true) {
            return;
        }
        let ids: Vec<_> = self.states[0].ids().collect();
        ids.into_iter().for_each(|id| self.ownership.claim(id, 0, self.last[0]));
        self.alone = self.last[0];
        self.prelude = self.last[0];
    }

    /// Whether lanes are kept apart.
    pub(crate) fn are_several(&self) -> bool {
        self.several
    }

    /// The value for what `lane` gets next. Values rise over all lanes, and each lane has its own.
    pub(crate) fn next_value(&mut self, lane: usize) -> u64 {
        self.sent += 1;
        if self.has_several { self.sent * LANES as u64 + lane as u64 } else { self.sent }
    }

    /// What signals this value went to the lane: from now on it may be waited for. A value whose submission failed never comes.
    pub(crate) fn submitted(&mut self, lane: usize, value: u64) {
        self.last[lane] = value;
    }

    /// The last value of each lane that will come.
    pub(crate) fn last(&self) -> &PerLane<u64> {
        &self.last
    }

    /// How many values there were.
    #[cfg(any(test, feature = "test-hooks"))]
    pub(crate) fn sent(&self) -> u64 {
        self.sent
    }

    /// Up to which value everything is done, with the lanes as far as `completed`: to right before the first that is not.
    pub(crate) fn passed(&self, completed: &PerLane<u64>) -> u64 {
        let newest = self.last.iter().copied().max().unwrap_or_default();
        let busy = (0..LANES).filter(|lane| completed[*lane] < self.last[*lane]);
        busy.map(|lane| self.first_after(lane, completed[lane]) - 1).min().unwrap_or(newest)
    }

    /// The first value of a busy lane behind one that it has reached; no value is noted as long as lanes are not kept apart.
    fn first_after(&self, lane: usize, completed: u64) -> u64 {
        let noted = self.several && (lane != 0 || completed >= self.alone);
        let first = if noted { self.ownership.first_after(lane, completed) } else { None };
        first.unwrap_or(completed + 1)
    }

    /// The states of lane 0, as long as it is the only one, or for what no other lane has.
    pub(crate) fn first_states(&mut self) -> &mut States {
        &mut self.states[0]
    }

    /// Appends a command buffer to lane 0, as long as that is the only one.
    pub(crate) fn submit_alone(&mut self, tracker: &Tracker) -> Barriers {
        self.states[0].submit(tracker)
    }

    /// Appends a command buffer to a lane. `is_exclusive` tells which resources belong to one domain at a time.
    pub(crate) fn submit(&mut self, sent: &Sent<'_>, is_exclusive: impl Fn(ResourceId) -> bool) -> Step {
        let lane = sent.lane;
        let (departures, arrivals) = self.depart(lane, sent.tracker, is_exclusive);
        let value = self.next_value(lane);
        let mut waits = sent.after;
        for used in sent.tracker.used() {
            let given = sent.exchanges || sent.references.contains(&(used.id, Access::Write));
            let writes = given || arrivals.iter().any(|moved| moved.id == used.id);
            self.touch((lane, value), used, writes, &mut waits);
        }
        for (id, access) in sent.references {
            if !sent.tracker.uses(*id) {
                self.ownership.touch((lane, value), *id, *access, &mut waits);
            }
        }
        if lane != 0 && self.sites[lane].stages.intersects(Stages::SHADERS) {
            waits.raise(0, self.prelude);
        }
        if sent.is_prelude {
            self.prelude = value;
        }
        let waits = self.ownership.send(lane, value, waits);
        let barriers = self.states[lane].submit(sent.tracker);
        Step { departures, value, waits, arrivals, barriers }
    }

    /// The command buffer uses a resource: what it waits for, and what the lane knows of the resource from now on. What it
    /// `writes` changes for others, whether its commands change it or not.
    fn touch(&mut self, at: (usize, u64), used: Used<'_>, writes: bool, waits: &mut Clock) {
        let owner = self.ownership.owner(used.id);
        let before = owner.and_then(|owner| self.states[owner].layouts(used.id));
        let writes = writes || used.changes(before.as_ref());
        let access = if writes { Access::Write } else { Access::Read };
        if self.ownership.touch(at, used.id, access, waits).is_some() {
            let lane = at.0;
            self.states[lane].take_over(used, before.as_ref(), self.sites[lane].stages - Stages::HOST);
        }
    }

    /// Has other domains give away what they have and `lane` is to use: one submission for each lane that has any.
    fn depart(
        &mut self,
        lane: usize,
        tracker: &Tracker,
        is_exclusive: impl Fn(ResourceId) -> bool,
    ) -> (Vec<Departure>, Vec<MovedPart>) {
        let domain = self.sites[lane].domain;
        let mut moved = Vec::new();
        for used in tracker.used() {
            let Some(from) = self.ownership.owner(used.id) else { continue };
            if self.sites[from].domain == domain || !is_exclusive(used.id) {
                continue;
            }
            let parts = self.states[from].layouts(used.id).map(|layouts| layouts.runs()).unwrap_or_default();
            // What was never written has nothing to be moved.
            let parts = parts.into_iter().filter(|(_, layout)| *layout != Layout::Undefined);
            moved.extend(parts.map(|(part, layout)| MovedPart { id: used.id, part, layout, from, to: lane }));
        }
        let from = |lane| moved.iter().filter(move |part| part.from == lane).copied().collect::<Vec<_>>();
        let parts: PerLane<Vec<_>> = [from(0), from(1), from(2)];
        let leaving = parts.into_iter().enumerate().filter(|(_, parts)| !parts.is_empty());
        let departures = leaving.map(|(from, parts)| self.depart_from(from, parts)).collect();
        (departures, moved)
    }

    /// The lane waits for those of its domain who read what leaves.
    fn depart_from(&mut self, lane: usize, parts: Vec<MovedPart>) -> Departure {
        let value = self.next_value(lane);
        let mut waits = Clock::default();
        for moved in &parts {
            self.ownership.touch((lane, value), moved.id, Access::Write, &mut waits);
        }
        let waits = self.ownership.send(lane, value, waits);
        Departure { lane, value, waits, parts }
    }

    /// Lane 0 signals something that has no command buffer.
    pub(crate) fn signal(&mut self) -> u64 {
        let value = self.next_value(0);
        if self.several {
            self.ownership.send(0, value, Clock::default());
        }
        value
    }

    /// An image of somebody else's is in this layout now, and belongs to lane 0.
    pub(crate) fn import(&mut self, id: ResourceId, shape: TextureShape, layout: Layout) {
        self.states[0].imported(id, shape, layout);
        if self.several {
            self.ownership.claim(id, 0, 0);
        }
    }

    /// The host has written a new image, which is ready to be sampled, and belongs to lane 0.
    pub(crate) fn fill(&mut self, id: ResourceId, shape: TextureShape) {
        self.states[0].filled(id, shape);
        if self.several {
            self.ownership.claim(id, 0, 0);
        }
    }

    /// The lanes are there.
    pub(crate) fn reached(&mut self, completed: &PerLane<u64>) {
        if self.several {
            self.ownership.reached(completed);
        }
    }

    /// Forgets a destroyed resource.
    pub(crate) fn forget(&mut self, id: ResourceId) {
        if !self.several {
            return self.states[0].forget(id);
        }
        self.states.iter_mut().for_each(|states| states.forget(id));
        self.ownership.forget(id);
    }
}
