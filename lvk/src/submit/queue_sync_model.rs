//! A naive model of several queues: who may do what when, by Vulkan's rules for semaphores, barriers and owners.
//!
//! It follows every access and every layout transition through all that is submitted later, on every lane, and knows nothing
//! of clocks, states and who had what.

use std::collections::BTreeMap;

use super::ownership::LANES;
use super::queue_sync::{MovedPart, Site};
use crate::barrier::model::{Cell, Edge, Event, Wait, edges, may_follow};
use crate::barrier::{Layout, Stages, Use};

/// One submission with what stands in front of it.
#[derive(Debug, Clone)]
pub(super) struct Sent {
    pub(super) lane: usize,
    pub(super) value: u64,
    pub(super) waits: Vec<(usize, u64)>,
    pub(super) releases: Vec<MovedPart>,
    pub(super) acquires: Vec<MovedPart>,
    pub(super) events: Vec<Event>,
}

/// Everything that was submitted, in this order.
#[derive(Debug, Clone)]
pub(super) struct History {
    pub(super) sites: [Site; LANES],
    pub(super) sent: Vec<Sent>,
}

/// What happens to one cell in a submission, after its waits.
enum Step {
    Barrier(Vec<Edge>),
    Access { touch: Use, accumulated: bool },
}

/// How far something that happened has been waited for on each lane.
struct Reach {
    lane: usize,
    /// The first value of each lane behind which it has happened.
    signalled: [Option<u64>; LANES],
    /// How lanes that have waited for it stand to it.
    waits: [Option<Wait>; LANES],
}

impl History {
    /// The first violation of any rule, in words.
    pub(super) fn violation(&self, cells: &[Cell], exclusive: &dyn Fn(Cell) -> bool) -> Option<String> {
        self.wrong_wait().or_else(|| {
            cells.iter().find_map(|cell| {
                let wrong = self.wrong_layout(*cell).or_else(|| self.hazard(*cell));
                wrong.or_else(|| exclusive(*cell).then(|| self.wrong_owner(*cell)).flatten())
            })
        })
    }

    /// Waits are for what was submitted before, on other lanes: so no two lanes wait for each other.
    fn wrong_wait(&self) -> Option<String> {
        let mut last = [0; LANES];
        for sent in &self.sent {
            for (lane, value) in &sent.waits {
                if *lane == sent.lane || *value > last[*lane] {
                    return Some(format!("{} waits for {value} of lane {lane}", sent.value));
                }
            }
            if sent.value <= last[sent.lane] {
                return Some(format!("{} comes after {}", sent.value, last[sent.lane]));
            }
            last[sent.lane] = sent.value;
        }
        None
    }

    fn wrong_layout(&self, cell: Cell) -> Option<String> {
        let mut layout = Layout::Undefined;
        for sent in &self.sent {
            for moved in sent.releases.iter().chain(&sent.acquires) {
                if covers(moved, cell) && moved.layout != layout {
                    return Some(format!(
                        "{} moves {cell:?} in {:?}, not {layout:?}",
                        sent.value, moved.layout
                    ));
                }
            }
            for step in self.steps(sent, cell) {
                match step {
                    Step::Barrier(edges) => {
                        for (old, new) in edges.iter().filter_map(|edge| edge.relayout) {
                            if old != layout || old == new {
                                return Some(format!(
                                    "{} takes {cell:?} from {old:?}, not {layout:?}",
                                    sent.value
                                ));
                            }
                            layout = new;
                        }
                    }
                    Step::Access { touch, .. } => {
                        if touch.layout != Layout::Undefined && touch.layout != layout {
                            return Some(format!("{} uses {cell:?} in {layout:?}: {touch:?}", sent.value));
                        }
                    }
                }
            }
        }
        None
    }

    /// An access or a transition that something later conflicts with and has not waited for.
    fn hazard(&self, cell: Cell) -> Option<String> {
        for (at, sent) in self.sent.iter().enumerate() {
            let steps = self.steps(sent, cell);
            for (place, step) in steps.iter().enumerate() {
                let (starts, accumulated): (Vec<Wait>, bool) = match step {
                    Step::Access { touch, accumulated } => {
                        let of = |stage| Wait::for_access(stage, touch.access);
                        (touch.stages.iter().map(of).collect(), *accumulated)
                    }
                    Step::Barrier(edges) => {
                        let moving = edges.iter().filter(|edge| edge.relayout.is_some());
                        (moving.map(Wait::for_transition).collect(), false)
                    }
                };
                let is_transition = matches!(step, Step::Barrier(_));
                for start in starts {
                    let writes = is_transition || !start.written.is_empty();
                    let mut reach = Reach::new(sent.lane, sent.value, start);
                    let mut first = steps[place + 1..].iter();
                    let later = || self.sent[at + 1..].iter();
                    let wrong = first.find_map(|step| reach.meet(sent.lane, step, accumulated, writes));
                    let wrong = wrong.map(|what| (sent.value, what)).or_else(|| {
                        later().find_map(|next| {
                            reach.arrive(next);
                            let steps = self.steps(next, cell);
                            let mut wrong = steps.iter();
                            let wrong =
                                wrong.find_map(|step| reach.meet(next.lane, step, accumulated, writes));
                            wrong.map(|what| (next.value, what))
                        })
                    });
                    if let Some((value, what)) = wrong {
                        return Some(format!(
                            "{cell:?}: what {} does is not waited for by {value}: {what}",
                            sent.value
                        ));
                    }
                }
            }
        }
        None
    }

    /// Images that have contents are used by their owner, behind the move that made it so, and both sides of a move match, the
    /// second behind the first, which is behind what other queues of the owner have done.
    fn wrong_owner(&self, cell: Cell) -> Option<String> {
        let mut owner: Option<u32> = None;
        let mut moving: Option<(MovedPart, u64)> = None;
        let mut acquired: Option<(usize, u64)> = None;
        let mut uses = Vec::new();
        for (at, sent) in self.sent.iter().enumerate() {
            let domain = self.sites[sent.lane].domain;
            let wrong = |what: &str| Some(format!("{cell:?} in {}: {what}", sent.value));
            for moved in sent.acquires.iter().filter(|moved| covers(moved, cell)) {
                match moving.take() {
                    Some((part, value)) if part == *moved && self.is_behind(at, part.from, value) => {
                        owner = Some(domain);
                        acquired = Some((sent.lane, sent.value));
                    }
                    _ => return wrong("acquired without a release that was waited for"),
                }
            }
            for step in self.steps(sent, cell) {
                let discards = matches!(&step, Step::Barrier(edges)
                    if edges.iter().any(|edge| edge.relayout.is_some_and(|(old, _)| old == Layout::Undefined)));
                let matters = matches!(&step, Step::Barrier(edges) if edges.iter().any(|edge| edge.relayout.is_some()))
                    || matches!(step, Step::Access { .. });
                if discards {
                    (owner, acquired) = (Some(domain), None);
                }
                if matters && (moving.is_some() || owner.is_some_and(|owner| owner != domain)) {
                    return wrong("used by another than its owner");
                }
                if matters && acquired.is_some_and(|(lane, value)| !self.is_behind(at, lane, value)) {
                    return wrong("used beside the move to its owner");
                }
                uses.extend(matters.then_some((sent.lane, sent.value)));
            }
            for moved in sent.releases.iter().filter(|moved| covers(moved, cell)) {
                let is_over =
                    |(lane, value): (usize, u64)| lane == sent.lane || self.is_behind(at, lane, value);
                if !uses.drain(..).all(is_over) {
                    return wrong("released while another queue uses it");
                }
                if owner != Some(domain) || moving.replace((*moved, sent.value)).is_some() {
                    return wrong("released by another than its owner");
                }
            }
        }
        None
    }

    /// Whether the submission at this place has waited for a value of a lane, itself or by others.
    fn is_behind(&self, at: usize, lane: usize, value: u64) -> bool {
        let start = Wait::for_access(Stages::TRANSFER, crate::barrier::Access::empty());
        let mut reach = Reach::new(lane, value, start);
        let later = self.sent[..=at].iter().filter(|sent| sent.value > value || sent.lane != lane);
        later.for_each(|sent| reach.arrive(sent));
        reach.waits[self.sent[at].lane].is_some()
    }

    fn steps(&self, sent: &Sent, cell: Cell) -> Vec<Step> {
        let mut steps = Vec::new();
        for event in &sent.events {
            match event {
                Event::Barriers(barriers) => steps.push(Step::Barrier(edges(barriers, cell))),
                Event::Command(command) => {
                    let touching = command.iter().filter(|op| op.covers(cell));
                    steps.extend(
                        touching.map(|op| Step::Access { touch: op.touch, accumulated: op.accumulated }),
                    );
                }
            }
        }
        steps
    }
}

impl Reach {
    fn new(lane: usize, value: u64, start: Wait) -> Self {
        let mut reach = Self { lane, signalled: [None; LANES], waits: [const { None }; LANES] };
        reach.signalled[lane] = Some(value);
        reach.waits[lane] = Some(start);
        reach
    }

    /// A later submission begins: its waits may bring word of what happened to its lane.
    fn arrive(&mut self, sent: &Sent) {
        let knows = |(lane, value): &(usize, u64)| self.signalled[*lane].is_some_and(|first| first <= *value);
        if !sent.waits.iter().any(knows) {
            return;
        }
        let start = self.waits[self.lane].as_ref().map(Wait::behind_semaphore);
        self.signalled[sent.lane].get_or_insert(sent.value);
        self.waits[sent.lane] = start;
    }

    /// What is wrong with a later step on a lane.
    fn meet(&mut self, lane: usize, step: &Step, independent: bool, writes: bool) -> Option<String> {
        match (step, &mut self.waits[lane]) {
            (Step::Barrier(edges), None) => {
                let moves = edges.iter().any(|edge| edge.relayout.is_some());
                moves.then(|| "its transition is not ordered".to_owned())
            }
            (Step::Barrier(edges), Some(wait)) => {
                let mut transitions = edges.iter().filter(|edge| edge.relayout.is_some());
                if transitions.any(|edge| !wait.allows_transition(edge)) {
                    return Some("its transition does not wait".to_owned());
                }
                wait.pass(edges);
                None
            }
            (Step::Access { accumulated: true, .. }, Some(_)) if independent => None,
            (Step::Access { touch, .. }, None) => {
                (writes || touch.is_write()).then(|| format!("{touch:?} is not ordered"))
            }
            (Step::Access { touch, .. }, Some(wait)) => {
                let late = touch.stages.iter().any(|stage| !may_follow(wait, writes, stage, touch.access));
                late.then(|| format!("{touch:?} does not wait"))
            }
        }
    }
}

fn covers(moved: &MovedPart, cell: Cell) -> bool {
    let part = moved.part;
    moved.id == cell.id
        && (part.base_mip..part.base_mip + part.mip_count).contains(&cell.mip)
        && (part.base_layer..part.base_layer + part.layer_count).contains(&cell.layer)
}

/// The stages of the barriers of a submission that its lane does not have.
pub(super) fn foreign_stages(sites: &[Site; LANES], sent: &Sent) -> Stages {
    let mut stages = Stages::empty();
    for event in &sent.events {
        let Event::Barriers(barriers) = event else { continue };
        if let Some(memory) = barriers.memory {
            stages |= memory.src_stages | memory.dst_stages;
        }
        for image in &barriers.images {
            stages |= image.scopes.src_stages | image.scopes.dst_stages;
        }
    }
    stages - sites[sent.lane].stages
}

/// Each history that waits a little less: without one wait, or for what the lane did before.
pub(super) fn weaker(history: &History) -> Vec<(String, History)> {
    let mut all = Vec::new();
    let mut values: BTreeMap<usize, Vec<u64>> = BTreeMap::new();
    for (at, sent) in history.sent.iter().enumerate() {
        for (place, (lane, value)) in sent.waits.iter().enumerate() {
            let before = values.get(lane).into_iter().flatten().rev().find(|other| *other < value);
            let mut weaker = history.clone();
            match before {
                Some(before) => weaker.sent[at].waits[place].1 = *before,
                None => drop(weaker.sent[at].waits.remove(place)),
            }
            all.push((format!("{} waits for {value} of lane {lane} and need not", sent.value), weaker));
            let mut without = history.clone();
            without.sent[at].waits.remove(place);
            all.push((format!("{} waits for lane {lane} and need not", sent.value), without));
        }
        values.entry(sent.lane).or_default().push(sent.value);
    }
    all
}
