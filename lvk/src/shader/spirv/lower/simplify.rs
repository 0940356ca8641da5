//! Removes detours from a function: parts of composites that were just put together, copies, and values without a use.

use std::collections::{HashMap, HashSet};

use ::spirv::Op;

use super::instruction::{Inst, used_ids};
use super::linker::Linker;
use super::module::Function;
use super::promote::replace_values;
use crate::shader::spirv::parsed::MAX_NESTING;

/// Simplifies the function until nothing changes, or for a bounded number of rounds.
pub(super) fn simplify(linker: &Linker, function: &mut Function) {
    // In a damaged module, composites may be parts of themselves.
    for _ in 0..MAX_NESTING {
        if !forward_parts(linker, function) {
            break;
        }
    }
    remove_unused(linker, function);
}

/// Replaces parts of composites by the values that the composites were made of. True if any was replaced.
fn forward_parts(linker: &Linker, function: &mut Function) -> bool {
    let definitions = function.definitions();
    let mut values: HashMap<u32, u32> = HashMap::new();
    let mut has_changed = false;
    for inst in function.code_mut() {
        let replaced = match inst.op {
            Op::CopyObject => Some(inst.operand(2)),
            Op::CompositeExtract => match part(linker, &definitions, inst) {
                Some(Part::Value(value)) => Some(value),
                Some(Part::Of(composite, rest)) => {
                    inst.operands.truncate(2);
                    inst.operands.push(composite);
                    inst.operands.extend(rest);
                    has_changed = true;
                    None
                }
                None => None,
            },
            Op::CompositeConstruct => whole(linker, &definitions, inst),
            _ => None,
        };
        if let (Some(value), Some(id)) = (replaced, inst.result()) {
            *inst = Inst::new(Op::Nop, &[]);
            values.insert(id, value);
        }
    }
    has_changed |= !values.is_empty();
    for block in &mut function.blocks {
        block.code.retain(|inst| inst.op != Op::Nop);
    }
    replace_values(linker, function, values);
    has_changed
}

/// A part of a composite.
enum Part {
    Value(u32),
    /// A part of another composite, by its indices.
    Of(u32, Vec<u32>),
}

fn part(linker: &Linker, definitions: &HashMap<u32, Inst>, extract: &Inst) -> Option<Part> {
    let source = definitions.get(&extract.operand(2))?;
    let (index, rest) = extract.operands.get(3..)?.split_first()?;
    match source.op {
        Op::CompositeConstruct => {
            let parts = &source.operands[2..];
            if parts.len() != member_count(linker, source.operand(0))? {
                return None;
            }
            let value = *parts.get(*index as usize)?;
            Some(if rest.is_empty() { Part::Value(value) } else { Part::Of(value, rest.to_vec()) })
        }
        Op::CompositeInsert => {
            let place = source.operands.get(4..)?;
            let path = &extract.operands[3..];
            if place == path {
                return Some(Part::Value(source.operand(2)));
            }
            let is_apart = !place.starts_with(path) && !path.starts_with(place);
            is_apart.then(|| Part::Of(source.operand(3), path.to_vec()))
        }
        _ => None,
    }
}

/// Returns the composite that is put together of all its own parts.
fn whole(linker: &Linker, definitions: &HashMap<u32, Inst>, construct: &Inst) -> Option<u32> {
    let parts = &construct.operands[2..];
    if parts.len() != member_count(linker, construct.operand(0))? {
        return None;
    }
    let mut from = None;
    for (index, part) in (0..).zip(parts) {
        let extract = definitions.get(part).filter(|inst| inst.op == Op::CompositeExtract)?;
        if extract.operands.get(3..) != Some(&[index]) || from.is_some_and(|from| from != extract.operand(2))
        {
            return None;
        }
        from = Some(extract.operand(2));
    }
    let from = from?;
    let ty = definitions.get(&from).or_else(|| linker.global(from))?.result_type();
    (ty == Some(construct.operand(0))).then_some(from)
}

fn member_count(linker: &Linker, ty: u32) -> Option<usize> {
    let inst = linker.global(ty)?;
    match inst.op {
        Op::TypeVector | Op::TypeMatrix => Some(inst.operand(2) as usize),
        Op::TypeStruct => Some(inst.operands.len() - 1),
        Op::TypeArray => linker.array_length(ty).map(|length| length as usize),
        _ => None,
    }
}

/// Removes values that nothing uses.
fn remove_unused(linker: &Linker, function: &mut Function) {
    let wide = &linker.module.wide;
    let definitions = function.definitions();
    let is_root = |inst: &&Inst| inst.result().is_none() || !is_pure(linker, inst);
    let mut open: Vec<u32> = function.code().filter(is_root).flat_map(|inst| used_ids(inst, wide)).collect();
    let mut used: HashSet<u32> = HashSet::new();
    while let Some(id) = open.pop() {
        if used.insert(id)
            && let Some(inst) = definitions.get(&id)
        {
            open.extend(used_ids(inst, wide));
        }
    }
    let is_needed = |inst: &Inst| inst.result().is_none_or(|id| used.contains(&id)) || !is_pure(linker, inst);
    for block in &mut function.blocks {
        block.code.retain(is_needed);
    }
}

/// True for an instruction without any effect but its result.
fn is_pure(linker: &Linker, inst: &Inst) -> bool {
    match inst.op {
        Op::Load => inst.operands.len() == 3,
        Op::AccessChain
        | Op::InBoundsAccessChain
        | Op::VectorShuffle
        | Op::Phi
        | Op::Undef
        | Op::Variable => true,
        Op::CompositeConstruct | Op::CompositeExtract | Op::CompositeInsert | Op::CopyObject => true,
        Op::CopyLogical | Op::Transpose | Op::SampledImage | Op::Image => true,
        Op::ExtInst => is_pure_of_glsl(linker, inst),
        // Conversions, arithmetic, logic and bits.
        _ => matches!(inst.op as u32, 109..=124 | 126..=152 | 154..=191 | 194..=205),
    }
}

/// True for an instruction of `GLSL.std.450` that writes no memory.
fn is_pure_of_glsl(linker: &Linker, inst: &Inst) -> bool {
    const MODF: u32 = 35;
    const FREXP: u32 = 51;
    let is_set = |import: &&Inst| import.operand(0) == inst.operand(2);
    let import = linker.module.imports.iter().find(is_set);
    import.is_some_and(|import| import.text(1) == "GLSL.std.450") && ![MODF, FREXP].contains(&inst.operand(3))
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test")]
mod tests {
    use super::super::module::Block;
    use super::*;

    /// Returns the code of one block after it was simplified. The last instruction stores a value in variable 950.
    fn simplified(code: impl FnOnce(&mut Linker) -> Vec<Inst>) -> (Linker, Vec<Inst>) {
        let mut linker = Linker::new(0x0001_0600);
        let code = code(&mut linker);
        let head = Inst::new(Op::Function, &[linker.void(), 900, 0, linker.plain_function_type()]);
        let blocks = vec![Block { label: 1, code }];
        let mut function = Function { head, parameters: Vec::new(), blocks };
        simplify(&linker, &mut function);
        let code = function.blocks.remove(0).code;
        (linker, code)
    }

    fn store(value: u32) -> Inst {
        Inst::new(Op::Store, &[950, value])
    }

    #[test]
    fn a_part_of_a_composite_is_what_it_was_made_of() {
        let (mut linker, code) = simplified(|linker| {
            let (uint, pair) = (linker.uint(), linker.uvec2());
            let [one, two] = [1, 2].map(|value| linker.constant(value));
            vec![
                Inst::new(Op::CompositeConstruct, &[pair, 700, one, two]),
                Inst::new(Op::CopyObject, &[pair, 701, 700]),
                Inst::new(Op::CompositeExtract, &[uint, 702, 701, 1]),
                store(702),
            ]
        });
        assert_eq!(code, [store(linker.constant(2))]);
    }

    /// Puts a pair together of the parts of another one with these indices.
    fn pair_of_parts(indices: [u32; 2]) -> Vec<Inst> {
        let (_, code) = simplified(|linker| {
            let (uint, pair) = (linker.uint(), linker.uvec2());
            vec![
                Inst::new(Op::Load, &[pair, 700, 951, 1]),
                Inst::new(Op::CompositeExtract, &[uint, 701, 700, indices[0]]),
                Inst::new(Op::CompositeExtract, &[uint, 702, 700, indices[1]]),
                Inst::new(Op::CompositeConstruct, &[pair, 703, 701, 702]),
                store(703),
            ]
        });
        code
    }

    #[test]
    fn a_composite_of_all_parts_of_another_is_the_other() {
        let code = pair_of_parts([0, 1]);
        assert_eq!(code.last(), Some(&store(700)));
        assert_eq!(code.len(), 2);
    }

    #[test]
    fn parts_in_another_order_stay() {
        assert_eq!(pair_of_parts([1, 0]).len(), 5);
    }

    #[test]
    fn an_inserted_member_is_forwarded_and_others_come_from_the_base() {
        let (mut linker, code) = simplified(|linker| {
            let (uint, pair, one) = (linker.uint(), linker.uvec2(), linker.constant(1));
            vec![
                Inst::new(Op::Load, &[pair, 700, 951, 1]),
                Inst::new(Op::CompositeInsert, &[pair, 701, one, 700, 0]),
                Inst::new(Op::CompositeExtract, &[uint, 702, 701, 0]),
                Inst::new(Op::CompositeExtract, &[uint, 703, 701, 1]),
                store(702),
                store(703),
            ]
        });
        assert!(code.contains(&store(linker.constant(1))));
        let extract = code.iter().find(|inst| inst.op == Op::CompositeExtract).unwrap();
        assert_eq!(extract.operands[2..], [700, 1]);
        assert_eq!(code.len(), 4);
    }

    #[test]
    fn unused_values_go_and_calls_stay() {
        let (_, code) = simplified(|linker| {
            let (uint, one) = (linker.uint(), linker.constant(1));
            vec![
                Inst::new(Op::IAdd, &[uint, 700, one, one]),
                Inst::new(Op::IMul, &[uint, 701, 700, one]),
                Inst::new(Op::FunctionCall, &[uint, 702, 901]),
                Inst::new(Op::Return, &[]),
            ]
        });
        let ops: Vec<Op> = code.iter().map(|inst| inst.op).collect();
        assert_eq!(ops, [Op::FunctionCall, Op::Return]);
    }
}
