//! A naive model of Vulkan's synchronisation rules, independent of tracked states and prefixes.
//!
//! It follows the barriers between every pair of conflicting accesses of a queue: the execution dependency
//! chains, the flushes, and the visibility.

use std::collections::BTreeSet;

use super::access::StageAccess;
use super::*;

/// One use of one resource by one command.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Op {
    pub(crate) id: ResourceId,
    /// `None` for buffers.
    pub(crate) texture: Option<(TextureShape, Subresources)>,
    pub(crate) touch: Use,
    /// True if it does not conflict with other accumulated writes.
    pub(crate) accumulated: bool,
}

impl Op {
    pub(crate) fn covers(&self, cell: Cell) -> bool {
        let inside = self.texture.is_none_or(|(_, range)| contains(range, cell));
        self.id == cell.id && inside
    }
}

/// One buffer, or one subresource of a texture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Cell {
    pub(crate) id: ResourceId,
    pub(crate) mip: u32,
    pub(crate) layer: u32,
}

/// The accesses of one command, at most one per resource.
pub(crate) type Command = Vec<Op>;

/// An event in the execution order of a queue.
#[derive(Debug, Clone)]
pub(crate) enum ModelEvent {
    Barriers(Barriers),
    Command(Command),
}

/// One dependency, reduced to one cell.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Edge {
    src_stages: Stages,
    src_access: Access,
    dst_stages: Stages,
    dst_access: Access,
    pub(crate) relayout: Option<(Layout, Layout)>,
}

fn contains(range: Subresources, cell: Cell) -> bool {
    (range.base_mip..range.base_mip + range.mip_count).contains(&cell.mip)
        && (range.base_layer..range.base_layer + range.layer_count).contains(&cell.layer)
}

/// Returns the dependencies that affect one cell.
pub(crate) fn edges(barriers: &Barriers, cell: Cell) -> Vec<Edge> {
    let memory = barriers.memory.iter().map(|m| Edge {
        src_stages: m.src_stages,
        src_access: m.src_access,
        dst_stages: m.dst_stages,
        dst_access: m.dst_access,
        relayout: None,
    });
    let of_cell = |image: &&ImageBarrier| image.id == cell.id && contains(image.subresources, cell);
    let images = barriers.images.iter().filter(of_cell).map(|image| Edge {
        src_stages: image.scopes.src_stages,
        src_access: image.scopes.src_access,
        dst_stages: image.scopes.dst_stages,
        dst_access: image.scopes.dst_access,
        relayout: Some((image.scopes.old_layout, image.scopes.new_layout)),
    });
    memory.chain(images).collect()
}

/// One event of a cell, in the order of the queue.
#[derive(Debug, Clone)]
enum CellStep {
    Barrier(Vec<Edge>),
    Access { touch: Use, accumulated: bool },
}

fn steps(log: &[ModelEvent], cell: Cell) -> Vec<CellStep> {
    let mut steps = Vec::new();
    for event in log {
        match event {
            ModelEvent::Barriers(barriers) => steps.push(CellStep::Barrier(edges(barriers, cell))),
            ModelEvent::Command(command) => {
                let touching = command.iter().filter(|op| op.covers(cell));
                steps.extend(
                    touching.map(|op| CellStep::Access { touch: op.touch, accumulated: op.accumulated }),
                );
            }
        }
    }
    steps
}

/// Synchronisation state of one earlier access at one of its stages.
#[derive(Debug, Clone)]
pub(crate) struct Wait {
    origin: Stages,
    /// Accesses that wrote; each stage has only one kind of write.
    pub(crate) written: Access,
    /// Stages that start after the access.
    chain: Stages,
    /// Stages that start after its writes were flushed.
    flushed: Stages,
    visible: StageAccess,
}

impl Wait {
    pub(crate) fn for_access(origin: Stages, access: Access) -> Self {
        Self {
            origin,
            written: access & origin.possible_access() & Access::WRITES,
            chain: Stages::empty(),
            flushed: Stages::empty(),
            visible: StageAccess::default(),
        }
    }

    /// Returns the state after a semaphore. All later stages wait for it, and all earlier writes are visible
    /// to them.
    pub(crate) fn behind_semaphore(&self) -> Self {
        let mut wait = self.clone();
        wait.chain = Stages::all();
        wait.flushed = Stages::all();
        wait.visible.insert(Use { stages: Stages::all(), access: Access::all(), layout: Layout::Undefined });
        wait
    }

    /// Returns the state of a layout transition, which is flushed by its own barrier.
    pub(crate) fn for_transition(edge: &Edge) -> Self {
        let mut wait = Self::for_access(Stages::empty(), Access::empty());
        wait.chain = edge.dst_stages;
        wait.apply_edge(edge);
        wait
    }

    fn apply_edge(&mut self, edge: &Edge) {
        self.flushed |= edge.dst_stages;
        self.visible.insert(Use {
            stages: edge.dst_stages,
            access: edge.dst_access,
            layout: Layout::Undefined,
        });
    }

    pub(crate) fn is_waited_by(&self, edge: &Edge) -> bool {
        edge.src_stages.intersects(self.origin | self.chain)
    }

    fn is_flushed_by(&self, edge: &Edge) -> bool {
        let here = edge.src_stages.intersects(self.origin) && edge.src_access.contains(self.written);
        here || edge.src_stages.intersects(self.flushed)
    }

    /// Applies the barriers of one batch. They are concurrent and do not chain with each other.
    pub(crate) fn apply_edges(&mut self, edges: &[Edge]) {
        let before = self.clone();
        for edge in edges.iter().filter(|edge| before.is_waited_by(edge)) {
            self.chain |= edge.dst_stages;
            if before.is_flushed_by(edge) {
                self.apply_edge(edge);
            }
        }
    }

    /// True if a layout transition may follow.
    pub(crate) fn allows_transition(&self, edge: &Edge) -> bool {
        self.is_waited_by(edge) && (self.written.is_empty() || self.is_flushed_by(edge))
    }

    /// True if an access at `stage` may follow that does not read the values.
    fn ordered_before(&self, stage: Stages) -> bool {
        self.chain.contains(stage)
    }

    fn visible_to(&self, stage: Stages, access: Access) -> bool {
        let wanted = access & stage.possible_access();
        self.flushed.contains(stage) && self.visible.at(stage).contains(wanted)
    }
}

/// Returns the first violation of Vulkan's rules in the events of one cell.
fn violation(steps: &[CellStep]) -> Option<String> {
    wrong_layout(steps).or_else(|| (0..steps.len()).find_map(|at| violation_after(steps, at)))
}

fn wrong_layout(steps: &[CellStep]) -> Option<String> {
    let mut layout = Layout::Undefined;
    for (at, step) in steps.iter().enumerate() {
        match step {
            CellStep::Barrier(edges) => {
                for (old, new) in edges.iter().filter_map(|edge| edge.relayout) {
                    if old != layout || old == new {
                        return Some(format!("{at}: transition {old:?} to {new:?} finds {layout:?}"));
                    }
                    layout = new;
                }
            }
            CellStep::Access { touch, .. } if touch.layout != Layout::Undefined && touch.layout != layout => {
                return Some(format!("{at}: {touch:?} finds {layout:?}"));
            }
            CellStep::Access { .. } => {}
        }
    }
    None
}

fn violation_after(steps: &[CellStep], at: usize) -> Option<String> {
    match &steps[at] {
        CellStep::Access { touch, accumulated } => touch.stages.iter().find_map(|origin| {
            let wait = Wait::for_access(origin, touch.access);
            let writes = !wait.written.is_empty();
            first_unordered(&steps[at + 1..], wait, *accumulated, writes)
                .map(|later| format!("{touch:?} at {at} conflicts with {}", at + 1 + later))
        }),
        CellStep::Barrier(edges) => edges.iter().filter(|edge| edge.relayout.is_some()).find_map(|edge| {
            first_unordered(&steps[at + 1..], Wait::for_transition(edge), false, true)
                .map(|later| format!("transition at {at} conflicts with {}", at + 1 + later))
        }),
    }
}

fn first_unordered(steps: &[CellStep], mut wait: Wait, independent: bool, writes: bool) -> Option<usize> {
    for (at, step) in steps.iter().enumerate() {
        match step {
            CellStep::Barrier(edges) => {
                let mut transitions = edges.iter().filter(|edge| edge.relayout.is_some());
                if transitions.any(|edge| !wait.allows_transition(edge)) {
                    return Some(at);
                }
                wait.apply_edges(edges);
            }
            CellStep::Access { accumulated: true, .. } if independent => {}
            CellStep::Access { touch, .. } => {
                if touch.stages.iter().any(|stage| !may_follow(&wait, writes, stage, touch.access)) {
                    return Some(at);
                }
            }
        }
    }
    None
}

pub(crate) fn may_follow(wait: &Wait, earlier_writes: bool, stage: Stages, access: Access) -> bool {
    let later_writes = access.intersects(stage.possible_access() & Access::WRITES);
    if earlier_writes {
        wait.ordered_before(stage) && wait.visible_to(stage, access)
    } else {
        !later_writes || wait.ordered_before(stage)
    }
}

fn cells_of(log: &[ModelEvent]) -> Vec<Cell> {
    let mut cells = BTreeSet::new();
    let commands = log.iter().filter_map(|event| match event {
        ModelEvent::Command(command) => Some(command),
        ModelEvent::Barriers(_) => None,
    });
    for op in commands.flatten() {
        let shape = op.texture.map_or(TextureShape { mips: 1, layers: 1 }, |(shape, _)| shape);
        for layer in 0..shape.layers {
            for mip in 0..shape.mips {
                cells.insert(Cell { id: op.id, mip, layer });
            }
        }
    }
    cells.into_iter().collect()
}

/// Returns the first violation in a queue's log, with the events of the affected cell.
pub(crate) fn any_violation(log: &[ModelEvent]) -> Option<String> {
    cells_of(log).into_iter().find_map(|cell| {
        violation(&steps(log, cell)).map(|what| format!("{cell:?}: {what}\n{:#?}", steps(log, cell)))
    })
}
