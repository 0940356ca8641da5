//! Runs the blocks of a function in a loop, so that the function can be left from anywhere.

use std::collections::HashMap;

use ::spirv::Op;

use super::control_flow::ControlFlow;
use super::demote::{declare_variable, demote_values};
use super::emit::Emitter;
use super::instruction::Inst;
use super::linker::Linker;
use super::module::{Block, Function};
use super::switches::{check_cases, emit_choice};

/// Makes each block a case of a switch in a loop. No block but those of the loop has a merge instruction then, and a
/// return may stand behind any instruction. The error is a message.
pub(super) fn run_blocks_in_loop(linker: &mut Linker, function: &mut Function) -> Result<(), String> {
    demote_values(linker, function)?;
    let uint = linker.uint();
    let result_type = function.head.operand(0);
    let returns = result_type != linker.void();
    let result = returns.then(|| (declare_variable(linker, function, result_type), result_type));
    let next_block = declare_variable(linker, function, uint);
    let definitions = function.definitions();
    let order = ControlFlow::new(function).order;
    check_cases(order.len())?;
    let numbers = (0..).zip(&order).map(|(number, block)| (function.blocks[*block].label, number)).collect();
    let labels = Labels::new(linker);
    let mut cases = Cases { linker, definitions, next_block, result, numbers, end: labels.next };
    let mut variables = Vec::new();
    let mut bodies = Vec::new();
    for block in order {
        let Block { label, code } =
            std::mem::replace(&mut function.blocks[block], Block { label: 0, code: Vec::new() });
        let (own, code): (Vec<Inst>, Vec<Inst>) = code.into_iter().partition(|inst| inst.op == Op::Variable);
        variables.extend(own);
        bodies.push(Block { label, code: cases.body(code) });
    }
    let targets: Vec<u32> = (0..).zip(&bodies).flat_map(|(number, body)| [number, body.label]).collect();
    let done = cases.done();
    let mut blocks = loop_start(linker, &labels, variables, next_block, &targets);
    blocks.extend(bodies);
    blocks.extend(loop_end(linker, &labels, next_block, done, result));
    function.blocks = blocks;
    Ok(())
}

/// Labels of the loop's own blocks.
struct Labels {
    entry: u32,
    header: u32,
    choose: u32,
    /// Behind the switch.
    next: u32,
    back: u32,
    exit: u32,
}

impl Labels {
    fn new(linker: &mut Linker) -> Self {
        let [entry, header, choose, next, back, exit] = std::array::from_fn(|_| linker.new_id());
        Self { entry, header, choose, next, back, exit }
    }
}

/// Writes the blocks of the function as cases.
struct Cases<'a> {
    linker: &'a mut Linker,
    definitions: HashMap<u32, Inst>,
    /// Variable with the number of the next block.
    next_block: u32,
    /// Variable with the result of the function, and its type.
    result: Option<(u32, u32)>,
    /// Numbers of blocks by their labels.
    numbers: HashMap<u32, u32>,
    /// Label behind the switch.
    end: u32,
}

impl Cases<'_> {
    /// The number that ends the loop.
    fn done(&self) -> u32 {
        self.numbers.len() as u32
    }

    fn number(&self, label: u32) -> u32 {
        self.numbers.get(&label).copied().unwrap_or(0)
    }

    /// Returns the code of a block, which chooses the next block at its end.
    fn body(&mut self, mut code: Vec<Inst>) -> Vec<Inst> {
        code.retain(|inst| !matches!(inst.op, Op::LoopMerge | Op::SelectionMerge));
        let Some(last) = code.pop() else { return code };
        let done = self.done();
        let numbers: Vec<u32> = last.operands.iter().map(|label| self.number(*label)).collect();
        let selector = (last.operand(0), self.linker.value_type(&self.definitions, last.operand(0)));
        let mut emitter = Emitter::new(self.linker, &mut code);
        let uint = emitter.linker.uint();
        let next = match last.op {
            Op::Branch => emitter.linker.constant(numbers[0]),
            Op::BranchConditional => {
                let [yes, no] = [1, 2].map(|place| emitter.linker.constant(numbers[place]));
                emitter.value(Op::Select, uint, &[last.operand(0), yes, no])
            }
            Op::Switch => {
                let places = (2..last.operands.len().saturating_sub(1)).step_by(2);
                let targets = places.map(|at| (&last.operands[at..=at], numbers[at + 1]));
                emit_choice(&mut emitter, selector, targets, numbers[1])
            }
            Op::Return | Op::ReturnValue => {
                if let Some((result, _)) = self.result {
                    emitter.store(result, last.operand(0));
                }
                emitter.linker.constant(done)
            }
            _ => {
                code.push(last);
                return code;
            }
        };
        emitter.store(self.next_block, next);
        emitter.push(Op::Branch, &[self.end]);
        code
    }
}

/// Returns the blocks in front of the cases. `targets` are the numbers and labels of the cases.
fn loop_start(
    linker: &mut Linker,
    labels: &Labels,
    variables: Vec<Inst>,
    next_block: u32,
    targets: &[u32],
) -> Vec<Block> {
    let mut entry = variables;
    let mut emitter = Emitter::new(linker, &mut entry);
    emitter.store_number(next_block, 0);
    emitter.push(Op::Branch, &[labels.header]);
    let header = vec![
        Inst::new(Op::LoopMerge, &[labels.exit, labels.back, 0]),
        Inst::new(Op::Branch, &[labels.choose]),
    ];
    let mut choose = Vec::new();
    let mut emitter = Emitter::new(linker, &mut choose);
    let uint = emitter.linker.uint();
    let number = emitter.value(Op::Load, uint, &[next_block]);
    emitter.push(Op::SelectionMerge, &[labels.next, 0]);
    emitter.push(Op::Switch, &[&[number, labels.next], targets].concat());
    vec![
        Block { label: labels.entry, code: entry },
        Block { label: labels.header, code: header },
        Block { label: labels.choose, code: choose },
    ]
}

/// Returns the blocks behind the cases: the way back, and the return.
fn loop_end(
    linker: &mut Linker,
    labels: &Labels,
    next_block: u32,
    done: u32,
    result: Option<(u32, u32)>,
) -> [Block; 3] {
    let next = vec![Inst::new(Op::Branch, &[labels.back])];
    let mut back = Vec::new();
    let mut emitter = Emitter::new(linker, &mut back);
    let (uint, bool) = (emitter.linker.uint(), emitter.linker.bool());
    let number = emitter.value(Op::Load, uint, &[next_block]);
    let done = emitter.linker.constant(done);
    let is_done = emitter.value(Op::IEqual, bool, &[number, done]);
    emitter.push(Op::BranchConditional, &[is_done, labels.exit, labels.header]);
    let mut exit = Vec::new();
    match result {
        None => exit.push(Inst::new(Op::Return, &[])),
        Some((variable, ty)) => {
            let mut emitter = Emitter::new(linker, &mut exit);
            let value = emitter.value(Op::Load, ty, &[variable]);
            emitter.push(Op::ReturnValue, &[value]);
        }
    }
    [
        Block { label: labels.next, code: next },
        Block { label: labels.back, code: back },
        Block { label: labels.exit, code: exit },
    ]
}
