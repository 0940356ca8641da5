//! Inlines functions into their callers.

use std::collections::{HashMap, HashSet};

use ::spirv::Op;

use super::demote::declare_variable;
use super::instruction::{Inst, for_each_id};
use super::linker::Linker;
use super::module::{Block, Function};

/// Inlines every call of the functions in `wanted`, and calls within them, into `function`.
///
/// Returns of an inlined function branch to the code behind the call, from wherever they stand.
///
/// The error is a message.
pub(super) fn inline_calls(
    linker: &mut Linker,
    function: &mut Function,
    wanted: &HashSet<u32>,
) -> Result<(), String> {
    let mut start = 0;
    while let Some((block, place)) = find_call(function, wanted, start) {
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

/// Finds the first call of a wanted function in the blocks from `start` on.
fn find_call(function: &Function, wanted: &HashSet<u32>, start: usize) -> Option<(usize, usize)> {
    let is_call = |inst: &Inst| inst.op == Op::FunctionCall && wanted.contains(&inst.operand(2));
    function
        .blocks
        .iter()
        .enumerate()
        .skip(start)
        .find_map(|(block, Block { code, .. })| code.iter().position(is_call).map(|place| (block, place)))
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
    let mut ids: HashMap<u32, u32> = HashMap::new();
    for (parameter, argument) in callee.parameters.iter().zip(&call.operands[3..]) {
        ids.insert(parameter.operand(1), *argument);
    }
    for block in &callee.blocks {
        for id in block.code.iter().filter_map(Inst::result).chain([block.label]) {
            ids.insert(id, linker.new_id());
        }
    }
    let wide = &linker.module.wide;
    let renamed = |id: u32| ids.get(&id).copied().unwrap_or(id);
    for block in &mut callee.blocks {
        block.label = renamed(block.label);
        for inst in &mut block.code {
            let _ = for_each_id(inst, wide, |id| *id = renamed(*id));
        }
    }
    let wide: Vec<u32> = wide.iter().filter_map(|id| ids.get(id)).copied().collect();
    linker.module.wide.extend(wide);
    linker.copy_decorations(&ids);
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
