//! Assembles the compute shader of a launch from its linked shaders.

use std::collections::{BTreeMap, HashMap};

use ::spirv::Op;

use super::calls::{Call, RecordPlace, Shared};
use super::control_flow::ControlFlow;
use super::emit::Emitter;
use super::flatten::{FlattenedFunction, ShaderFrame, StateMachine, flatten, state};
use super::inline::inline_calls;
use super::instruction::{Inst, used_ids};
use super::linker::Linker;
use super::localize::{forget_locals, localize};
use super::module::{Block, Function, functions_that_reach};
use super::passed::Passed;
use super::shaders::Shaders;
use super::slots::Slots;
use super::stack_size::check_stacks;
use super::stage::Shader;
use super::traces::{RAY_FLAG_SKIP_CLOSEST_HIT, TraceVariables, skips_closest_hit};
use super::{Lowering, LoweringError};
use crate::shader::ShaderStage;

/// Most places of a ray generation shader that trace without a loop over states. Each place has a copy of the traversal,
/// with the constants of the place. Two copies are faster than the loop, on GPUs and on CPUs; a third is not.
const MOST_WAITS_WITHOUT_MACHINE: u32 = 2;
/// Most functions that forget what others were given, since the code grows by the square of their number.
const MOST_FORGOTTEN: usize = 32;

/// A region of the shader binding table.
struct Region {
    /// Variable with the address of the records.
    records: u32,
    /// Variable with the index of the record to call.
    index: u32,
    /// Distance between records in bytes.
    stride: u32,
    /// Number of records.
    count: usize,
}

/// Code for some values of a selector.
struct Case {
    values: Vec<u32>,
    code: Vec<Inst>,
}

/// Writes the functions that call shaders, and the main function.
pub(super) struct Assembly<'a> {
    pub(super) linker: &'a mut Linker,
    pub(super) lowering: &'a Lowering<'a>,
    pub(super) shaders: &'a Shaders,
    pub(super) variables: TraceVariables<'a>,
    pub(super) candidate_attributes: Passed,
    pub(super) committed_attributes: Passed,
    /// `None` if the launch traces from few places of its ray generation shader only.
    machine: Option<StateMachine>,
    /// First states of shaders that wait.
    entries: HashMap<usize, u32>,
    pieces: Vec<FlattenedFunction>,
}

/// The shader that records of a region call.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Target {
    shader: usize,
    is_triangle: bool,
}

/// True for a function whose code stays structured where it is called: it has one return, behind all loops and selections. The return of
/// an endless loop stands in the loop.
fn returns_at_its_end(function: &Function) -> bool {
    let returns = |block: &Block| {
        block.terminator().is_some_and(|inst| matches!(inst.op, Op::Return | Op::ReturnValue))
    };
    let places: Vec<usize> = (0..function.blocks.len()).filter(|at| returns(&function.blocks[*at])).collect();
    let [place] = *places else { return false };
    !ControlFlow::new(function).is_in_construct(function, place)
}

impl<'a> Assembly<'a> {
    pub(super) fn new(
        linker: &'a mut Linker,
        lowering: &'a Lowering<'a>,
        shaders: &'a Shaders,
        variables: TraceVariables<'a>,
        candidate_attributes: Passed,
    ) -> Self {
        Self {
            linker,
            lowering,
            shaders,
            variables,
            candidate_attributes,
            committed_attributes: Passed::default(),
            machine: None,
            entries: HashMap::new(),
            pieces: Vec::new(),
        }
    }

    /// Writes everything, and returns the main function.
    pub(super) fn assemble(&mut self) -> Result<u32, LoweringError> {
        self.write_judge_calls();
        forget_locals(self.linker);
        let needs_machine = self.needs_machine();
        if needs_machine {
            self.declare_machine();
            self.flatten_shaders()?;
        }
        let [miss, closest, callable] = [ShaderStage::Miss, ShaderStage::ClosestHit, ShaderStage::Callable]
            .map(|stage| self.write_shading(stage));
        let trace = self.write_trace(miss, Some(closest));
        // Closest-hit shaders may call this one: they would call themselves by the other.
        let shadow = self.write_trace(miss, None);
        self.call_in_place([trace, shadow], callable);
        Ok(if needs_machine { self.write_loop(trace, callable) } else { self.write_plain_main() })
    }

    /// True unless the ray generation shader alone waits, at few places.
    fn needs_machine(&self) -> bool {
        let ray_gen = self.lowering.ray_gen;
        let others = self.shaders.linked.keys().any(|index| *index != ray_gen && self.shaders.waits(*index));
        let places = self
            .shaders
            .linked
            .get(&ray_gen)
            .map_or(0, |shader| self.shaders.wait_count(self.linker, shader.entry));
        others || places > MOST_WAITS_WITHOUT_MACHINE || self.shaders.callables_wait
    }

    fn declare_machine(&mut self) {
        let callables = if self.shaders.callables_wait { self.lowering.max_callable_depth } else { 0 };
        let max_depth = self.lowering.max_recursion.saturating_add(callables);
        let uint = self.linker.uint();
        let array = self.linker.array(uint, max_depth + 1);
        self.machine = Some(StateMachine {
            state: self.linker.private(uint),
            depth: self.linker.private(uint),
            resume: self.linker.private(array),
            max_depth,
            next: self.linker.new_id(),
            next_state: state::FIRST,
            slots: Slots::default(),
            stacks: Slots::stacks(max_depth + 1),
        });
    }

    /// Takes all shaders that wait apart.
    fn flatten_shaders(&mut self) -> Result<(), LoweringError> {
        let mut waiting: Vec<usize> = self.shaders.linked.keys().copied().collect();
        waiting.retain(|index| *index == self.lowering.ray_gen || self.shaders.waits(*index));
        waiting.sort_unstable();
        for index in waiting {
            let shader = &self.shaders.linked[&index];
            let failed = |message| LoweringError { shader: shader.name.clone(), message };
            let own = self.own_variables(index, shader);
            let Some(mut function) = self.whole_function(shader, &own).map_err(failed)? else { continue };
            let given = own.iter().copied().filter(|variable| !shader.own.contains(variable));
            let given = given.chain(shader.initial.iter().map(|(variable, _)| *variable)).collect();
            let replaced = localize(self.linker, &mut function, &own, &given);
            let runs_once = index == self.lowering.ray_gen;
            let misses_wait = self.shaders.misses_wait(self.lowering);
            let frame = ShaderFrame { runs_once, own: &own, misses_wait, replaced };
            let Some(machine) = &mut self.machine else { continue };
            let is_wait = |inst: &Inst| self.shaders.is_wait(inst);
            let pieces = flatten(self.linker, machine, function, frame, &is_wait).map_err(failed)?;
            check_stacks(machine.stacks.bytes(self.linker), machine.max_depth + 1).map_err(failed)?;
            self.entries.insert(index, pieces.entry);
            self.pieces.push(pieces);
        }
        Ok(())
    }

    /// Returns the entry function of a shader with the functions in place that wait or that use variables of the shader.
    /// At its returns it leaves its results. The error is a message.
    fn whole_function(&mut self, shader: &Shader, own: &[u32]) -> Result<Option<Function>, String> {
        let Some(entry) = self.linker.function(shader.entry).cloned() else { return Ok(None) };
        let uses_own =
            |inst: &Inst| used_ids(inst, &self.linker.module.wide).iter().any(|id| own.contains(id));
        let functions = shader.functions.iter().filter_map(|id| self.linker.function(*id));
        let mut wanted = functions_that_reach(functions, uses_own);
        wanted.retain(|id| self.linker.function(*id).is_some_and(returns_at_its_end));
        wanted.extend(&self.shaders.waiting);
        let mut function = entry.clone();
        if inline_calls(self.linker, &mut function, &wanted, &self.shaders.waiting).is_err() {
            // The functions that wait must be in place. Those that use variables only had better be.
            function = entry;
            let waiting = &self.shaders.waiting;
            inline_calls(self.linker, &mut function, waiting, waiting)?;
        }
        let TraceVariables { payloads, callables, .. } = &mut self.variables;
        let results = shader.results(self.linker, payloads, callables);
        for block in &mut function.blocks {
            let Some(last) = block.code.pop_if(|inst| inst.op == Op::Return) else { continue };
            let mut emitter = Emitter::new(self.linker, &mut block.code);
            results.iter().for_each(|(own, result)| emitter.copy(*own, *result));
            block.code.push(last);
        }
        Ok(Some(function))
    }

    /// Returns the variables of a shader outside of its functions.
    fn own_variables(&self, index: usize, shader: &Shader) -> Vec<u32> {
        let interface = [shader.incoming_payload, shader.incoming_callable, shader.attributes];
        let builtins = shader.builtins.iter().map(|(_, variable)| *variable);
        let record = self.shaders.records.get(&index).copied();
        let own = shader.own.iter().copied();
        own.chain(interface.into_iter().flatten()).chain(builtins).chain(record).collect()
    }

    /// Writes the functions of the donor that call any-hit and intersection shaders.
    fn write_judge_calls(&mut self) {
        let donor = *self.variables.donor;
        for (stage, function) in
            [(ShaderStage::AnyHit, donor.call_any_hit), (ShaderStage::Intersection, donor.call_intersection)]
        {
            let mut code = Vec::new();
            if stage == ShaderStage::AnyHit {
                let no = self.linker.bool_constant(false);
                Emitter::new(self.linker, &mut code).store(donor.ignores, no);
            }
            let blocks = self.switch(code, stage);
            self.replace_function(function, blocks);
        }
        let shared: Vec<(u32, u32)> = {
            let committed = &mut self.committed_attributes;
            let linker = &mut *self.linker;
            self.candidate_attributes
                .all()
                .into_iter()
                .map(|from| (from, committed.variable(linker, from)))
                .collect()
        };
        let mut code = Vec::new();
        let mut emitter = Emitter::new(self.linker, &mut code);
        shared.into_iter().for_each(|(from, to)| emitter.copy(from, to));
        emitter.push(Op::Return, &[]);
        let label = self.linker.new_id();
        self.replace_function(donor.commit_attributes, vec![Block { label, code }]);
    }

    fn replace_function(&mut self, id: u32, blocks: Vec<Block>) {
        if let Some(function) = self.linker.function_mut(id) {
            function.blocks = blocks;
        }
    }

    /// Returns the region of the shader binding table with the shaders of a stage.
    fn region(&self, stage: ShaderStage) -> Region {
        let donor = self.variables.donor;
        let [miss, hit, callable] = self.lowering.strides;
        let (records, index, stride, count) = match stage {
            ShaderStage::Miss => (donor.miss_records, donor.ray_miss, miss, self.lowering.miss.len()),
            ShaderStage::Callable => {
                let index = self.variables.callable_index;
                (donor.callable_records, index, callable, self.lowering.callable.len())
            }
            _ => (donor.hit_records, donor.hit_group, hit, self.lowering.hit.len()),
        };
        Region { records, index, stride, count }
    }

    /// Returns the shaders of a stage, with the indices of their records.
    fn targets(&self, stage: ShaderStage) -> BTreeMap<Target, Vec<u32>> {
        let mut found: BTreeMap<Target, Vec<u32>> = BTreeMap::new();
        let mut add = |shader: Option<usize>, is_triangle, record: usize| {
            if let Some(shader) = shader {
                found.entry(Target { shader, is_triangle }).or_default().push(record as u32);
            }
        };
        match stage {
            ShaderStage::Miss | ShaderStage::Callable => {
                let is_miss = stage == ShaderStage::Miss;
                let shaders = if is_miss { self.lowering.miss } else { self.lowering.callable };
                shaders.iter().enumerate().for_each(|(at, shader)| add(Some(*shader), false, at));
            }
            _ => {
                for (at, group) in self.lowering.hit.iter().enumerate() {
                    let shader = match stage {
                        ShaderStage::ClosestHit => group.closest_hit,
                        ShaderStage::AnyHit => group.any_hit,
                        _ => group.intersection,
                    };
                    add(shader, group.intersection.is_none(), at);
                }
            }
        }
        found
    }

    /// Returns the code for the records of a stage.
    fn cases(&mut self, stage: ShaderStage) -> Vec<Case> {
        let Region { records: region, index, stride, .. } = self.region(stage);
        let mut cases = Vec::new();
        for (target, values) in self.targets(stage) {
            let Some(shader) = self.shaders.linked.get(&target.shader) else { continue };
            let call = Call {
                shader,
                stage,
                record_variable: self.shaders.records.get(&target.shader).copied(),
                place: RecordPlace { region, index: Some(index), stride },
                is_triangle: target.is_triangle,
            };
            let mut code = Vec::new();
            self.emit_call(&call, self.entries.get(&target.shader).copied(), &mut code);
            cases.push(Case { values, code });
        }
        cases
    }

    /// Calls a shader, or makes its first piece the next one if it waits.
    fn emit_call(&mut self, call: &Call<'_>, entry: Option<u32>, code: &mut Vec<Inst>) {
        let donor = *self.variables.donor;
        let mut shared = Shared {
            payloads: &mut self.variables.payloads,
            callables: &mut self.variables.callables,
            candidate_attributes: &mut self.candidate_attributes,
            committed_attributes: &mut self.committed_attributes,
        };
        let mut emitter = Emitter::new(self.linker, code);
        match (entry, &self.machine) {
            (Some(entry), Some(machine)) => {
                call.emit_start(&mut emitter, &donor, &mut shared);
                emitter.store_number(machine.state, entry);
            }
            _ => call.emit_whole(&mut emitter, &donor, &mut shared),
        }
    }

    /// Returns a function's blocks: `code`, and then the call of the record's shader of this stage.
    fn switch(&mut self, mut code: Vec<Inst>, stage: ShaderStage) -> Vec<Block> {
        let Region { index: selector, count, .. } = self.region(stage);
        let cases = self.cases(stage);
        let label = self.linker.new_id();
        let end = self.linker.new_id();
        if let [only] = cases.as_slice()
            && only.values.len() == count
        {
            code.extend(only.code.iter().cloned());
            code.push(Inst::new(Op::Return, &[]));
            return vec![Block { label, code }];
        }
        let returns = Block { label: end, code: vec![Inst::new(Op::Return, &[])] };
        let mut emitter = Emitter::new(self.linker, &mut code);
        let value = emitter.load(selector);
        let labels: Vec<u32> = cases.iter().map(|_| emitter.linker.new_id()).collect();
        let mut operands = vec![value, end];
        for (case, label) in cases.iter().zip(&labels) {
            operands.extend(case.values.iter().flat_map(|value| [*value, *label]));
        }
        emitter.push(Op::SelectionMerge, &[end, 0]);
        emitter.push(Op::Switch, &operands);
        let mut blocks = vec![Block { label, code }];
        for (mut case, label) in cases.into_iter().zip(labels) {
            case.code.push(Inst::new(Op::Branch, &[end]));
            blocks.push(Block { label, code: case.code });
        }
        blocks.push(returns);
        blocks
    }

    /// Writes the function that calls the miss, closest-hit or callable shader of a record, and returns it.
    fn write_shading(&mut self, stage: ShaderStage) -> u32 {
        let blocks = self.switch(Vec::new(), stage);
        let function = self.linker.new_id();
        self.linker.push_function(function, blocks);
        function
    }

    /// Writes the function that traces a ray and calls the shader of its result, and returns it. Without `closest` rays run no
    /// closest-hit shader.
    fn write_trace(&mut self, miss: u32, closest: Option<u32>) -> u32 {
        let donor = *self.variables.donor;
        let [start, hit, shade, shaded, missed, end] = [(); 6].map(|()| self.linker.new_id());
        let (uint, bool) = (self.linker.uint(), self.linker.bool());
        let jump = |to: u32| Inst::new(Op::Branch, &[to]);
        let mut code = [const { Vec::new() }; 3];
        let [first, of_hit, of_shade] = &mut code;
        let mut emitter = Emitter::new(self.linker, first);
        let given = self.pieces.iter().flat_map(|pieces| pieces.replaced.iter().copied());
        given.chain(donor.hit_values()).for_each(|variable| emitter.forget(variable));
        emitter.call(donor.traverse);
        let is_hit = emitter.load(donor.is_hit);
        emitter.push(Op::SelectionMerge, &[end, 0]);
        emitter.push(Op::BranchConditional, &[is_hit, hit, missed]);
        if let Some(closest) = closest {
            let mut emitter = Emitter::new(self.linker, of_hit);
            let flags = emitter.load(donor.ray_flags);
            let [skip, zero] = [RAY_FLAG_SKIP_CLOSEST_HIT, 0].map(|value| emitter.linker.constant(value));
            let skips = emitter.value(Op::BitwiseAnd, uint, &[flags, skip]);
            let shades = emitter.value(Op::IEqual, bool, &[skips, zero]);
            emitter.push(Op::SelectionMerge, &[shaded, 0]);
            emitter.push(Op::BranchConditional, &[shades, shade, shaded]);
            let mut emitter = Emitter::new(self.linker, of_shade);
            emitter.call(closest);
            emitter.code.push(jump(shaded));
        }
        let mut of_miss = Vec::new();
        Emitter::new(self.linker, &mut of_miss).call(miss);
        of_miss.push(jump(end));
        let [first, of_hit, of_shade] = code;
        let of_hits = match closest {
            Some(_) => vec![(hit, of_hit), (shade, of_shade), (shaded, vec![jump(end)])],
            None => vec![(hit, vec![jump(end)])],
        };
        let ends = [(missed, of_miss), (end, vec![Inst::new(Op::Return, &[])])];
        let blocks = std::iter::once((start, first)).chain(of_hits).chain(ends);
        let function = self.linker.new_id();
        self.linker.push_function(function, blocks.map(|(label, code)| Block { label, code }).collect());
        function
    }

    /// Replaces the bare instructions that no function waits at by calls: of `shadow` for rays that run no closest-hit shader.
    fn call_in_place(&mut self, [trace, shadow]: [u32; 2], callable: u32) {
        let void = self.linker.void();
        let mut next = self.linker.module.bound;
        let pieces = self.pieces.iter_mut().flat_map(|pieces| &mut pieces.blocks);
        let in_pieces = pieces.flat_map(|block| &mut block.code);
        let in_functions = self.linker.module.functions.iter_mut().flat_map(Function::code_mut);
        for inst in in_functions.chain(in_pieces) {
            let function = match inst.op {
                Op::TraceRayKHR if skips_closest_hit(inst) => shadow,
                Op::TraceRayKHR => trace,
                Op::ExecuteCallableKHR => callable,
                _ => continue,
            };
            *inst = Inst::new(Op::FunctionCall, &[void, next, function]);
            next = next.saturating_add(1);
        }
        self.linker.module.bound = next;
    }

    /// Starts the ray generation shader.
    fn ray_gen_call(&self) -> Option<Call<'a>> {
        let index = self.lowering.ray_gen;
        let region = self.variables.donor.ray_gen_record;
        Some(Call {
            shader: self.shaders.linked.get(&index)?,
            stage: ShaderStage::RayGen,
            record_variable: self.shaders.records.get(&index).copied(),
            place: RecordPlace { region, index: None, stride: 0 },
            is_triangle: false,
        })
    }

    /// Copies the inputs of the shader that do not change.
    fn emit_inputs(&mut self, code: &mut Vec<Inst>) {
        let mut inputs: Vec<(u32, u32)> =
            self.shaders.linked.values().flat_map(|shader| shader.inputs.iter().copied()).collect();
        inputs.sort_unstable();
        let mut emitter = Emitter::new(self.linker, code);
        inputs.into_iter().for_each(|(variable, input)| emitter.copy(input, variable));
    }

    /// Writes the first blocks of the main function: outside of the launch it ends.
    fn main_start(&mut self, body: u32, end: u32) -> Block {
        let label = self.linker.new_id();
        let bool = self.linker.bool();
        let mut code = Vec::new();
        let mut emitter = Emitter::new(self.linker, &mut code);
        let start = self.variables.donor.start;
        let is_inside = emitter.value(Op::FunctionCall, bool, &[start]);
        emitter.push(Op::SelectionMerge, &[end, 0]);
        emitter.push(Op::BranchConditional, &[is_inside, body, end]);
        Block { label, code }
    }

    /// Writes the main function of a launch without a loop over states.
    fn write_plain_main(&mut self) -> u32 {
        let [body, end] = [(); 2].map(|()| self.linker.new_id());
        let start = self.main_start(body, end);
        let mut code = Vec::new();
        self.emit_inputs(&mut code);
        if let Some(call) = self.ray_gen_call() {
            self.emit_call(&call, None, &mut code);
        }
        code.push(Inst::new(Op::Branch, &[end]));
        let last = Block { label: end, code: vec![Inst::new(Op::Return, &[])] };
        let function = self.linker.new_id();
        self.linker.push_function(function, vec![start, Block { label: body, code }, last]);
        function
    }

    /// Writes the main function of a launch with a loop over states: an inner loop runs pieces until all that is left is
    /// a trace or a call, and an outer loop traces.
    fn write_loop(&mut self, trace: u32, callable: u32) -> u32 {
        let Some(machine) = self.machine.clone() else { return 0 };
        let [body, end, outer, outer_next, inner, inner_next, check, run, idle, wait] =
            [(); 10].map(|()| self.linker.new_id());
        let jump = |to: u32| Inst::new(Op::Branch, &[to]);
        let bool = self.linker.bool();
        let mut start = self.main_start(body, end);
        let mut first = Vec::new();
        self.emit_inputs(&mut first);
        Emitter::new(self.linker, &mut first).store_number(machine.depth, 0);
        let entry = self.entries.get(&self.lowering.ray_gen).copied();
        if let Some(call) = self.ray_gen_call() {
            self.emit_call(&call, entry, &mut first);
        }
        first.push(jump(outer));
        let outer_end = self.linker.new_id();
        let outer_head = vec![Inst::new(Op::LoopMerge, &[outer_end, outer_next, 0]), jump(inner)];
        let inner_head = vec![Inst::new(Op::LoopMerge, &[idle, inner_next, 0]), jump(check)];
        let mut of_check = Vec::new();
        let mut emitter = Emitter::new(self.linker, &mut of_check);
        let now = emitter.load(machine.state);
        let least = emitter.linker.constant(state::FIRST);
        let is_piece = emitter.value(Op::UGreaterThanEqual, bool, &[now, least]);
        emitter.push(Op::BranchConditional, &[is_piece, run, idle]);
        let mut of_run = Vec::new();
        let mut emitter = Emitter::new(self.linker, &mut of_run);
        let now = emitter.load(machine.state);
        let mut operands = vec![now, machine.next];
        let cases = self.pieces.iter().flat_map(|pieces| &pieces.cases);
        operands.extend(cases.flat_map(|(state, label)| [*state, *label]));
        emitter.push(Op::SelectionMerge, &[machine.next, 0]);
        emitter.push(Op::Switch, &operands);
        let mut of_idle = Vec::new();
        let mut emitter = Emitter::new(self.linker, &mut of_idle);
        let now = emitter.load(machine.state);
        let done = emitter.linker.constant(state::DONE);
        let is_done = emitter.value(Op::IEqual, bool, &[now, done]);
        emitter.push(Op::BranchConditional, &[is_done, outer_end, wait]);
        let waits = self.write_waits(wait, outer_next, trace, callable, &machine);
        let mut pieces = std::mem::take(&mut self.pieces);
        self.forget_at_starts(&machine, &mut pieces);
        let variables = pieces.iter_mut().flat_map(|pieces| std::mem::take(&mut pieces.variables));
        start.code.splice(0..0, variables);
        let plain = |(label, code)| Block { label, code };
        let head =
            [(body, first), (outer, outer_head), (inner, inner_head), (check, of_check), (run, of_run)];
        let tail = [(machine.next, vec![jump(inner_next)]), (inner_next, vec![jump(inner)]), (idle, of_idle)];
        let last = [
            (outer_next, vec![jump(outer)]),
            (outer_end, vec![jump(end)]),
            (end, vec![Inst::new(Op::Return, &[])]),
        ];
        let mut blocks = vec![start];
        blocks.extend(head.map(plain));
        blocks.extend(pieces.into_iter().flat_map(|pieces| pieces.blocks));
        blocks.extend(tail.map(plain));
        blocks.extend(waits);
        blocks.extend(last.map(plain));
        let function = self.linker.new_id();
        self.linker.push_function(function, blocks);
        function
    }

    /// Makes each piece forget at its start what no piece reads behind that: slots, and what shaders were given.
    fn forget_at_starts(&mut self, machine: &StateMachine, pieces: &mut [FlattenedFunction]) {
        let count = if pieces.len() > MOST_FORGOTTEN { 0 } else { pieces.len() };
        let given: Vec<(u32, Vec<u32>)> =
            pieces[..count].iter().map(|function| (function.entry, function.replaced.clone())).collect();
        for function in pieces {
            let starts: HashMap<u32, u32> =
                function.cases.iter().map(|(state, label)| (*label, *state)).collect();
            for block in &mut function.blocks {
                let Some(state) = starts.get(&block.label) else { continue };
                let Some(last) = block.code.pop() else { continue };
                let mut emitter = Emitter::new(self.linker, &mut block.code);
                machine.slots.forget(&mut emitter);
                let given = given.iter().filter(|(entry, _)| entry != state);
                given.flat_map(|(_, variables)| variables).for_each(|variable| emitter.forget(*variable));
                block.code.push(last);
            }
        }
    }

    /// Writes the blocks that trace a ray or call a callable shader, after which the function that waits goes on unless
    /// the called shader waits itself.
    fn write_waits(
        &mut self,
        label: u32,
        next: u32,
        trace: u32,
        callable: u32,
        machine: &StateMachine,
    ) -> Vec<Block> {
        let bool = self.linker.bool();
        let [traces, calls, waited] = [(); 3].map(|()| self.linker.new_id());
        let mut code = Vec::new();
        let mut emitter = Emitter::new(self.linker, &mut code);
        let now = emitter.load(machine.state);
        machine.emit_resume(&mut emitter);
        if !self.shaders.callables_wait {
            emitter.call(trace);
            emitter.push(Op::Branch, &[next]);
            return vec![Block { label, code }];
        }
        let wanted = emitter.linker.constant(state::TRACE);
        let is_trace = emitter.value(Op::IEqual, bool, &[now, wanted]);
        emitter.push(Op::SelectionMerge, &[waited, 0]);
        emitter.push(Op::BranchConditional, &[is_trace, traces, calls]);
        let mut blocks = vec![Block { label, code }];
        for (label, function) in [(traces, trace), (calls, callable)] {
            let mut code = Vec::new();
            let mut emitter = Emitter::new(self.linker, &mut code);
            emitter.call(function);
            emitter.push(Op::Branch, &[waited]);
            blocks.push(Block { label, code });
        }
        blocks.push(Block { label: waited, code: vec![Inst::new(Op::Branch, &[next])] });
        blocks
    }
}
