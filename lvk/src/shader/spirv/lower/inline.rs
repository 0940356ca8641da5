//! Inlines functions into their callers.

use std::collections::HashSet;

use ::spirv::Op;

use super::demote::declare_variable;
use super::instruction::{Inst, for_each_id};
use super::linker::{IdMap, Linker};
use super::loop_headers::{can_leave_header, leave_loop_header};
use super::module::{Block, Function};

/// Inlines every call of the functions in `wanted`, and calls within them, into `function`.
///
/// Returns of an inlined function branch to the code behind the call, from wherever they stand. Functions in `waiting`, which are among
/// those in `wanted`, are inlined everywhere; others not in headers of loops whose code cannot leave them.
///
/// The error is a message.
pub(super) fn inline_calls(
    linker: &mut Linker,
    function: &mut Function,
    wanted: &HashSet<u32>,
    waiting: &HashSet<u32>,
) -> Result<(), String> {
    let mut start = 0;
    while let Some(block) = block_with_call(function, wanted, waiting, start) {
        let block = leave_loop_header(linker, function, block);
        let Some(place) = function.blocks[block].code.iter().position(|inst| is_call(inst, wanted)) else {
            break;
        };
        // Blocks before that one have no more calls.
        start = block;
        let callee = function.blocks[block].code[place].operand(2);
        let Some(callee) = linker.function(callee).cloned() else { break };
        inline_call(linker, function, (block, place), callee);
        let blocks = function.blocks.len();
        if blocks > MOST_BLOCKS {
            return Err(format!(
                "functions that trace rays call each other too often: OpFunctionCall in place makes more than {MOST_BLOCKS} blocks"
            ));
        }
    }
    Ok(())
}

/// Most blocks of a function with its calls in place.
const MOST_BLOCKS: usize = 16_384;

fn is_call(inst: &Inst, wanted: &HashSet<u32>) -> bool {
    inst.op == Op::FunctionCall && wanted.contains(&inst.operand(2))
}

/// Finds the first block from `start` on that calls a wanted function. A call in the header of a loop counts if its code can leave the
/// header, or if the function waits, so that the loop does not stay whole.
fn block_with_call(
    function: &Function,
    wanted: &HashSet<u32>,
    waiting: &HashSet<u32>,
    start: usize,
) -> Option<usize> {
    let has_call = |at: &usize| {
        let calls = if can_leave_header(function, *at) { wanted } else { waiting };
        function.blocks[*at].code.iter().any(|inst| is_call(inst, calls))
    };
    (start..function.blocks.len()).find(has_call)
}

fn inline_call(
    linker: &mut Linker,
    function: &mut Function,
    (block, place): (usize, usize),
    mut callee: Function,
) {
    let mut rest = function.blocks[block].code.split_off(place);
    let call = rest.remove(0);
    let behind = linker.new_id();
    function.rename_predecessor(function.blocks[block].label, behind);
    let result = declare_result(linker, function, &call);
    rename_ids(linker, &mut callee, &call);
    let first = callee.blocks.first().map_or(behind, |block| block.label);
    move_variables(linker, function, &mut callee, block);
    for part in &mut callee.blocks {
        return_to(part, behind, result);
    }
    function.blocks[block].code.push(Inst::new(Op::Branch, &[first]));
    if let Some(result) = result {
        rest.insert(0, Inst::new(Op::Load, &[call.operand(0), call.operand(1), result]));
    }
    callee.blocks.push(Block { label: behind, code: rest });
    function.blocks.splice(block + 1..block + 1, callee.blocks);
}

/// Declares the variable that holds the result of a call; `None` for a call without one.
fn declare_result(linker: &mut Linker, function: &mut Function, call: &Inst) -> Option<u32> {
    if call.operand(0) == linker.void() {
        return None;
    }
    Some(declare_variable(linker, function, call.operand(0)))
}

/// Gives the callee new ids, and the arguments in place of its parameters.
fn rename_ids(linker: &mut Linker, callee: &mut Function, call: &Inst) {
    let parameters = callee.parameters.iter().map(|parameter| parameter.operand(1));
    let arguments: IdMap = parameters.zip(call.operands[3..].iter().copied()).collect();
    let mut copies = IdMap::new();
    for block in &callee.blocks {
        for id in block.code.iter().filter_map(Inst::result).chain([block.label]) {
            copies.insert(id, linker.new_id());
        }
    }
    let wide = &linker.module.wide;
    let renamed = |id: u32| copies.get(&id).or_else(|| arguments.get(&id)).copied().unwrap_or(id);
    for block in &mut callee.blocks {
        block.label = renamed(block.label);
        for inst in &mut block.code {
            let _ = for_each_id(inst, wide, |id| *id = renamed(*id));
        }
    }
    let wide: Vec<u32> = wide.iter().filter_map(|id| copies.get(id)).copied().collect();
    linker.module.wide.extend(wide);
    linker.copy_decorations(&copies);
    linker.copy_parameter_decorations(&arguments);
}

/// Moves the variables of the callee to the start of the caller. Where the call was, they become undefined: nothing that an earlier
/// call has left is read. The callee stores their initial values.
fn move_variables(linker: &mut Linker, function: &mut Function, callee: &mut Function, block: usize) {
    let Some(first) = callee.blocks.first_mut() else { return };
    let (variables, rest): (Vec<Inst>, Vec<Inst>) =
        std::mem::take(&mut first.code).into_iter().partition(|inst| inst.op == Op::Variable);
    first.code = rest;
    for variable in variables {
        let target = linker.pointer(variable.operand(0)).map_or(0, |(_, target)| target);
        if !linker.can_store(target) {
            function.blocks[0].code.insert(0, variable);
            continue;
        }
        let undefined = linker.new_id();
        function.blocks[block].code.push(Inst::new(Op::Undef, &[target, undefined]));
        function.blocks[block].code.push(Inst::new(Op::Store, &[variable.operand(1), undefined]));
        function.blocks[0].code.insert(0, variable);
    }
}

/// Makes the returns of a block store the result and branch to `behind`.
fn return_to(block: &mut Block, behind: u32, result: Option<u32>) {
    let value = match block.terminator() {
        Some(inst) if inst.op == Op::Return => None,
        Some(inst) if inst.op == Op::ReturnValue => Some(inst.operand(0)),
        _ => return,
    };
    block.code.pop();
    if let (Some(variable), Some(value)) = (result, value) {
        block.code.push(Inst::new(Op::Store, &[variable, value]));
    }
    block.code.push(Inst::new(Op::Branch, &[behind]));
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The function 20 calls the function 10, which does nothing, in the header of a loop: blocks 21, the header 22, 23 and 24.
    fn caller(linker: &mut Linker) -> Function {
        linker.module.bound = 100;
        let block = |label, code| Block { label, code };
        let branch = |to| Inst::new(Op::Branch, &[to]);
        linker.push_function(10, vec![block(11, vec![Inst::new(Op::Return, &[])])]);
        let void = linker.void();
        let header = vec![
            Inst::new(Op::FunctionCall, &[void, 30, 10]),
            Inst::new(Op::LoopMerge, &[24, 23, 0]),
            Inst::new(Op::BranchConditional, &[31, 23, 24]),
        ];
        Function {
            head: Inst::new(Op::Function, &[void, 20, 0, 32]),
            parameters: Vec::new(),
            blocks: vec![
                block(21, vec![branch(22)]),
                block(22, header),
                block(23, vec![branch(22)]),
                block(24, vec![Inst::new(Op::Return, &[])]),
            ],
        }
    }

    #[test]
    fn the_way_back_of_a_loop_leads_to_its_merge_instruction_behind_a_call_in_its_header()
    -> Result<(), String> {
        let mut linker = Linker::new(0x0001_0600);
        let mut function = caller(&mut linker);
        inline_calls(&mut linker, &mut function, &HashSet::from([10]), &HashSet::new())?;
        assert!(function.code().all(|inst| inst.op != Op::FunctionCall));
        let header = function.blocks.iter().find(|block| block.label == 22);
        let merge = header.and_then(Block::merge).map(|inst| inst.op);
        assert_eq!(merge, Some(Op::LoopMerge));
        Ok(())
    }

    #[test]
    fn calls_stay_in_headers_that_their_code_cannot_leave_unless_the_function_waits() -> Result<(), String> {
        let (called, none) = (HashSet::from([10]), HashSet::new());
        for (waiting, stays) in [(&none, true), (&called, false)] {
            let mut linker = Linker::new(0x0001_0600);
            let mut function = caller(&mut linker);
            // Neither way leaves the loop.
            if let Some(branch) = function.blocks[1].code.last_mut() {
                *branch = Inst::new(Op::BranchConditional, &[31, 25, 26]);
            }
            inline_calls(&mut linker, &mut function, &called, waiting)?;
            assert_eq!(function.code().any(|inst| inst.op == Op::FunctionCall), stays);
        }
        Ok(())
    }
}
