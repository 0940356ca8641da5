//! A naive model of several queues, by Vulkan's rules for semaphores, barriers and queue family ownership.
//!
//! It follows every access and every layout transition through all later submissions, on every queue. It does not use
//! timeline vectors, tracked states or owners.

use std::collections::BTreeMap;

use super::ownership::QUEUE_COUNT;
use super::queue_sync::{OwnershipTransfer, QueueCaps};
use crate::barrier::model::{Cell, Edge, ModelEvent, Wait, edges, may_follow};
use crate::barrier::{Layout, Stages, Use};

/// One submission with its waits, transfers and barriers.
#[derive(Debug, Clone)]
pub(super) struct SubmittedWork {
    pub(super) queue_index: usize,
    pub(super) value: u64,
    pub(super) waits: Vec<(usize, u64)>,
    pub(super) releases: Vec<OwnershipTransfer>,
    pub(super) acquires: Vec<OwnershipTransfer>,
    pub(super) events: Vec<ModelEvent>,
}

/// All submissions in order.
#[derive(Debug, Clone)]
pub(super) struct History {
    pub(super) queue_caps: [QueueCaps; QUEUE_COUNT],
    pub(super) sent: Vec<SubmittedWork>,
}

/// Effect of a submission on one cell, after its waits.
enum QueueCellStep {
    Barrier(Vec<Edge>),
    Access { touch: Use, accumulated: bool },
}

/// Progress of the waits for one access or transition, on each queue.
struct Reach {
    queue_index: usize,
    /// The first value of each queue whose signal follows the access.
    signalled: [Option<u64>; QUEUE_COUNT],
    /// Synchronisation state of each queue that has waited for the access.
    waits: [Option<Wait>; QUEUE_COUNT],
}

impl History {
    /// Returns the first violation of any rule, as text.
    pub(super) fn violation(&self, cells: &[Cell], exclusive: &dyn Fn(Cell) -> bool) -> Option<String> {
        self.wrong_wait().or_else(|| {
            cells.iter().find_map(|cell| {
                let wrong = self.wrong_layout(*cell).or_else(|| self.hazard(*cell));
                wrong.or_else(|| exclusive(*cell).then(|| self.wrong_owner(*cell)).flatten())
            })
        })
    }

    /// Finds a wait for later work or for the same queue. Without such waits no two queues can wait for each other.
    fn wrong_wait(&self) -> Option<String> {
        let mut last = [0; QUEUE_COUNT];
        for sent in &self.sent {
            for (queue_index, value) in &sent.waits {
                if *queue_index == sent.queue_index || *value > last[*queue_index] {
                    return Some(format!("{} waits for {value} of queue {queue_index}", sent.value));
                }
            }
            if sent.value <= last[sent.queue_index] {
                return Some(format!("{} comes after {}", sent.value, last[sent.queue_index]));
            }
            last[sent.queue_index] = sent.value;
        }
        None
    }

    fn wrong_layout(&self, cell: Cell) -> Option<String> {
        let mut layout = Layout::Undefined;
        for sent in &self.sent {
            for transfer in sent.releases.iter().chain(&sent.acquires) {
                if covers(transfer, cell) && transfer.layout != layout {
                    return Some(format!(
                        "{} moves {cell:?} in {:?}, not {layout:?}",
                        sent.value, transfer.layout
                    ));
                }
            }
            for step in self.steps(sent, cell) {
                match step {
                    QueueCellStep::Barrier(edges) => {
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
                    QueueCellStep::Access { touch, .. } => {
                        if touch.layout != Layout::Undefined && touch.layout != layout {
                            return Some(format!("{} uses {cell:?} in {layout:?}: {touch:?}", sent.value));
                        }
                    }
                }
            }
        }
        None
    }

    /// Finds an access or a transition that conflicts with a later one which has not waited for it.
    fn hazard(&self, cell: Cell) -> Option<String> {
        for (at, sent) in self.sent.iter().enumerate() {
            let steps = self.steps(sent, cell);
            for (place, step) in steps.iter().enumerate() {
                let (starts, accumulated): (Vec<Wait>, bool) = match step {
                    QueueCellStep::Access { touch, accumulated } => {
                        let of = |stage| Wait::for_access(stage, touch.access);
                        (touch.stages.iter().map(of).collect(), *accumulated)
                    }
                    QueueCellStep::Barrier(edges) => {
                        let moving = edges.iter().filter(|edge| edge.relayout.is_some());
                        (moving.map(Wait::for_transition).collect(), false)
                    }
                };
                let is_transition = matches!(step, QueueCellStep::Barrier(_));
                for start in starts {
                    let writes = is_transition || !start.written.is_empty();
                    let mut reach = Reach::new(sent.queue_index, sent.value, start);
                    let mut first = steps[place + 1..].iter();
                    let later = || self.sent[at + 1..].iter();
                    let wrong = first
                        .find_map(|step| reach.first_unordered(sent.queue_index, step, accumulated, writes));
                    let wrong = wrong.map(|what| (sent.value, what)).or_else(|| {
                        later().find_map(|next| {
                            reach.arrive(next);
                            let steps = self.steps(next, cell);
                            let mut wrong = steps.iter();
                            let wrong = wrong.find_map(|step| {
                                reach.first_unordered(next.queue_index, step, accumulated, writes)
                            });
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

    /// Finds a violation of the ownership rules. Images with contents are used by their owner, after the acquire. Both
    /// sides of a transfer match, and the acquire follows the release. The release follows all accesses by other queues
    /// of the owner.
    fn wrong_owner(&self, cell: Cell) -> Option<String> {
        let mut owner: Option<u32> = None;
        let mut moving: Option<(OwnershipTransfer, u64)> = None;
        let mut acquired: Option<(usize, u64)> = None;
        let mut uses = Vec::new();
        for (at, sent) in self.sent.iter().enumerate() {
            let domain = self.queue_caps[sent.queue_index].domain;
            let wrong = |what: &str| Some(format!("{cell:?} in {}: {what}", sent.value));
            for transfer in sent.acquires.iter().filter(|transfer| covers(transfer, cell)) {
                match moving.take() {
                    Some((part, value)) if part == *transfer && self.is_behind(at, part.from, value) => {
                        owner = Some(domain);
                        acquired = Some((sent.queue_index, sent.value));
                    }
                    _ => return wrong("acquired without a release that was waited for"),
                }
            }
            for step in self.steps(sent, cell) {
                let discards = matches!(&step, QueueCellStep::Barrier(edges)
                    if edges.iter().any(|edge| edge.relayout.is_some_and(|(old, _)| old == Layout::Undefined)));
                let matters = matches!(&step, QueueCellStep::Barrier(edges) if edges.iter().any(|edge| edge.relayout.is_some()))
                    || matches!(step, QueueCellStep::Access { .. });
                if discards {
                    (owner, acquired) = (Some(domain), None);
                }
                if matters && (moving.is_some() || owner.is_some_and(|owner| owner != domain)) {
                    return wrong("used by another than its owner");
                }
                if matters
                    && acquired.is_some_and(|(queue_index, value)| !self.is_behind(at, queue_index, value))
                {
                    return wrong("used beside the move to its owner");
                }
                uses.extend(matters.then_some((sent.queue_index, sent.value)));
            }
            for transfer in sent.releases.iter().filter(|transfer| covers(transfer, cell)) {
                let is_over = |(queue_index, value): (usize, u64)| {
                    queue_index == sent.queue_index || self.is_behind(at, queue_index, value)
                };
                if !uses.drain(..).all(is_over) {
                    return wrong("released while another queue uses it");
                }
                if owner != Some(domain) || moving.replace((*transfer, sent.value)).is_some() {
                    return wrong("released by another than its owner");
                }
            }
        }
        None
    }

    /// Returns true if the submission at index `at` has waited for a value of a queue, directly or indirectly.
    fn is_behind(&self, at: usize, queue_index: usize, value: u64) -> bool {
        let start = Wait::for_access(Stages::TRANSFER, crate::barrier::Access::empty());
        let mut reach = Reach::new(queue_index, value, start);
        let later =
            self.sent[..=at].iter().filter(|sent| sent.value > value || sent.queue_index != queue_index);
        later.for_each(|sent| reach.arrive(sent));
        reach.waits[self.sent[at].queue_index].is_some()
    }

    fn steps(&self, sent: &SubmittedWork, cell: Cell) -> Vec<QueueCellStep> {
        let mut steps = Vec::new();
        for event in &sent.events {
            match event {
                ModelEvent::Barriers(barriers) => steps.push(QueueCellStep::Barrier(edges(barriers, cell))),
                ModelEvent::Command(command) => {
                    let touching = command.iter().filter(|op| op.covers(cell));
                    steps.extend(
                        touching
                            .map(|op| QueueCellStep::Access { touch: op.touch, accumulated: op.accumulated }),
                    );
                }
            }
        }
        steps
    }
}

impl Reach {
    fn new(queue_index: usize, value: u64, start: Wait) -> Self {
        let mut reach =
            Self { queue_index, signalled: [None; QUEUE_COUNT], waits: [const { None }; QUEUE_COUNT] };
        reach.signalled[queue_index] = Some(value);
        reach.waits[queue_index] = Some(start);
        reach
    }

    /// Begins a later submission: its waits may make the access visible to its queue.
    fn arrive(&mut self, sent: &SubmittedWork) {
        let knows = |(queue_index, value): &(usize, u64)| {
            self.signalled[*queue_index].is_some_and(|first| first <= *value)
        };
        if !sent.waits.iter().any(knows) {
            return;
        }
        let start = self.waits[self.queue_index].as_ref().map(Wait::behind_semaphore);
        self.signalled[sent.queue_index].get_or_insert(sent.value);
        self.waits[sent.queue_index] = start;
    }

    /// Returns the violation by a later step on a queue, if there is one.
    fn first_unordered(
        &mut self,
        queue_index: usize,
        step: &QueueCellStep,
        independent: bool,
        writes: bool,
    ) -> Option<String> {
        match (step, &mut self.waits[queue_index]) {
            (QueueCellStep::Barrier(edges), None) => {
                let moves = edges.iter().any(|edge| edge.relayout.is_some());
                moves.then(|| "its transition is not ordered".to_owned())
            }
            (QueueCellStep::Barrier(edges), Some(wait)) => {
                let mut transitions = edges.iter().filter(|edge| edge.relayout.is_some());
                if transitions.any(|edge| !wait.allows_transition(edge)) {
                    return Some("its transition does not wait".to_owned());
                }
                wait.apply_edges(edges);
                None
            }
            (QueueCellStep::Access { accumulated: true, .. }, Some(_)) if independent => None,
            (QueueCellStep::Access { touch, .. }, None) => {
                (writes || touch.is_write()).then(|| format!("{touch:?} is not ordered"))
            }
            (QueueCellStep::Access { touch, .. }, Some(wait)) => {
                let late = touch.stages.iter().any(|stage| !may_follow(wait, writes, stage, touch.access));
                late.then(|| format!("{touch:?} does not wait"))
            }
        }
    }
}

fn covers(transfer: &OwnershipTransfer, cell: Cell) -> bool {
    let part = transfer.part;
    transfer.id == cell.id
        && (part.base_mip..part.base_mip + part.mip_count).contains(&cell.mip)
        && (part.base_layer..part.base_layer + part.layer_count).contains(&cell.layer)
}

/// Returns the stages of a submission's barriers that its queue does not support.
pub(super) fn external_stages(queue_caps: &[QueueCaps; QUEUE_COUNT], sent: &SubmittedWork) -> Stages {
    let mut stages = Stages::empty();
    for event in &sent.events {
        let ModelEvent::Barriers(barriers) = event else { continue };
        if let Some(memory) = barriers.memory {
            stages |= memory.src_stages | memory.dst_stages;
        }
        for image in &barriers.images {
            stages |= image.scopes.src_stages | image.scopes.dst_stages;
        }
    }
    stages - queue_caps[sent.queue_index].stages
}

/// Returns each history that waits a little less: without one wait, or for an earlier value of the queue.
pub(super) fn weaker(history: &History) -> Vec<(String, History)> {
    let mut all = Vec::new();
    let mut values: BTreeMap<usize, Vec<u64>> = BTreeMap::new();
    for (at, sent) in history.sent.iter().enumerate() {
        for (place, (queue_index, value)) in sent.waits.iter().enumerate() {
            let before = values.get(queue_index).into_iter().flatten().rev().find(|other| *other < value);
            let mut weaker = history.clone();
            match before {
                Some(before) => weaker.sent[at].waits[place].1 = *before,
                None => drop(weaker.sent[at].waits.remove(place)),
            }
            all.push((
                format!("{} waits for {value} of queue {queue_index} and need not", sent.value),
                weaker,
            ));
            let mut without = history.clone();
            without.sent[at].waits.remove(place);
            all.push((format!("{} waits for queue {queue_index} and need not", sent.value), without));
        }
        values.entry(sent.queue_index).or_default().push(sent.value);
    }
    all
}
