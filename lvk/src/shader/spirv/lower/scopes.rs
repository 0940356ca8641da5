//! Scopes of barriers and atomic operations.

use std::collections::HashMap;

use ::spirv::{Op, Scope};

use super::instruction::Inst;
use super::module::{Function, Module};

/// Makes the scope of related shader calls that of the device, as compute shaders have no such calls.
pub(super) fn widen_scopes(module: &mut Module) {
    let is_of_calls =
        |inst: &&Inst| inst.op == Op::Constant && inst.operand(2) == Scope::ShaderCallKHR as u32;
    let found: Vec<(u32, u32)> =
        module.globals.iter().filter(is_of_calls).map(|inst| (inst.operand(1), inst.operand(0))).collect();
    let mut wider: HashMap<u32, u32> = HashMap::new();
    for (scope, ty) in found {
        let is_used = |inst: &Inst| scope_place(inst.op).is_some_and(|place| inst.operand(place) == scope);
        if module.functions.iter().flat_map(Function::code).any(is_used) {
            let id = module.new_id();
            module.globals.push(Inst::new(Op::Constant, &[ty, id, Scope::Device as u32]));
            wider.insert(scope, id);
        }
    }
    for inst in module.functions.iter_mut().flat_map(Function::code_mut) {
        let operand = scope_place(inst.op).and_then(|place| inst.operands.get_mut(place));
        if let Some((operand, id)) = operand.and_then(|operand| wider.get(operand).map(|id| (operand, *id))) {
            *operand = id;
        }
    }
}

/// Returns the place of the memory scope among the operands of a barrier or an atomic operation.
fn scope_place(op: Op) -> Option<usize> {
    match op {
        Op::MemoryBarrier => Some(0),
        Op::AtomicStore | Op::ControlBarrier => Some(1),
        Op::AtomicFAddEXT | Op::AtomicFMinEXT | Op::AtomicFMaxEXT => Some(3),
        _ => (Op::AtomicLoad as u32..=Op::AtomicXor as u32).contains(&(op as u32)).then_some(3),
    }
}

#[cfg(test)]
mod tests {
    use super::super::module::Block;
    use super::*;

    #[test]
    fn scopes_of_calls_become_those_of_the_device() {
        const UINT: u32 = 1;
        const SIX: u32 = 2;
        let code = vec![
            Inst::new(Op::MemoryBarrier, &[SIX, 9]),
            Inst::new(Op::ControlBarrier, &[9, SIX, 9]),
            Inst::new(Op::AtomicIAdd, &[UINT, 20, 21, SIX, 9, 22]),
            Inst::new(Op::IAdd, &[UINT, 23, SIX, SIX]),
        ];
        let head = Inst::new(Op::Function, &[3, 4, 0, 5]);
        let mut module = Module {
            bound: 30,
            globals: vec![Inst::new(Op::Constant, &[UINT, SIX, Scope::ShaderCallKHR as u32])],
            functions: vec![Function {
                head,
                parameters: Vec::new(),
                blocks: vec![Block { label: 6, code }],
            }],
            ..Module::default()
        };
        widen_scopes(&mut module);
        assert_eq!(module.globals[1], Inst::new(Op::Constant, &[UINT, 30, Scope::Device as u32]));
        let code: Vec<&Inst> = module.functions[0].code().collect();
        assert_eq!((code[0].operand(0), code[1].operand(1), code[2].operand(3)), (30, 30, 30));
        assert_eq!(code[3].operands, [UINT, 23, SIX, SIX], "a number");
    }
}
