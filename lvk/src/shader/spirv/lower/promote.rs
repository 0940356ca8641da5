//! Makes variables of a function values, which compilers and the liveness of values follow better.
//!
//! The result is in static single assignment form (Cytron et al., Efficiently Computing Static Single Assignment Form and
//! the Control Dependence Graph): where blocks meet, an `OpPhi` selects the value of a variable that is read later.

use std::collections::{BTreeMap, HashMap, HashSet};

use ::spirv::Op;

use super::control_flow::ControlFlow;
use super::instruction::{Inst, for_each_id, used_beside_pointer, used_ids};
use super::linker::Linker;
use super::liveness::live_at_starts;
use super::module::Function;

/// Replaces the variables of the function that are only read and written whole.
pub(super) fn promote_variables(linker: &mut Linker, function: &mut Function) {
    let types = promotable(linker, function);
    if types.is_empty() {
        return;
    }
    let flow = ControlFlow::new(function);
    let variables: HashSet<u32> = types.keys().copied().collect();
    let live = live_at_starts(linker, function, &flow, &variables);
    let count = function.blocks.len();
    let mut promotion = Promotion {
        linker,
        types,
        live,
        at_end: vec![BTreeMap::new(); count],
        phis: vec![Vec::new(); count],
        values: HashMap::new(),
    };
    for block in flow.order.iter().copied() {
        promotion.enter(&flow, block);
        promotion.rewrite(function, block);
    }
    for block in (0..count).filter(|block| !flow.is_reachable(*block)) {
        promotion.rewrite(function, block);
    }
    promotion.write_phis(function, &flow);
    let values = promotion.values;
    replace_values(linker, function, values);
}

/// Replaces values by others, which may be replaced themselves.
pub(super) fn replace_values(linker: &Linker, function: &mut Function, values: HashMap<u32, u32>) {
    for inst in function.code_mut() {
        let result = inst.result();
        let _ = for_each_id(inst, &linker.module.wide, |id| {
            if Some(*id) != result {
                *id = last_value(&values, *id);
            }
        });
    }
}

/// Returns the value that replaces another one in the end. In a damaged module, values may replace each other.
fn last_value(values: &HashMap<u32, u32>, id: u32) -> u32 {
    let mut at = id;
    for _ in 0..=values.len() {
        match values.get(&at) {
            Some(next) => at = *next,
            None => break,
        }
    }
    at
}

/// Returns the variables that are only read and written whole, each with its type.
fn promotable(linker: &Linker, function: &Function) -> BTreeMap<u32, u32> {
    let variables = function.code().filter(|inst| inst.op == Op::Variable && inst.operands.len() == 3);
    let mut found: BTreeMap<u32, u32> = variables
        .filter_map(|inst| Some((inst.operand(1), linker.pointer(inst.operand(0))?.1)))
        .filter(|(_, ty)| is_register(linker, *ty))
        .collect();
    for inst in function.code().filter(|inst| inst.op != Op::Variable) {
        let is_whole = match inst.op {
            Op::Load => inst.operands.len() == 3,
            Op::Store => inst.operands.len() == 2,
            _ => false,
        };
        let uses = if is_whole { used_beside_pointer } else { used_ids };
        for id in uses(inst, &linker.module.wide) {
            found.remove(&id);
        }
    }
    found
}

/// True for numbers, vectors, matrices and addresses.
pub(super) fn is_register(linker: &Linker, ty: u32) -> bool {
    let is_plain = |inst: &Inst| !matches!(inst.op, Op::TypeStruct | Op::TypeArray | Op::TypeRuntimeArray);
    linker.can_store(ty) && linker.global(ty).is_some_and(is_plain)
}

struct Promotion<'a> {
    linker: &'a mut Linker,
    /// Promoted variables with their types.
    types: BTreeMap<u32, u32>,
    /// Variables that are read in a block or behind it.
    live: Vec<HashSet<u32>>,
    /// Values of variables at the start of a block while it is rewritten, and then at its end.
    at_end: Vec<BTreeMap<u32, u32>>,
    /// Variables of a block that an `OpPhi` selects, each with the id of the result.
    phis: Vec<Vec<(u32, u32)>>,
    /// Values in place of loaded ones.
    values: HashMap<u32, u32>,
}

impl Promotion<'_> {
    /// Finds the values of variables at the start of a block.
    fn enter(&mut self, flow: &ControlFlow, block: usize) {
        let mut live: Vec<u32> = self.live[block].iter().copied().collect();
        live.sort_unstable();
        let from: HashSet<usize> = flow.predecessors[block].iter().copied().collect();
        let only = from.iter().next().copied().filter(|_| from.len() == 1);
        for variable in live {
            let value = match only {
                Some(from) => self.value_behind(from, variable),
                None if from.is_empty() => self.undefined(variable),
                None => {
                    let phi = self.linker.new_id();
                    self.phis[block].push((variable, phi));
                    phi
                }
            };
            self.at_end[block].insert(variable, value);
        }
    }

    fn value_behind(&mut self, block: usize, variable: u32) -> u32 {
        let known = self.at_end[block].get(&variable).copied();
        known.unwrap_or_else(|| self.undefined(variable))
    }

    fn undefined(&mut self, variable: u32) -> u32 {
        let ty = self.types.get(&variable).copied().unwrap_or(0);
        self.linker.undefined(ty)
    }

    /// Takes loads and stores of promoted variables out of a block.
    fn rewrite(&mut self, function: &mut Function, block: usize) {
        let mut values = std::mem::take(&mut self.at_end[block]);
        let mut out = Vec::with_capacity(function.blocks[block].code.len());
        for inst in std::mem::take(&mut function.blocks[block].code) {
            match inst.op {
                Op::Variable if self.types.contains_key(&inst.operand(1)) => {}
                Op::Load if self.types.contains_key(&inst.operand(2)) => {
                    let known = values.get(&inst.operand(2)).copied();
                    let value = known.unwrap_or_else(|| self.undefined(inst.operand(2)));
                    self.values.insert(inst.operand(1), value);
                }
                Op::Store if self.types.contains_key(&inst.operand(0)) => {
                    values.insert(inst.operand(0), inst.operand(1));
                }
                _ => out.push(inst),
            }
        }
        function.blocks[block].code = out;
        self.at_end[block] = values;
    }

    /// Writes the selections at the starts of blocks. One that selects a single value is that value.
    fn write_phis(&mut self, function: &mut Function, flow: &ControlFlow) {
        let mut written: Vec<(usize, Inst)> = Vec::new();
        for block in 0..self.phis.len() {
            let mut from = flow.predecessors[block].clone();
            from.sort_unstable();
            from.dedup();
            for (variable, phi) in std::mem::take(&mut self.phis[block]) {
                let ty = self.types.get(&variable).copied().unwrap_or(0);
                let mut words = vec![ty, phi];
                for from in &from {
                    words.extend([self.value_behind(*from, variable), function.blocks[*from].label]);
                }
                self.linker.mark_wide(phi, ty);
                written.push((block, Inst::new(Op::Phi, &words)));
            }
        }
        while self.resolve_single_values(&mut written) {}
        for (block, inst) in written.into_iter().rev() {
            function.blocks[block].code.insert(0, inst);
        }
    }

    /// Replaces selections of a single value. True if there were any.
    fn resolve_single_values(&mut self, phis: &mut Vec<(usize, Inst)>) -> bool {
        let before = phis.len();
        let values = &mut self.values;
        phis.retain(|(_, inst)| {
            let phi = inst.operand(1);
            let mut selected = inst.operands[2..]
                .iter()
                .step_by(2)
                .map(|id| last_value(values, *id))
                .filter(|id| *id != phi);
            let Some(first) = selected.next() else { return true };
            if selected.any(|id| id != first) {
                return true;
            }
            values.insert(phi, first);
            false
        });
        phis.len() != before
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::panic, reason = "a test")]
mod tests {
    use super::super::demote::declare_variable;
    use super::super::module::Block;
    use super::*;

    /// A function of blocks with these labels and codes, and one variable of type `uint`.
    fn function(blocks: impl FnOnce(&mut Linker, u32) -> Vec<Block>) -> (Linker, Function) {
        let mut linker = Linker::new(0x0001_0600);
        let uint = linker.uint();
        let head = Inst::new(Op::Function, &[linker.void(), 900, 0, linker.plain_function_type()]);
        let empty = Block { label: 800, code: Vec::new() };
        let mut function = Function { head, parameters: Vec::new(), blocks: vec![empty] };
        let variable = declare_variable(&mut linker, &mut function, uint);
        let declared = function.blocks[0].code.clone();
        function.blocks = blocks(&mut linker, variable);
        function.blocks[0].code.splice(0..0, declared);
        (linker, function)
    }

    fn block(label: u32, code: &[(Op, &[u32])]) -> Block {
        Block { label, code: code.iter().map(|(op, operands)| Inst::new(*op, operands)).collect() }
    }

    /// Returns the operand that `OpIAdd` 700 adds to itself.
    fn added(function: &Function) -> u32 {
        function.code().find(|inst| inst.result() == Some(700)).unwrap().operand(2)
    }

    fn phis(function: &Function) -> Vec<&Inst> {
        function.code().filter(|inst| inst.op == Op::Phi).collect()
    }

    #[test]
    fn a_stored_value_replaces_the_loaded_one() {
        let (mut linker, mut function) = function(|linker, variable| {
            let (uint, one) = (linker.uint(), linker.constant(1));
            let code: [(Op, &[u32]); 4] = [
                (Op::Store, &[variable, one]),
                (Op::Load, &[uint, 701, variable]),
                (Op::IAdd, &[uint, 700, 701, 701]),
                (Op::Return, &[]),
            ];
            vec![block(1, &code)]
        });
        promote_variables(&mut linker, &mut function);
        assert_eq!(added(&function), linker.constant(1));
        assert!(!function.code().any(|inst| matches!(inst.op, Op::Variable | Op::Load | Op::Store)));
    }

    /// Writes `value` in one of two branches, and 1 before them.
    fn branches(value: u32) -> (Linker, Function) {
        function(|linker, variable| {
            let (uint, one, stored) = (linker.uint(), linker.constant(1), linker.constant(value));
            let condition = linker.bool_constant(true);
            vec![
                block(
                    1,
                    &[
                        (Op::Store, &[variable, one]),
                        (Op::SelectionMerge, &[3, 0]),
                        (Op::BranchConditional, &[condition, 2, 3]),
                    ],
                ),
                block(2, &[(Op::Store, &[variable, stored]), (Op::Branch, &[3])]),
                block(
                    3,
                    &[
                        (Op::Load, &[uint, 701, variable]),
                        (Op::IAdd, &[uint, 700, 701, 701]),
                        (Op::Return, &[]),
                    ],
                ),
            ]
        })
    }

    #[test]
    fn branches_that_store_select_the_value() {
        let (mut linker, mut function) = branches(2);
        promote_variables(&mut linker, &mut function);
        let [one, two] = [1, 2].map(|value| linker.constant(value));
        let selected = phis(&function);
        assert_eq!(selected.len(), 1);
        assert_eq!(selected[0].operands[2..], [one, 1, two, 2]);
        assert_eq!(added(&function), selected[0].operand(1));
    }

    #[test]
    fn branches_with_the_same_value_select_nothing() {
        let (mut linker, mut function) = branches(1);
        promote_variables(&mut linker, &mut function);
        assert!(phis(&function).is_empty());
        assert_eq!(added(&function), linker.constant(1));
    }

    #[test]
    fn loops_select_the_value_of_the_last_round() {
        let (mut linker, mut function) = function(|linker, variable| {
            let (uint, one) = (linker.uint(), linker.constant(1));
            let condition = linker.bool_constant(true);
            vec![
                block(1, &[(Op::Store, &[variable, one]), (Op::Branch, &[2])]),
                block(2, &[(Op::LoopMerge, &[4, 3, 0]), (Op::BranchConditional, &[condition, 3, 4])]),
                block(
                    3,
                    &[
                        (Op::Load, &[uint, 701, variable]),
                        (Op::IAdd, &[uint, 700, 701, 701]),
                        (Op::Store, &[variable, 700]),
                        (Op::Branch, &[2]),
                    ],
                ),
                block(4, &[(Op::Return, &[])]),
            ]
        });
        promote_variables(&mut linker, &mut function);
        let selected = phis(&function);
        assert_eq!(selected.len(), 1);
        assert_eq!(selected[0].operands[2..], [linker.constant(1), 1, 700, 3]);
        assert_eq!(added(&function), selected[0].operand(1));
    }

    #[test]
    fn a_variable_without_a_value_is_undefined() {
        let (mut linker, mut function) = function(|linker, variable| {
            let uint = linker.uint();
            let code: [(Op, &[u32]); 3] =
                [(Op::Load, &[uint, 701, variable]), (Op::IAdd, &[uint, 700, 701, 701]), (Op::Return, &[])];
            vec![block(1, &code)]
        });
        promote_variables(&mut linker, &mut function);
        let value = added(&function);
        assert_eq!(linker.global(value).unwrap().op, Op::Undef);
    }

    #[test]
    fn a_variable_whose_address_is_passed_on_stays() {
        let (mut linker, mut function) = function(|linker, variable| {
            let (void, one) = (linker.void(), linker.constant(1));
            let code: [(Op, &[u32]); 3] = [
                (Op::Store, &[variable, one]),
                (Op::FunctionCall, &[void, 702, 901, variable]),
                (Op::Return, &[]),
            ];
            vec![block(1, &code)]
        });
        promote_variables(&mut linker, &mut function);
        assert_eq!(function.code().filter(|inst| inst.op == Op::Variable).count(), 1);
        assert_eq!(function.code().filter(|inst| inst.op == Op::Store).count(), 1);
    }
}
