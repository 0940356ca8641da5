//! Strips the resource arrays of the preamble that a shader does not use.

use std::collections::HashSet;

use ::spirv::{Op, StorageClass};

use crate::shader::spirv::words::{Instruction, instructions};

/// Returns `words` without the resource variables that no function uses.
///
/// The mere presence of a variable can need a device feature (a writable image in a vertex shader), so unused ones are
/// removed. A literal that equals the id of a variable keeps the variable, which does no harm.
pub(crate) fn strip_unused_bindings(words: Vec<u32>) -> Vec<u32> {
    let Ok(code) = instructions(&words).collect::<Result<Vec<_>, _>>() else {
        return words;
    };
    let first_function = code.iter().position(|i| i.op == Some(Op::Function)).unwrap_or(code.len());
    let (globals, functions) = code.split_at(first_function);
    let mentioned: HashSet<u32> = functions.iter().flat_map(|i| i.operands()).copied().collect();
    let unused: HashSet<u32> =
        globals.iter().filter_map(resource_variable).filter(|id| !mentioned.contains(id)).collect();
    let mut out = words[..words.len().min(5)].to_vec();
    for instruction in globals {
        push_without(&mut out, instruction, &unused);
    }
    out.extend(functions.iter().flat_map(|i| i.words));
    out
}

fn resource_variable(instruction: &Instruction<'_>) -> Option<u32> {
    let classes = [StorageClass::UniformConstant as u32, StorageClass::StorageBuffer as u32];
    let is_resource = instruction.op == Some(Op::Variable) && classes.contains(&instruction.operand(2));
    is_resource.then(|| instruction.operand(1))
}

fn push_without(out: &mut Vec<u32>, instruction: &Instruction<'_>, unused: &HashSet<u32>) {
    let drop = match instruction.op {
        Some(Op::Name | Op::Decorate | Op::DecorateId) => unused.contains(&instruction.operand(0)),
        Some(Op::Variable) => unused.contains(&instruction.operand(1)),
        // The extensions of the preamble are the same for every shader.
        Some(Op::SourceExtension) => true,
        Some(Op::EntryPoint) => return push_entry_point(out, instruction, unused),
        _ => false,
    };
    if !drop {
        out.extend(instruction.words);
    }
}

fn push_entry_point(out: &mut Vec<u32>, instruction: &Instruction<'_>, unused: &HashSet<u32>) {
    // Operands: execution model, function, then the name.
    let interface = 3 + instruction.string(2).1;
    let (head, ids) = instruction.words.split_at(interface.min(instruction.words.len()));
    let at = out.len();
    out.extend(head);
    out.extend(ids.iter().filter(|id| !unused.contains(id)));
    let len = out.len() - at;
    if let (Some(first), Ok(len)) = (out.get_mut(at), u32::try_from(len)) {
        *first = len << 16 | Op::EntryPoint as u32;
    }
}
