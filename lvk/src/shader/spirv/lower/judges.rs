//! Rewrites shaders that judge candidates: any-hit and intersection shaders, which may end in any of their functions.

use std::collections::{HashMap, HashSet};

use ::spirv::{BuiltIn, Op};

use super::block_loop::run_blocks_in_loop;
use super::control_flow::ControlFlow;
use super::donor::Donor;
use super::emit::Emitter;
use super::instruction::Inst;
use super::linker::Linker;
use super::loop_headers::{can_leave_header, leave_loop_header};
use super::module::{Block, Function, functions_that_reach};
use super::passed::Passed;
use super::stage::Shader;

/// Rewrites the functions of an any-hit or intersection shader. `attributes` pass the attributes of candidates.
pub(super) fn rewrite_judge(
    linker: &mut Linker,
    donor: &Donor,
    shader: &Shader,
    attributes: &mut Passed,
) -> Result<(), String> {
    // Functions in which the shader may end.
    let functions = shader.functions.iter().filter_map(|id| linker.function(*id));
    let ending = functions_that_reach(functions, |inst| {
        matches!(inst.op, Op::IgnoreIntersectionKHR | Op::TerminateRayKHR | Op::ReportIntersectionKHR)
    });
    for id in &shader.functions {
        let Some(mut function) = linker.take_function(*id) else { continue };
        let result = rewrite_function(linker, donor, shader, attributes, &ending, &mut function);
        linker.module.functions.push(function);
        result?;
    }
    Ok(())
}

fn rewrite_function(
    linker: &mut Linker,
    donor: &Donor,
    shader: &Shader,
    attributes: &mut Passed,
    ending: &HashSet<u32>,
    function: &mut Function,
) -> Result<(), String> {
    let result = function.head.operand(0);
    let definitions = function.definitions();
    let mut checks = Vec::new();
    for block in &mut function.blocks {
        let mut out = Vec::with_capacity(block.code.len());
        for inst in std::mem::take(&mut block.code) {
            match inst.op {
                Op::IgnoreIntersectionKHR | Op::TerminateRayKHR => {
                    let yes = linker.bool_constant(true);
                    let is_ignored = inst.op == Op::IgnoreIntersectionKHR;
                    let mut emitter = Emitter::new(linker, &mut out);
                    emitter.store(if is_ignored { donor.ignores } else { donor.ends }, yes);
                    emitter.store(donor.unwinds, yes);
                    emit_return(&mut emitter, result);
                }
                Op::ReportIntersectionKHR => {
                    report(linker, donor, shader, attributes, &definitions, &inst, &mut out);
                    checks.push(inst.operand(1));
                }
                Op::FunctionCall if ending.contains(&inst.operand(2)) => {
                    checks.push(inst.operand(1));
                    out.push(inst);
                }
                _ => out.push(inst),
            }
        }
        block.code = out;
    }
    if !can_return_behind(function, &checks) {
        run_blocks_in_loop(linker, function)?;
    }
    checks.into_iter().for_each(|call| check_behind(linker, donor, function, call));
    Ok(())
}

/// Replaces a report by a call of the donor's function.
fn report(
    linker: &mut Linker,
    donor: &Donor,
    shader: &Shader,
    attributes: &mut Passed,
    definitions: &HashMap<u32, Inst>,
    inst: &Inst,
    out: &mut Vec<Inst>,
) {
    let kind_type = linker.value_type(definitions, inst.operand(3));
    let shared = shader.attributes.map(|own| (own, attributes.variable(linker, own)));
    let uint = linker.uint();
    let mut emitter = Emitter::new(linker, out);
    if let Some((own, shared)) = shared {
        emitter.copy(own, shared);
    }
    let kind = emitter.convert(inst.operand(3), kind_type, uint);
    let words = [inst.operand(0), inst.operand(1), donor.report, inst.operand(2), kind];
    emitter.push(Op::FunctionCall, &words);
    for (_, variable) in shader.builtins.iter().filter(|(builtin, _)| *builtin == BuiltIn::RayTmaxKHR) {
        emitter.copy(donor.limit, *variable);
    }
}

/// True if the control flow allows a return behind each of the calls with these results.
fn can_return_behind(function: &Function, calls: &[u32]) -> bool {
    let flow = ControlFlow::new(function);
    let has_call =
        |block: &Block| block.code.iter().any(|inst| inst.result().is_some_and(|id| calls.contains(&id)));
    let mut with_calls = (0..function.blocks.len()).filter(|at| has_call(&function.blocks[*at]));
    with_calls.all(|at| can_leave_header(function, at) && !is_on_the_way_back(function, &flow, at))
}

/// True for a block that only the way back to the start of a loop reaches, from where no return is possible.
fn is_on_the_way_back(function: &Function, flow: &ControlFlow, at: usize) -> bool {
    let merges = function.blocks.iter().filter_map(|block| block.merge().map(|inst| (block, inst)));
    let mut loops = merges.filter(|(_, inst)| inst.op == Op::LoopMerge);
    loops.any(|(header, inst)| {
        let target = flow.index_of(inst.operand(1));
        inst.operand(1) != header.label && target.is_some_and(|target| flow.dominates(target, at))
    })
}

/// Returns from the function if the shader has ended in the call with the result `call`.
fn check_behind(linker: &mut Linker, donor: &Donor, function: &mut Function, call: u32) {
    let result = function.head.operand(0);
    let is_call = |inst: &Inst| inst.result() == Some(call);
    let place = function
        .blocks
        .iter()
        .enumerate()
        .find_map(|(at, block)| block.code.iter().position(is_call).map(|place| (at, place)));
    let Some((at, place)) = place else { return };
    let at = leave_loop_header(linker, function, at);
    let place = function.blocks[at].code.iter().position(is_call).unwrap_or(place);
    let rest = function.blocks[at].code.split_off(place + 1);
    let (leave, stay) = (linker.new_id(), linker.new_id());
    let label = function.blocks[at].label;
    function.rename_predecessor(label, stay);
    let mut emitter = Emitter::new(linker, &mut function.blocks[at].code);
    let unwinds = emitter.load(donor.unwinds);
    emitter.push(Op::SelectionMerge, &[stay, 0]);
    emitter.push(Op::BranchConditional, &[unwinds, leave, stay]);
    let mut code = Vec::new();
    emit_return(&mut Emitter::new(linker, &mut code), result);
    let blocks = [Block { label: leave, code }, Block { label: stay, code: rest }];
    function.blocks.splice(at + 1..at + 1, blocks);
}

/// Returns from a function with this result type; the result does not matter.
fn emit_return(emitter: &mut Emitter<'_>, result: u32) {
    if result == emitter.linker.void() {
        emitter.push(Op::Return, &[]);
    } else {
        // No constant is null for the address of a buffer.
        let value = emitter.linker.undefined(result);
        emitter.push(Op::ReturnValue, &[value]);
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test")]
mod tests {
    use super::*;

    /// glslang makes a pointer just before it stores by it, so the words are written here.
    #[test]
    fn nothing_runs_between_a_report_and_its_check() {
        const REPORTED: u32 = 700;
        let mut linker = Linker::default();
        let bool = linker.bool();
        let donor = Donor { unwinds: linker.private(bool), limit: 703, ..Donor::default() };
        let store = Inst::new(Op::Store, &[701, 702]);
        let code = vec![
            Inst::new(Op::FunctionCall, &[bool, REPORTED, 704]),
            store.clone(),
            Inst::new(Op::Return, &[]),
        ];
        let head = Inst::new(Op::Function, &[linker.void(), 800, 0, linker.plain_function_type()]);
        let blocks = vec![Block { label: 1, code }];
        let mut function = Function { head, parameters: Vec::new(), blocks };
        check_behind(&mut linker, &donor, &mut function, REPORTED);
        let [report, ended, stays] = function.blocks.as_slice() else { unreachable!("{function:?}") };
        let ops: Vec<Op> = report.code.iter().map(|inst| inst.op).collect();
        assert_eq!(ops, [Op::FunctionCall, Op::Load, Op::SelectionMerge, Op::BranchConditional]);
        assert_eq!(report.terminator().unwrap().operands[1..], [ended.label, stays.label]);
        assert_eq!(ended.code, [Inst::new(Op::Return, &[])]);
        assert_eq!(stays.code, [store, Inst::new(Op::Return, &[])]);
    }
}
