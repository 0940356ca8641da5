//! Takes a function apart at the rays that it traces: each piece becomes a case of a switch over states.

use std::collections::{HashMap, HashSet};

use ::spirv::Op;

use super::control_flow::{Construct, ControlFlow, branch_targets};
use super::demote::demote_values;
use super::emit::Emitter;
use super::instruction::{Inst, for_each_id};
use super::linker::Linker;
use super::liveness::live_at_starts;
use super::module::{Block, Function};
use super::promote::{is_register, promote_variables};
use super::simplify::simplify;
use super::slots::Slots;
use super::split_structs::split_structs;
use super::switches::check_cases;
use super::traces::{is_trace, skips_closest_hit};

/// Values of the state that are no pieces of functions.
pub(super) mod state {
    /// The invocation is done.
    pub(in super::super) const DONE: u32 = 0;
    /// A ray waits to be traced.
    pub(in super::super) const TRACE: u32 = 1;
    /// A callable shader waits to be called.
    pub(in super::super) const CALL: u32 = 2;
    /// The first piece of a function.
    pub(in super::super) const FIRST: u32 = 3;
}

/// The variables and constants of the loop that runs the pieces.
#[derive(Debug, Clone)]
pub(super) struct StateMachine {
    /// The state: see [`state`].
    pub(super) state: u32,
    /// Number of functions that wait for a ray or a callable shader.
    pub(super) depth: u32,
    /// States that these functions go on with.
    pub(super) resume: u32,
    /// Most functions that may wait. The array of states has one element more.
    pub(super) max_depth: u32,
    /// Label of the block behind the switch over the pieces.
    pub(super) next: u32,
    /// The number of the next piece.
    pub(super) next_state: u32,
    /// Hold what the next piece reads.
    pub(super) slots: Slots,
    /// Hold what functions read behind the rays and callable shaders that they wait for, by depth.
    pub(super) stacks: Slots,
}

impl StateMachine {
    /// Returns the depth of the function that has begun to wait last.
    fn emit_last_depth(&self, emitter: &mut Emitter<'_>) -> u32 {
        let uint = emitter.linker.uint();
        let depth = emitter.load(self.depth);
        let one = emitter.linker.constant(1);
        emitter.value(Op::ISub, uint, &[depth, one])
    }

    /// Makes the function that has begun to wait last go on.
    pub(super) fn emit_resume(&self, emitter: &mut Emitter<'_>) {
        let uint = emitter.linker.uint();
        let last = self.emit_last_depth(emitter);
        let place = element(emitter, self.resume, uint, last);
        let resumed = emitter.value(Op::Load, uint, &[place]);
        emitter.store(self.state, resumed);
    }
}

/// The pieces of a function.
pub(super) struct FlattenedFunction {
    /// The state that the function starts with.
    pub(super) entry: u32,
    /// States with the labels of their first blocks.
    pub(super) cases: Vec<(u32, u32)>,
    pub(super) blocks: Vec<Block>,
    /// Variables of the function.
    pub(super) variables: Vec<Inst>,
    /// Variables of the invocation that give the function values, and that only its first piece reads.
    pub(super) replaced: Vec<u32>,
}

/// The shader that the pieces belong to.
pub(super) struct ShaderFrame<'a> {
    /// True for the ray generation shader, which runs once: nothing else writes its variables.
    pub(super) runs_once: bool,
    /// Variables of the shader outside of functions.
    pub(super) own: &'a [u32],
    /// True if miss shaders wait for rays or callable shaders.
    pub(super) misses_wait: bool,
    /// Variables of the invocation that give the function values, and that only its first piece reads.
    pub(super) replaced: Vec<u32>,
}

impl ShaderFrame<'_> {
    /// True for a trace that runs only shaders that do not wait.
    fn returns_directly(&self, inst: &Inst) -> bool {
        skips_closest_hit(inst) && !self.misses_wait
    }
}

/// Takes `function` apart where it waits. The error is a message.
pub(super) fn flatten(
    linker: &mut Linker,
    machine: &mut StateMachine,
    mut function: Function,
    frame: ShaderFrame<'_>,
    is_wait: &dyn Fn(&Inst) -> bool,
) -> Result<FlattenedFunction, String> {
    split_structs(linker, &mut function);
    promote_variables(linker, &mut function);
    simplify(linker, &mut function);
    let cuts = split_at_waits(linker, &mut function, is_wait);
    demote_values(linker, &mut function)?;
    let flow = ControlFlow::new(&function);
    let is_cut = |block: usize| cuts.contains(&function.blocks[block].label);
    let whole = flow.whole_constructs(&function, &is_cut);
    let live = live_variables(linker, &function, &flow, &frame);
    check_kept(linker, &function, &flow, &cuts, &live)?;
    let mut flattener = Flattener {
        linker,
        machine,
        function: &function,
        flow: &flow,
        whole,
        live,
        frame: &frame,
        cuts: &cuts,
        states: HashMap::new(),
        waiting: Vec::new(),
        blocks: Vec::new(),
        cases: Vec::new(),
    };
    let entry = flattener.state_of(0);
    while let Some((block, state)) = flattener.waiting.pop() {
        check_cases(flattener.machine.next_state as usize)?;
        flattener.emit_state(block, state);
    }
    let (blocks, cases) = (flattener.blocks, flattener.cases);
    let is_variable = |inst: &&Inst| inst.op == Op::Variable;
    let variables = function.code().filter(is_variable).cloned().collect();
    Ok(FlattenedFunction { entry, cases, blocks, variables, replaced: frame.replaced })
}

/// Ends a block behind each instruction at which the function waits, and returns the labels of these blocks.
fn split_at_waits(
    linker: &mut Linker,
    function: &mut Function,
    is_wait: &dyn Fn(&Inst) -> bool,
) -> HashSet<u32> {
    let mut cuts = HashSet::new();
    let mut at = 0;
    while at < function.blocks.len() {
        let code = &mut function.blocks[at].code;
        if let Some(place) = code.iter().position(is_wait) {
            let rest = code.split_off(place + 1);
            let label = linker.new_id();
            code.push(Inst::new(Op::Branch, &[label]));
            let old = function.blocks[at].label;
            cuts.insert(old);
            function.rename_predecessor(old, label);
            function.blocks.insert(at + 1, Block { label, code: rest });
        }
        at += 1;
    }
    cuts
}

/// Returns the variables that each block reads itself or leaves to later ones; none for a function that runs once, whose
/// variables stay.
fn live_variables(
    linker: &Linker,
    function: &Function,
    flow: &ControlFlow,
    frame: &ShaderFrame<'_>,
) -> Vec<Vec<u32>> {
    if frame.runs_once {
        return vec![Vec::new(); function.blocks.len()];
    }
    let locals = function.code().filter(|inst| inst.op == Op::Variable).filter_map(Inst::result);
    let variables: HashSet<u32> = locals.chain(frame.own.iter().copied()).collect();
    let sorted = |set: HashSet<u32>| {
        let mut list: Vec<u32> = set.into_iter().collect();
        list.sort_unstable();
        list
    };
    live_at_starts(linker, function, flow, &variables).into_iter().map(sorted).collect()
}

/// Fails for a variable that no stack can hold, and whose value is needed behind a wait. The error is a message.
fn check_kept(
    linker: &Linker,
    function: &Function,
    flow: &ControlFlow,
    cuts: &HashSet<u32>,
    live: &[Vec<u32>],
) -> Result<(), String> {
    let waiting = (0..function.blocks.len()).filter(|block| cuts.contains(&function.blocks[*block].label));
    let mut kept = waiting.flat_map(|block| &flow.successors[block]).flat_map(|behind| &live[*behind]);
    if kept.any(|variable| !linker.can_store(variable_type(linker, function, *variable))) {
        return Err(
            "a ray query that goes on behind OpTraceRayKHR or OpExecuteCallableKHR cannot be lowered here; \
                    start the query behind"
                .to_owned(),
        );
    }
    Ok(())
}

/// Returns the type of a variable of the function or of the shader.
fn variable_type(linker: &Linker, function: &Function, variable: u32) -> u32 {
    let is_it = |inst: &&Inst| inst.op == Op::Variable && inst.operand(1) == variable;
    let local = function.blocks.first().and_then(|block| block.code.iter().find(is_it));
    match local {
        Some(inst) => linker.pointer(inst.operand(0)).map_or(0, |(_, target)| target),
        None => linker.variable_type(variable).unwrap_or(0),
    }
}

struct Flattener<'a> {
    linker: &'a mut Linker,
    machine: &'a mut StateMachine,
    function: &'a Function,
    flow: &'a ControlFlow,
    whole: HashMap<usize, Construct>,
    live: Vec<Vec<u32>>,
    frame: &'a ShaderFrame<'a>,
    cuts: &'a HashSet<u32>,
    /// States of blocks that start a piece.
    states: HashMap<usize, u32>,
    /// Pieces that are not written yet.
    waiting: Vec<(usize, u32)>,
    blocks: Vec<Block>,
    cases: Vec<(u32, u32)>,
}

impl Flattener<'_> {
    /// Returns the state that starts with a block.
    fn state_of(&mut self, block: usize) -> u32 {
        if let Some(known) = self.states.get(&block) {
            return *known;
        }
        let state = self.machine.next_state;
        self.machine.next_state += 1;
        self.states.insert(block, state);
        self.waiting.push((block, state));
        state
    }

    /// Writes the piece that starts with a block.
    fn emit_state(&mut self, block: usize, state: u32) {
        let label = self.linker.new_id();
        self.cases.push((state, label));
        let mut code = Vec::new();
        self.restore(block, &mut code);
        // The block may be the start of a whole loop, whose header must have the label of the block.
        code.push(Inst::new(Op::Branch, &[self.function.blocks[block].label]));
        self.blocks.push(Block { label, code });
        self.emit_chain(block);
    }

    /// Writes a block and those that follow it in the same piece.
    fn emit_chain(&mut self, first: usize) {
        let mut next = Some(first);
        while let Some(block) = next {
            next = match self.whole.get(&block).cloned() {
                Some(construct) => self.emit_construct(block, &construct),
                None => self.emit_block(block),
            };
        }
    }

    /// Writes a construct in one piece. Returns the block that follows in the same piece.
    fn emit_construct(&mut self, header: usize, construct: &Construct) -> Option<usize> {
        let inside: HashSet<usize> =
            construct.members.iter().copied().chain([header, construct.merge]).collect();
        let first = self.blocks.len();
        for block in std::iter::once(header).chain(construct.members.iter().copied()) {
            let Block { label, code } = self.function.blocks[block].clone();
            let code = without_variables(code);
            self.blocks.push(Block { label, code });
        }
        if !self.is_entered_from_outside(construct.merge, &inside) {
            return Some(construct.merge);
        }
        // Others branch to the merge block too, so it is a piece. The construct ends in a block that leads there.
        let end = self.linker.new_id();
        let merge_label = self.function.blocks[construct.merge].label;
        for block in &mut self.blocks[first..] {
            for inst in &mut block.code {
                let _ = for_each_id(inst, &HashSet::new(), |id| {
                    if *id == merge_label {
                        *id = end;
                    }
                });
            }
        }
        let mut code = Vec::new();
        self.go_to(construct.merge, &mut code);
        self.blocks.push(Block { label: end, code });
        None
    }

    /// True if a block is reached from blocks that are not in `inside`.
    fn is_entered_from_outside(&self, block: usize, inside: &HashSet<usize>) -> bool {
        self.flow.predecessors[block].iter().any(|from| !inside.contains(from))
    }

    /// True if only `from` leads to `to`, apart from the way back to the start of a whole loop.
    fn follows(&self, from: usize, to: usize) -> bool {
        let members = self.whole.get(&to).map_or(&[][..], |construct| &construct.members);
        let inside: HashSet<usize> = members.iter().copied().chain([from, to]).collect();
        self.flow.predecessors[to].contains(&from)
            && !self.states.contains_key(&to)
            && !self.is_entered_from_outside(to, &inside)
    }

    /// Writes a block that is no part of a construct. Returns the block that follows in the same piece.
    fn emit_block(&mut self, block: usize) -> Option<usize> {
        let Block { label, code } = self.function.blocks[block].clone();
        let mut code = without_variables(code);
        let last = code.pop()?;
        if self.function.blocks[block].merge().is_some() {
            code.pop();
        }
        let mut follows = None;
        match last.op {
            Op::Branch if self.cuts.contains(&label) => self.emit_trace(block, &mut code),
            Op::Branch => {
                let to = self.flow.successors[block].first().copied().unwrap_or(0);
                if self.follows(block, to) {
                    code.push(last);
                    follows = Some(to);
                } else {
                    self.go_to(to, &mut code);
                }
            }
            Op::BranchConditional | Op::Switch => {
                self.emit_selection(label, code, last);
                return None;
            }
            Op::Return => self.emit_return(&mut code),
            _ => code.push(last),
        }
        self.blocks.push(Block { label, code });
        follows
    }

    /// Goes on with the piece that starts with a block.
    fn go_to(&mut self, block: usize, code: &mut Vec<Inst>) {
        self.choose(block, code);
        code.push(Inst::new(Op::Branch, &[self.machine.next]));
    }

    /// Makes the piece that starts with a block the next one.
    fn choose(&mut self, block: usize, code: &mut Vec<Inst>) {
        let state = self.state_of(block);
        self.keep_values(block, None, code);
        Emitter::new(self.linker, code).store_number(self.machine.state, state);
    }

    /// Writes a branch or a switch whose targets are other pieces.
    fn emit_selection(&mut self, label: u32, mut code: Vec<Inst>, mut selection: Inst) {
        let end = self.linker.new_id();
        let mut labels: HashMap<u32, u32> = HashMap::new();
        let mut cases = Vec::new();
        for target in branch_targets(&selection) {
            labels.entry(target).or_insert_with(|| {
                let new = self.linker.new_id();
                cases.push((target, new));
                new
            });
        }
        // The labels of a switch stand behind its selector and its literals; those of a branch behind its condition.
        let places: Vec<usize> = match selection.op {
            Op::Switch => std::iter::once(1).chain((3..selection.operands.len()).step_by(2)).collect(),
            _ => vec![1, 2],
        };
        for place in places {
            selection.operands[place] = labels[&selection.operands[place]];
        }
        code.push(Inst::new(Op::SelectionMerge, &[end, 0]));
        code.push(selection);
        self.blocks.push(Block { label, code });
        for (target, label) in cases {
            let block = self.flow.index_of(target).unwrap_or(0);
            let mut code = Vec::new();
            self.choose(block, &mut code);
            code.push(Inst::new(Op::Branch, &[end]));
            self.blocks.push(Block { label, code });
        }
        self.blocks.push(Block { label: end, code: vec![Inst::new(Op::Branch, &[self.machine.next])] });
    }

    /// Ends a piece at a return of the function.
    fn emit_return(&mut self, code: &mut Vec<Inst>) {
        let machine = self.machine.clone();
        let mut emitter = Emitter::new(self.linker, code);
        if self.frame.runs_once {
            emitter.store_number(machine.state, state::DONE);
        } else {
            machine.emit_resume(&mut emitter);
        }
        emitter.push(Op::Branch, &[machine.next]);
    }

    /// Ends a piece at a trace: keeps what the function needs behind the trace, and the state that goes on there.
    fn emit_trace(&mut self, block: usize, code: &mut Vec<Inst>) {
        let is_ray = code.pop().is_some_and(|inst| is_trace(&inst));
        let waits_for = if is_ray { state::TRACE } else { state::CALL };
        let behind = self.flow.successors[block].first().copied().unwrap_or(0);
        let resumed = self.state_of(behind);
        let (uint, bool) = (self.linker.uint(), self.linker.bool());
        let depth = Emitter::new(self.linker, code).load(self.machine.depth);
        let stack_depth = Some(depth).filter(|_| !self.returns_directly(block));
        self.keep_values(behind, stack_depth, code);
        let machine = self.machine.clone();
        let mut emitter = Emitter::new(self.linker, code);
        let place = element(&mut emitter, machine.resume, uint, depth);
        emitter.store_number(place, resumed);
        let one = emitter.linker.constant(1);
        let deeper = emitter.value(Op::IAdd, uint, &[depth, one]);
        emitter.store(machine.depth, deeper);
        // A trace deeper than the pipeline's limit returns at once.
        let limit = emitter.linker.constant(machine.max_depth);
        let fits = emitter.value(Op::ULessThan, bool, &[depth, limit]);
        let [go, back] = [waits_for, resumed].map(|state| emitter.linker.constant(state));
        let state = emitter.value(Op::Select, uint, &[fits, go, back]);
        emitter.store(machine.state, state);
        emitter.push(Op::Branch, &[machine.next]);
    }

    /// True for a block that ends at a trace that no closest-hit shader, and so not this function again, may follow.
    fn returns_directly(&self, block: usize) -> bool {
        self.function.blocks[block]
            .code
            .iter()
            .rev()
            .nth(1)
            .is_some_and(|inst| self.frame.returns_directly(inst))
    }

    /// Gives the variables that a piece reads their values, at its start.
    fn restore(&mut self, block: usize, code: &mut Vec<Inst>) {
        let from = self.flow.predecessors[block].first().copied();
        let waited = from.filter(|from| self.cuts.contains(&self.function.blocks[*from].label));
        let mut stack_depth = None;
        if let Some(from) = waited {
            let mut emitter = Emitter::new(self.linker, code);
            let depth = self.machine.emit_last_depth(&mut emitter);
            emitter.store(self.machine.depth, depth);
            stack_depth = Some(depth).filter(|_| !self.returns_directly(from));
        }
        for Kept { variable, place, ty } in self.kept_for(block, stack_depth) {
            let mut emitter = Emitter::new(self.linker, code);
            let place = place.emit_pointer(&mut emitter, ty);
            let value = emitter.value(Op::Load, ty, &[place]);
            emitter.store(variable, value);
        }
    }

    /// Keeps what a piece reads, in slots or at a depth of the stacks.
    fn keep_values(&mut self, block: usize, stack_depth: Option<u32>, code: &mut Vec<Inst>) {
        for Kept { variable, place, ty } in self.kept_for(block, stack_depth) {
            let mut emitter = Emitter::new(self.linker, code);
            let value = emitter.value(Op::Load, ty, &[variable]);
            let place = place.emit_pointer(&mut emitter, ty);
            emitter.store(place, value);
        }
    }

    /// Returns what is kept for a piece. Slots leave arrays, and variables that other functions use, where they are:
    /// nothing else writes them meanwhile.
    fn kept_for(&mut self, block: usize, stack_depth: Option<u32>) -> Vec<Kept> {
        let mut read = self.read_by(block);
        if stack_depth.is_none() {
            read.retain(|(variable, ty)| {
                self.linker.global(*variable).is_none() && is_register(self.linker, *ty)
            });
        }
        let types: Vec<u32> = read.iter().map(|(_, ty)| *ty).collect();
        let machine = &mut *self.machine;
        let slots = if stack_depth.is_some() { &mut machine.stacks } else { &mut machine.slots };
        let slots = slots.allocate(self.linker, &types);
        let kept = |((variable, ty), slot)| Kept { variable, place: Place { slot, stack_depth }, ty };
        read.into_iter().zip(slots).map(kept).collect()
    }

    /// Returns the variables that a piece and those behind it read, with their types. Nothing is left for the first.
    fn read_by(&self, block: usize) -> Vec<(u32, u32)> {
        let read = if block == 0 { &[][..] } else { &self.live[block] };
        read.iter()
            .map(|variable| (*variable, variable_type(self.linker, self.function, *variable)))
            .collect()
    }
}

/// A variable of a function whose value is kept while other code runs.
struct Kept {
    variable: u32,
    place: Place,
    ty: u32,
}

/// A slot, or an element of a stack.
struct Place {
    slot: u32,
    /// The index in the stack.
    stack_depth: Option<u32>,
}

impl Place {
    fn emit_pointer(&self, emitter: &mut Emitter<'_>, ty: u32) -> u32 {
        self.stack_depth.map_or(self.slot, |depth| element(emitter, self.slot, ty, depth))
    }
}

/// Returns a pointer to an element of an array of the invocation.
fn element(emitter: &mut Emitter<'_>, array: u32, ty: u32, index: u32) -> u32 {
    let pointer = emitter.linker.pointer_to(::spirv::StorageClass::Private, ty);
    emitter.value(Op::AccessChain, pointer, &[array, index])
}

fn without_variables(code: Vec<Inst>) -> Vec<Inst> {
    code.into_iter().filter(|inst| inst.op != Op::Variable).collect()
}
