//! Keeps addresses in variables as pairs of numbers.
//!
//! SwiftShader turns variables into values, and ends the process where an `OpPhi` selects a pointer.

use std::collections::HashMap;

use ::spirv::{Decoration, Op, StorageClass};

use super::instruction::{Inst, used_beside_pointer, used_ids};
use super::linker::Linker;
use super::module::Module;

/// Changes the variables that hold pointers to buffers, and that are only read and written whole: they hold the bits of the
/// addresses instead.
pub(super) fn keep_pointers_as_bits(linker: &mut Linker) {
    let pointers = pointer_variables(linker);
    let pair = linker.uvec2();
    let [private, local] =
        [StorageClass::Private, StorageClass::Function].map(|storage| linker.pointer_to(storage, pair));
    let module = &mut linker.module;
    // The new types stand behind the variables, which therefore move to the end.
    let (mut changed, kept): (Vec<Inst>, Vec<Inst>) =
        module.globals.drain(..).partition(|inst| is_variable_of(inst, &pointers));
    changed.iter_mut().for_each(|inst| inst.operands[0] = private);
    module.globals = kept.into_iter().chain(changed).collect();
    let of_pointers = [Decoration::AliasedPointer as u32, Decoration::RestrictPointer as u32];
    module
        .decorations
        .retain(|inst| !pointers.contains_key(&inst.operand(0)) || !of_pointers.contains(&inst.operand(1)));
    let mut functions = std::mem::take(&mut module.functions);
    for block in functions.iter_mut().flat_map(|function| &mut function.blocks) {
        for mut inst in std::mem::take(&mut block.code) {
            if is_variable_of(&inst, &pointers) {
                inst.operands[0] = local;
            }
            rewrite(module, pair, &pointers, inst, &mut block.code);
        }
    }
    module.functions = functions;
}

fn is_variable_of(inst: &Inst, pointers: &HashMap<u32, u32>) -> bool {
    inst.op == Op::Variable && pointers.contains_key(&inst.operand(1))
}

/// Returns the variables of pointers to buffers that are only read and written whole, each with the type of the pointer.
fn pointer_variables(linker: &Linker) -> HashMap<u32, u32> {
    let module = &linker.module;
    let code = || module.functions.iter().flat_map(|function| function.code());
    let own = [StorageClass::Private as u32, StorageClass::Function as u32];
    let is_own =
        |inst: &&Inst| inst.op == Op::Variable && inst.operands.len() == 3 && own.contains(&inst.operand(2));
    let mut pointers: HashMap<u32, u32> = (module.globals.iter().chain(code()).filter(is_own))
        .filter_map(|inst| Some((inst.operand(1), linker.pointer(inst.operand(0))?.1)))
        .filter(|(_, ty)| linker.is_buffer_pointer(*ty))
        .collect();
    for inst in code().filter(|inst| inst.op != Op::Variable) {
        let uses = if matches!(inst.op, Op::Load | Op::Store) { used_beside_pointer } else { used_ids };
        for id in uses(inst, &module.wide) {
            pointers.remove(&id);
        }
    }
    pointers
}

/// Appends an instruction to `code`, with a conversion beside it if the instruction reads or writes one of the variables.
fn rewrite(
    module: &mut Module,
    pair: u32,
    pointers: &HashMap<u32, u32>,
    mut inst: Inst,
    code: &mut Vec<Inst>,
) {
    match inst.op {
        Op::Load if pointers.contains_key(&inst.operand(2)) => {
            let bits = module.new_id();
            let [ty, result] = [inst.operand(0), inst.operand(1)];
            inst.operands[0] = pair;
            inst.operands[1] = bits;
            code.extend([inst, Inst::new(Op::Bitcast, &[ty, result, bits])]);
        }
        Op::Store if pointers.contains_key(&inst.operand(0)) => {
            let bits = module.new_id();
            let convert = Inst::new(Op::Bitcast, &[pair, bits, inst.operand(1)]);
            inst.operands[1] = bits;
            code.extend([convert, inst]);
        }
        _ => code.push(inst),
    }
}
