//! Headers of loops, whose code moves to a block of its own before the block is split: the way back leads to the block that has the merge
//! instruction.

use ::spirv::Op;

use super::instruction::Inst;
use super::linker::Linker;
use super::module::{Block, Function};

/// True for a block that heads no loop, and for a header whose code can move to a block of its own.
pub(super) fn can_leave_header(function: &Function, at: usize) -> bool {
    let block = &function.blocks[at];
    let Some(merge) = block.merge().filter(|inst| inst.op == Op::LoopMerge) else { return true };
    let exits = [merge.operand(0), merge.operand(1)];
    let leaves = block.terminator().is_some_and(|inst| {
        inst.op == Op::Branch || [1, 2].iter().any(|place| exits.contains(&inst.operand(*place)))
    });
    leaves && !exits.contains(&block.label)
}

/// Moves the code of a loop's header to a block of its own, whose index is the result. Other blocks stay.
pub(super) fn leave_loop_header(linker: &mut Linker, function: &mut Function, at: usize) -> usize {
    let Some(merge) = function.blocks[at].merge().filter(|inst| inst.op == Op::LoopMerge).cloned() else {
        return at;
    };
    let label = function.blocks[at].label;
    let code = std::mem::take(&mut function.blocks[at].code);
    let (phis, mut rest): (Vec<Inst>, Vec<Inst>) = code.into_iter().partition(|inst| inst.op == Op::Phi);
    rest.retain(|inst| inst.op != Op::LoopMerge);
    let behind = linker.new_id();
    function.blocks[at].code = phis;
    function.blocks[at].code.extend([merge, Inst::new(Op::Branch, &[behind])]);
    function.rename_predecessor(label, behind);
    function.blocks.insert(at + 1, Block { label: behind, code: rest });
    at + 1
}
