//! The control flow of a function: predecessors, dominators, and constructs that can stay as they are.

use std::collections::{HashMap, HashSet};

use ::spirv::Op;

use super::instruction::Inst;
use super::module::{Block, Function};

/// A selection or a loop whose code can stay in one piece.
#[derive(Debug, Clone)]
pub(super) struct Construct {
    /// Index of the merge block.
    pub(super) merge: usize,
    /// Indices of the other blocks behind the header, in the order of the function.
    pub(super) members: Vec<usize>,
}

/// The blocks of a function by index.
pub(super) struct ControlFlow {
    index: HashMap<u32, usize>,
    pub(super) successors: Vec<Vec<usize>>,
    pub(super) predecessors: Vec<Vec<usize>>,
    /// Immediate dominators; `None` for the first block and those that are never reached.
    dominators: Vec<Option<usize>>,
    reachable: Vec<bool>,
    /// Reachable blocks, each behind those that dominate it.
    pub(super) order: Vec<usize>,
}

impl ControlFlow {
    pub(super) fn new(function: &Function) -> Self {
        let blocks = &function.blocks;
        let index: HashMap<u32, usize> =
            blocks.iter().enumerate().map(|(at, block)| (block.label, at)).collect();
        let targets = |block: &Block| -> Vec<usize> {
            let labels = block.terminator().map(branch_targets).unwrap_or_default();
            labels.iter().filter_map(|label| index.get(label).copied()).collect()
        };
        let successors: Vec<Vec<usize>> = blocks.iter().map(targets).collect();
        let mut order = postorder(&successors);
        let mut reachable = vec![false; blocks.len()];
        order.iter().for_each(|block| reachable[*block] = true);
        let mut predecessors = vec![Vec::new(); blocks.len()];
        for (from, targets) in successors.iter().enumerate().filter(|(from, _)| reachable[*from]) {
            targets.iter().for_each(|to| predecessors[*to].push(from));
        }
        let dominators = immediate_dominators(&order, &predecessors);
        order.reverse();
        Self { index, successors, predecessors, dominators, reachable, order }
    }

    pub(super) fn index_of(&self, label: u32) -> Option<usize> {
        self.index.get(&label).copied()
    }

    pub(super) fn is_reachable(&self, block: usize) -> bool {
        self.reachable[block]
    }

    pub(super) fn dominates(&self, above: usize, below: usize) -> bool {
        let mut at = Some(below);
        while let Some(block) = at {
            if block == above {
                return true;
            }
            at = self.dominators[block];
        }
        false
    }

    /// Returns the outermost constructs that can stay in one piece, by the index of their header.
    ///
    /// `is_cut` is true for blocks at whose end the function is left and entered again.
    pub(super) fn whole_constructs(
        &self,
        function: &Function,
        is_cut: &dyn Fn(usize) -> bool,
    ) -> HashMap<usize, Construct> {
        let mut whole: HashMap<usize, Construct> = HashMap::new();
        for header in (0..function.blocks.len()).filter(|block| self.reachable[*block]) {
            if let Some(construct) = self.construct(function, header)
                && self.is_whole(function, header, &construct, is_cut)
            {
                whole.insert(header, construct);
            }
        }
        let inner: HashSet<usize> =
            whole.values().flat_map(|construct| construct.members.iter().copied()).collect();
        whole.retain(|header, _| !inner.contains(header));
        whole
    }

    /// True for a block of a loop or a selection.
    pub(super) fn is_in_construct(&self, function: &Function, block: usize) -> bool {
        let headers = (0..function.blocks.len()).filter(|header| self.reachable[*header]);
        let mut constructs = headers.filter_map(|header| self.construct(function, header));
        constructs.any(|construct| construct.members.contains(&block))
    }

    /// Returns the construct of a header.
    fn construct(&self, function: &Function, header: usize) -> Option<Construct> {
        let merge_inst = function.blocks[header].merge()?;
        let merge = self.index_of(merge_inst.operand(0))?;
        let is_member = |block: usize| {
            block != header
                && block != merge
                && self.reachable[block]
                && self.dominates(header, block)
                && !self.dominates(merge, block)
        };
        let mut members: Vec<usize> = (0..function.blocks.len()).filter(|block| is_member(*block)).collect();
        // Merge and continue blocks of the members stay even if they are never reached.
        let headers = members.clone().into_iter().chain([header]);
        let named: Vec<usize> = headers
            .filter_map(|block| function.blocks[block].merge())
            .flat_map(|inst| {
                let count = if inst.op == Op::LoopMerge { 2 } else { 1 };
                inst.operands.iter().take(count).filter_map(|label| self.index_of(*label)).collect::<Vec<_>>()
            })
            .filter(|block| !self.reachable[*block] && *block != merge)
            .collect();
        members.extend(named);
        members.sort_unstable();
        members.dedup();
        Some(Construct { merge, members })
    }

    /// True if the construct is entered at its header only, and left to its merge block only.
    fn is_whole(
        &self,
        function: &Function,
        header: usize,
        construct: &Construct,
        is_cut: &dyn Fn(usize) -> bool,
    ) -> bool {
        let inside: HashSet<usize> = construct.members.iter().copied().chain([header]).collect();
        let stays = |block: usize| {
            let last = function.blocks[block].terminator();
            let returns = last.is_none_or(|inst| matches!(inst.op, Op::Return | Op::ReturnValue));
            let mut targets = self.successors[block].iter();
            !returns && !is_cut(block) && targets.all(|to| *to == construct.merge || inside.contains(to))
        };
        let is_entered_once =
            |block: &usize| self.predecessors[*block].iter().all(|from| inside.contains(from));
        inside.iter().all(|block| stays(*block)) && construct.members.iter().all(is_entered_once)
    }
}

/// Returns the labels that a terminator may branch to.
pub(super) fn branch_targets(inst: &Inst) -> Vec<u32> {
    match inst.op {
        Op::Branch => vec![inst.operand(0)],
        Op::BranchConditional => vec![inst.operand(1), inst.operand(2)],
        // There are no literals of 64 bits: see `narrow_switches`.
        Op::Switch => {
            let cases = inst.operands.iter().skip(3).step_by(2).copied();
            std::iter::once(inst.operand(1)).chain(cases).collect()
        }
        _ => Vec::new(),
    }
}

/// Returns the blocks that are reached from the first, successors first.
fn postorder(successors: &[Vec<usize>]) -> Vec<usize> {
    let mut order = Vec::new();
    let mut seen = vec![false; successors.len()];
    let mut stack = Vec::new();
    if !successors.is_empty() {
        seen[0] = true;
        stack.push((0, 0));
    }
    while let Some((block, next)) = stack.pop() {
        match successors[block].get(next) {
            Some(to) => {
                stack.push((block, next + 1));
                if !seen[*to] {
                    seen[*to] = true;
                    stack.push((*to, 0));
                }
            }
            None => order.push(block),
        }
    }
    order
}

/// Computes immediate dominators by the iteration of Cooper, Harvey and Kennedy (A Simple, Fast Dominance Algorithm).
fn immediate_dominators(postorder: &[usize], predecessors: &[Vec<usize>]) -> Vec<Option<usize>> {
    let mut rank = vec![0; predecessors.len()];
    for (at, block) in postorder.iter().enumerate() {
        rank[*block] = at;
    }
    let mut found: Vec<Option<usize>> = vec![None; predecessors.len()];
    let mut is_known = vec![false; predecessors.len()];
    if let Some(known) = is_known.first_mut() {
        *known = true;
    }
    let mut has_changed = true;
    while has_changed {
        has_changed = false;
        for block in postorder.iter().rev().copied().filter(|block| *block != 0) {
            let mut known = predecessors[block].iter().copied().filter(|from| is_known[*from]);
            let Some(first) = known.next() else { continue };
            let common = known.fold(first, |a, b| common_dominator(a, b, &rank, &found));
            if found[block] != Some(common) {
                found[block] = Some(common);
                is_known[block] = true;
                has_changed = true;
            }
        }
    }
    found
}

fn common_dominator(mut a: usize, mut b: usize, rank: &[usize], found: &[Option<usize>]) -> usize {
    while a != b {
        let lower = if rank[a] < rank[b] { &mut a } else { &mut b };
        match found[*lower] {
            Some(above) => *lower = above,
            None => return 0,
        }
    }
    a
}
