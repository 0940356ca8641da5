//! Splits variables of structs into their members, so that a function keeps only those that it reads later.

use std::collections::{HashMap, HashSet};

use ::spirv::Op;

use super::demote::declare_variable;
use super::instruction::{Inst, for_each_id, used_beside_pointer, used_ids};
use super::linker::Linker;
use super::module::Function;
use crate::shader::spirv::parsed::MAX_NESTING;

/// Splits the variables of structs of a function, members that are structs included.
pub(super) fn split_structs(linker: &mut Linker, function: &mut Function) {
    // A damaged module may have a struct that contains itself.
    for _ in 0..MAX_NESTING {
        let found = splittable(linker, function);
        let members = found.values().filter_map(|ty| linker.global(*ty)).map(|ty| ty.operands.len());
        if found.is_empty() || members.sum::<usize>() > MOST_MEMBERS {
            return;
        }
        split(linker, function, &found);
    }
}

/// Most variables that one round makes.
const MOST_MEMBERS: usize = 16_384;

/// Returns the variables that are only read and written whole or by members, each with its type.
fn splittable(linker: &Linker, function: &Function) -> HashMap<u32, u32> {
    let struct_of = |inst: &Inst| {
        let (_, target) = linker.pointer(inst.operand(0))?;
        linker.global(target).is_some_and(|ty| ty.op == Op::TypeStruct).then_some(target)
    };
    let variables = function.code().filter(|inst| inst.op == Op::Variable && inst.operands.len() == 3);
    let mut found: HashMap<u32, u32> =
        variables.filter_map(|inst| Some((inst.operand(1), struct_of(inst)?))).collect();
    let is_constant = |id: u32| linker.global(id).is_some_and(|inst| inst.op == Op::Constant);
    for inst in function.code().filter(|inst| inst.op != Op::Variable) {
        let is_plain = match inst.op {
            Op::AccessChain | Op::InBoundsAccessChain => is_constant(inst.operand(3)),
            Op::Load => inst.operands.len() == 3,
            Op::Store => inst.operands.len() == 2,
            _ => false,
        };
        let uses = if is_plain { used_beside_pointer } else { used_ids };
        for id in uses(inst, &linker.module.wide) {
            found.remove(&id);
        }
    }
    found
}

fn split(linker: &mut Linker, function: &mut Function, found: &HashMap<u32, u32>) {
    let mut sorted: Vec<(u32, u32)> = found.iter().map(|(variable, ty)| (*variable, *ty)).collect();
    sorted.sort_unstable();
    let mut members: HashMap<u32, Vec<(u32, u32)>> = HashMap::new();
    for (variable, ty) in sorted {
        let types = linker.global(ty).map_or(Vec::new(), |inst| inst.operands[1..].to_vec());
        let parts = types.into_iter().map(|ty| (declare_variable(linker, function, ty), ty)).collect();
        members.insert(variable, parts);
    }
    let mut renamed: HashMap<u32, u32> = HashMap::new();
    for block in &mut function.blocks {
        let mut out = Vec::with_capacity(block.code.len());
        for inst in std::mem::take(&mut block.code) {
            rewrite(linker, &members, &mut renamed, inst, &mut out);
        }
        block.code = out;
    }
    let wide = HashSet::new();
    for inst in function.code_mut().filter(|inst| inst.op != Op::Switch) {
        let _ = for_each_id(inst, &wide, |id| *id = renamed.get(id).copied().unwrap_or(*id));
    }
}

/// Rewrites an instruction for variables in parts. `renamed` collects pointers to members, which are variables now.
fn rewrite(
    linker: &mut Linker,
    members: &HashMap<u32, Vec<(u32, u32)>>,
    renamed: &mut HashMap<u32, u32>,
    mut inst: Inst,
    out: &mut Vec<Inst>,
) {
    let parts = |id: u32| members.get(&id).map(Vec::as_slice);
    match inst.op {
        Op::Variable if parts(inst.operand(1)).is_some() => {}
        Op::AccessChain | Op::InBoundsAccessChain => {
            let Some(parts) = parts(inst.operand(2)) else { return out.push(inst) };
            let index = linker.global(inst.operand(3)).map_or(0, |constant| constant.operand(2) as usize);
            let Some((part, _)) = parts.get(index) else { return out.push(inst) };
            if inst.operands.len() == 4 {
                renamed.insert(inst.operand(1), *part);
            } else {
                inst.operands[2] = *part;
                inst.operands.remove(3);
                out.push(inst);
            }
        }
        Op::Load => {
            let Some(parts) = parts(inst.operand(2)) else { return out.push(inst) };
            let mut words = vec![inst.operand(0), inst.operand(1)];
            for (part, ty) in parts {
                let id = linker.new_id();
                out.push(Inst::new(Op::Load, &[*ty, id, *part]));
                words.push(id);
            }
            out.push(Inst::new(Op::CompositeConstruct, &words));
        }
        Op::Store => {
            let Some(parts) = parts(inst.operand(0)) else { return out.push(inst) };
            for (index, (part, ty)) in (0..).zip(parts) {
                let id = linker.new_id();
                out.push(Inst::new(Op::CompositeExtract, &[*ty, id, inst.operand(1), index]));
                out.push(Inst::new(Op::Store, &[*part, id]));
            }
        }
        _ => out.push(inst),
    }
}
