//! Makes variables that an invocation of a shader has for itself variables of its one function.

use std::collections::{HashMap, HashSet};

use ::spirv::{Op, StorageClass};

use super::demote::declare_variable;
use super::emit::Emitter;
use super::instruction::{Inst, pointer_place, used_beside_pointer};
use super::linker::Linker;
use super::liveness::mentioned_by_functions;
use super::module::Function;
use super::promote::is_register;

/// Replaces those of `own` that the function only loads, stores and indexes, and that no function uses which it calls.
///
/// Those in `given` keep the values that they have when the function starts.
/// Returns the replaced variables, which nothing reads behind the start of the function.
pub(super) fn localize(
    linker: &mut Linker,
    function: &mut Function,
    own: &[u32],
    given: &HashSet<u32>,
) -> Vec<u32> {
    let roots = roots(linker, function, own);
    let mut replaced: Vec<u32> =
        own.iter().copied().filter(|variable| roots.plain.contains(variable)).collect();
    replaced.sort_unstable();
    replaced.dedup();
    let mut locals: HashMap<u32, u32> = HashMap::new();
    for variable in &replaced {
        let ty = linker.variable_type(*variable).unwrap_or(0);
        locals.insert(*variable, declare_variable(linker, function, ty));
    }
    for inst in function.code_mut() {
        replace(linker, &roots.chains, &locals, inst);
    }
    copy_given(linker, function, &replaced, &locals, given);
    replaced
}

/// Variables with plain uses only, and the variable that each access chain leads into.
struct Roots {
    plain: HashSet<u32>,
    chains: HashMap<u32, u32>,
}

fn roots(linker: &Linker, function: &Function, own: &[u32]) -> Roots {
    let mut plain: HashSet<u32> = own.iter().copied().collect();
    let mentions = mentioned_by_functions(linker, &plain);
    for call in function.code().filter(|inst| inst.op == Op::FunctionCall) {
        let used = mentions.get(&call.operand(2)).into_iter().flatten();
        used.for_each(|variable| {
            plain.remove(variable);
        });
    }
    let mut chains: HashMap<u32, u32> = HashMap::new();
    // Blocks stand behind those that dominate them, so a chain is found before its uses.
    for inst in function.code() {
        let root = |id: u32| chains.get(&id).copied().unwrap_or(id);
        for id in used_beside_pointer(inst, &linker.module.wide) {
            plain.remove(&root(id));
        }
        if matches!(inst.op, Op::AccessChain | Op::InBoundsAccessChain) {
            let base = root(inst.operand(2));
            if own.contains(&base) {
                chains.insert(inst.operand(1), base);
            }
        }
    }
    Roots { plain, chains }
}

fn replace(linker: &mut Linker, chains: &HashMap<u32, u32>, locals: &HashMap<u32, u32>, inst: &mut Inst) {
    let is_chain = matches!(inst.op, Op::AccessChain | Op::InBoundsAccessChain);
    if is_chain && chains.get(&inst.operand(1)).is_some_and(|root| locals.contains_key(root)) {
        let target = linker.pointer(inst.operand(0)).map_or(0, |(_, target)| target);
        inst.operands[0] = linker.pointer_to(StorageClass::Function, target);
    }
    let Some(pointer) = pointer_place(inst.op) else { return };
    if let Some(local) = locals.get(&inst.operand(pointer)) {
        inst.operands[pointer] = *local;
    }
}

/// Copies the given values at the start of the function, and makes the variables that held them undefined.
fn copy_given(
    linker: &mut Linker,
    function: &mut Function,
    replaced: &[u32],
    locals: &HashMap<u32, u32>,
    given: &HashSet<u32>,
) {
    let Some(first) = function.blocks.first_mut() else { return };
    let behind = first.take_code_behind_variables();
    let mut emitter = Emitter::new(linker, &mut first.code);
    for variable in replaced.iter().filter(|variable| given.contains(variable)) {
        let value = emitter.load(*variable);
        emitter.store(locals[variable], value);
        emitter.forget(*variable);
    }
    first.code.extend(behind);
}

/// Makes the variables of all functions undefined where the functions start.
///
/// They are so by definition. But compilers that put functions in place within a loop take what a variable held in the last
/// round for a value that the next round may read.
pub(super) fn forget_locals(linker: &mut Linker) {
    for at in 0..linker.module.functions.len() {
        let Some(block) = linker.module.functions[at].blocks.first_mut() else { continue };
        let behind = block.take_code_behind_variables();
        let mut code = std::mem::take(&mut block.code);
        let variables: Vec<Inst> = code.iter().filter(|inst| inst.operands.len() == 3).cloned().collect();
        let mut emitter = Emitter::new(linker, &mut code);
        for variable in variables {
            let ty = emitter.linker.pointer(variable.operand(0)).map_or(0, |(_, target)| target);
            forget_local(&mut emitter, variable.operand(1), ty);
        }
        code.extend(behind);
        if let Some(block) = linker.module.functions[at].blocks.first_mut() {
            block.code = code;
        }
    }
}

/// Makes a variable undefined. Arrays in it stay: compilers keep none in registers.
fn forget_local(emitter: &mut Emitter<'_>, variable: u32, ty: u32) {
    let members = match emitter.linker.global(ty) {
        Some(inst) if inst.op == Op::TypeStruct => inst.operands[1..].to_vec(),
        _ => Vec::new(),
    };
    for (index, member) in (0..).zip(members) {
        if is_register(emitter.linker, member) {
            let pointer = emitter.linker.pointer_to(StorageClass::Function, member);
            let index = emitter.linker.constant(index);
            let place = emitter.value(Op::AccessChain, pointer, &[variable, index]);
            emitter.store_undefined(place, member);
        }
    }
    if is_register(emitter.linker, ty) {
        emitter.store_undefined(variable, ty);
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test")]
mod tests {
    use super::super::module::Block;
    use super::*;

    /// A function that loads variables `plain` and `shared`, and calls one that loads `shared`.
    fn shader() -> (Linker, Function, [u32; 2]) {
        let mut linker = Linker::new(0x0001_0600);
        let uint = linker.uint();
        let [plain, shared] = [(); 2].map(|()| linker.private(uint));
        let callee = linker.new_id();
        let [a, b, c, call] = [(); 4].map(|()| linker.new_id());
        let load = |id, variable| Inst::new(Op::Load, &[uint, id, variable]);
        let leaves = Inst::new(Op::Return, &[]);
        linker.push_function(callee, vec![Block { label: 800, code: vec![load(a, shared), leaves.clone()] }]);
        let void = linker.void();
        let calls = Inst::new(Op::FunctionCall, &[void, call, callee]);
        let code = vec![load(b, plain), load(c, shared), calls, leaves];
        let head = Inst::new(Op::Function, &[void, 900, 0, linker.plain_function_type()]);
        let function = Function { head, parameters: Vec::new(), blocks: vec![Block { label: 1, code }] };
        (linker, function, [plain, shared])
    }

    #[test]
    fn a_given_value_is_read_once_and_forgotten() {
        let (mut linker, mut function, [plain, shared]) = shader();
        let replaced =
            localize(&mut linker, &mut function, &[plain, shared], &HashSet::from([plain, shared]));
        assert_eq!(replaced, [plain]);
        let loads = function.code().filter(|inst| inst.op == Op::Load && inst.operand(2) == plain);
        assert_eq!(loads.count(), 1);
        let stored = function.code().find(|inst| inst.op == Op::Store && inst.operand(0) == plain).unwrap();
        assert_eq!(linker.global(stored.operand(1)).unwrap().op, Op::Undef);
    }

    #[test]
    fn a_variable_that_a_called_function_reads_stays() {
        let (mut linker, mut function, [plain, shared]) = shader();
        localize(&mut linker, &mut function, &[plain, shared], &HashSet::new());
        let reads = |variable| function.code().any(|inst| inst.op == Op::Load && inst.operand(2) == variable);
        assert!(reads(shared));
        assert!(!reads(plain));
    }
}
