//! Variables whose values a function reads in a block or after it.

use std::collections::{HashMap, HashSet};

use ::spirv::Op;

use super::control_flow::ControlFlow;
use super::instruction::{Inst, used_beside_pointer, used_ids};
use super::linker::Linker;
use super::module::Function;

/// Returns, for each block, those of `variables` that may be read in it or behind it before they are written.
pub(super) fn live_at_starts(
    linker: &Linker,
    function: &Function,
    flow: &ControlFlow,
    variables: &HashSet<u32>,
) -> Vec<HashSet<u32>> {
    let mentions = mentioned_by_functions(linker, variables);
    let effects: Vec<Effects> = function
        .blocks
        .iter()
        .map(|block| Effects::collect(linker, &block.code, variables, &mentions))
        .collect();
    let mut at_start: Vec<HashSet<u32>> = vec![HashSet::new(); effects.len()];
    let mut has_changed = true;
    while has_changed {
        has_changed = false;
        for block in flow.order.iter().rev().copied() {
            let behind = flow.successors[block].iter().flat_map(|to| at_start[*to].iter().copied());
            let kept = behind.filter(|variable| !effects[block].written.contains(variable));
            let now: HashSet<u32> = effects[block].read.iter().copied().chain(kept).collect();
            has_changed |= now != at_start[block];
            at_start[block] = now;
        }
    }
    at_start
}

/// Variables that a block reads before it writes them, and those that it writes as a whole.
struct Effects {
    read: HashSet<u32>,
    written: HashSet<u32>,
}

impl Effects {
    fn collect(
        linker: &Linker,
        code: &[Inst],
        variables: &HashSet<u32>,
        mentions: &HashMap<u32, HashSet<u32>>,
    ) -> Self {
        let mut found = Self { read: HashSet::new(), written: HashSet::new() };
        // Pointers into variables, with the variables. Pointers do not leave their block.
        let mut parts: HashMap<u32, u32> = HashMap::new();
        for inst in code.iter().filter(|inst| inst.op != Op::Variable) {
            let root = |id: u32| parts.get(&id).copied().unwrap_or(id);
            let mut used = used_ids(inst, &linker.module.wide);
            let mut whole = None;
            match inst.op {
                Op::AccessChain | Op::InBoundsAccessChain => {
                    let base = root(inst.operand(2));
                    if variables.contains(&base) {
                        parts.insert(inst.operand(1), base);
                        used.retain(|id| *id != inst.operand(2));
                    }
                }
                // A write of a part reads nothing, and leaves the other parts.
                Op::Store => {
                    used = used_beside_pointer(inst, &linker.module.wide);
                    whole = Some(inst.operand(0)).filter(|id| variables.contains(id));
                }
                Op::RayQueryInitializeKHR => {
                    used.retain(|id| *id != inst.operand(0));
                    whole = Some(inst.operand(0)).filter(|id| variables.contains(id));
                }
                Op::FunctionCall => used.extend(mentions.get(&inst.operand(2)).into_iter().flatten()),
                _ => {}
            }
            let read: Vec<u32> = used.into_iter().map(|id| parts.get(&id).copied().unwrap_or(id)).collect();
            let is_read = |id: &u32| variables.contains(id) && !found.written.contains(id);
            let read: Vec<u32> = read.into_iter().filter(is_read).collect();
            found.read.extend(read);
            found.written.extend(whole);
        }
        found
    }
}

/// Returns the variables that each function mentions, itself or through its calls.
pub(super) fn mentioned_by_functions(
    linker: &Linker,
    variables: &HashSet<u32>,
) -> HashMap<u32, HashSet<u32>> {
    // Other functions cannot name the variables of a function.
    if variables.iter().all(|variable| linker.global(*variable).is_none()) {
        return HashMap::new();
    }
    let mut calls: HashMap<u32, HashSet<u32>> = HashMap::new();
    let mut found: HashMap<u32, HashSet<u32>> = HashMap::new();
    for function in &linker.module.functions {
        let ids: HashSet<u32> =
            function.code().flat_map(|inst| used_ids(inst, &linker.module.wide)).collect();
        found.insert(function.id(), ids.intersection(variables).copied().collect());
        calls.insert(function.id(), ids);
    }
    let mut has_changed = true;
    while has_changed {
        has_changed = false;
        for (caller, ids) in &calls {
            let more: HashSet<u32> = ids.iter().filter_map(|id| found.get(id)).flatten().copied().collect();
            if let Some(own) = found.get_mut(caller) {
                let before = own.len();
                own.extend(more);
                has_changed |= own.len() != before;
            }
        }
    }
    found
}
