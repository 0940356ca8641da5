//! Interprets random pipelines: the semantics of traces and callable shaders, in Rust.

use std::cell::Cell;

use super::candidates::{Candidate, Hit};
use super::program::{
    Condition, ELEMENTS, Field, Loop, LoopForm, MAX_CALLABLE_DEPTH, MAX_DEPTH, Operand, Operation, Pipeline,
    Place, Ray, STRUCT_WORDS, STRUCTS, Shader, Signature, Statement, Test, VARIABLES, Value,
};

/// Most statements and values of an invocation of the ray generation shader.
const MOST_STEPS: u32 = 20_000;

/// The record of a shader: kind and index give its number.
pub fn record(kind: u32, index: usize) -> u32 {
    1000 * kind + 10 * index as u32 + 3
}

/// Returns the result of an invocation of the ray generation shader; `None` if it takes too many steps.
pub fn run(pipeline: &Pipeline, launch: u32) -> Option<u32> {
    let mut invocation = Invocation {
        pipeline,
        steps: &Cell::new(0),
        shader: &pipeline.ray_gen,
        launch,
        builtin: launch,
        record: record(0, 0),
        global: 17,
        depth: 0,
        calls: 0,
        candidate: Candidate::None,
    };
    invocation.shade(launch).ok()
}

/// An invocation of a shader.
pub struct Invocation<'a> {
    pub pipeline: &'a Pipeline,
    pub steps: &'a Cell<u32>,
    pub shader: &'a Shader,
    pub launch: u32,
    pub builtin: u32,
    pub record: u32,
    pub global: u32,
    pub depth: u32,
    pub calls: u32,
    /// What an any-hit or intersection shader judges.
    pub candidate: Candidate<'a>,
}

/// What a call of a function has for itself.
struct Locals {
    variables: [u32; VARIABLES],
    array: [u32; ELEMENTS],
    flag: u32,
    weight: u32,
    vector: [u32; 3],
    matrix: [u32; 2],
    own: [u32; STRUCT_WORDS],
    structs: [[u32; STRUCT_WORDS]; STRUCTS],
}

/// How a list of statements ended.
enum End {
    Next,
    Break,
    Continue,
    Return(u32),
}

/// Why a shader ended in one of its functions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Leave {
    /// The candidate is ignored.
    Ignored,
    /// The ray ends.
    Ended,
    /// The pipeline takes too many steps.
    TooLong,
}

impl Invocation<'_> {
    /// Runs the main function.
    pub fn shade(&mut self, value: u32) -> Result<u32, Leave> {
        let (result, _) = self.call(self.shader.functions.len() - 1, [value, 7], [0; STRUCT_WORDS])?;
        Ok(result.wrapping_add(self.global))
    }

    fn count_step(&self) -> Result<(), Leave> {
        self.steps.set(self.steps.get() + 1);
        if self.steps.get() > MOST_STEPS { Err(Leave::TooLong) } else { Ok(()) }
    }

    /// Runs a function with values of the first and the last variable and of the struct. Returns its result, and its variables.
    fn call(
        &mut self,
        function: usize,
        [first, last]: [u32; 2],
        own: [u32; STRUCT_WORDS],
    ) -> Result<(u32, Locals), Leave> {
        let mut locals = Locals {
            variables: [first, first.wrapping_add(1), last],
            array: [0; ELEMENTS],
            flag: 0,
            weight: 0,
            vector: [0; 3],
            matrix: [0; 2],
            own,
            structs: [[0; STRUCT_WORDS]; STRUCTS],
        };
        let body = &self.shader.functions[function].body;
        let result = match self.statements(body, &mut locals)? {
            End::Return(value) => value,
            _ => {
                let [first, second, third] = locals.variables;
                let others = locals.array[1] ^ locals.weight ^ locals.own[0] ^ (7 * locals.flag);
                first ^ second.wrapping_mul(3) ^ third ^ others
            }
        };
        Ok((result, locals))
    }

    fn statements(&mut self, statements: &[Statement], locals: &mut Locals) -> Result<End, Leave> {
        for statement in statements {
            match self.statement(statement, locals)? {
                End::Next => {}
                end => return Ok(end),
            }
        }
        Ok(End::Next)
    }

    fn statement(&mut self, statement: &Statement, locals: &mut Locals) -> Result<End, Leave> {
        self.count_step()?;
        match statement {
            Statement::Set(target, operation, value) => {
                let before = locals.variables[*target];
                let value = self.value(value, locals)?;
                locals.variables[*target] = operate(*operation, before, value);
            }
            Statement::Assign(target, value) => locals.variables[*target] = self.value(value, locals)?,
            Statement::SetGlobal(variable) => self.global ^= locals.variables[*variable],
            Statement::Keep(place, index, value) => {
                let index = locals.variables[*index];
                let value = self.value(value, locals)?;
                let (word, divisor) = locals.place(*place, index);
                *word = divisor.map_or(value, |divisor| value % divisor);
            }
            Statement::CopyStruct(index, is_from_array) => {
                let element = &mut locals.structs[locals.variables[*index] as usize % STRUCTS];
                if *is_from_array {
                    locals.own = *element;
                } else {
                    *element = locals.own;
                }
            }
            Statement::If(test, yes, no) => {
                let body = if self.test(test, locals)? { yes } else { no };
                return self.statements(body, locals);
            }
            Statement::Loop(inner) => return self.repeat(inner, locals),
            Statement::Switch(value, divisor, cases) => {
                let value = self.value(value, locals)? % divisor;
                let chosen = cases.iter().position(|case| case.label == Some(value));
                let chosen = chosen.or_else(|| cases.iter().position(|case| case.label.is_none()));
                for case in &cases[chosen.unwrap_or(cases.len())..] {
                    match self.statements(&case.body, locals)? {
                        End::Next if case.falls_through => {}
                        End::Next | End::Break => break,
                        end => return Ok(end),
                    }
                }
            }
            Statement::Trace(ray, variable) => {
                locals.variables[*variable] = self.trace(locals.variables[*variable], *ray)?;
            }
            Statement::Call(function, variable) => {
                let argument = locals.variables[*variable];
                let (result, callee) = self.call(*function, [argument, 7], locals.own)?;
                if self.shader.functions[*function].signature == Signature::Struct {
                    locals.own = callee.own;
                    locals.own[0] ^= result;
                } else {
                    locals.variables[*variable] = result;
                }
            }
            Statement::ReturnIf(test) => {
                if self.test(test, locals)? {
                    return Ok(End::Return(locals.early_result()));
                }
            }
            Statement::ContinueIf(test) => {
                if self.test(test, locals)? {
                    locals.variables[2] = locals.variables[2].wrapping_add(1);
                    return Ok(End::Continue);
                }
            }
            Statement::BreakIf(test) => {
                if self.test(test, locals)? {
                    return Ok(End::Break);
                }
            }
            Statement::Return(value) => return Ok(End::Return(self.value(value, locals)?)),
            Statement::Continue => return Ok(End::Continue),
            Statement::Break => return Ok(End::Break),
            Statement::IgnoreIf(test) => {
                if self.test(test, locals)? {
                    return Err(Leave::Ignored);
                }
            }
            Statement::TerminateIf(test) => {
                if self.test(test, locals)? && matches!(self.candidate, Candidate::Hit { is_first: true }) {
                    return Err(Leave::Ended);
                }
            }
            Statement::Report(variable) => {
                let before = locals.variables[*variable];
                locals.variables[*variable] = match self.report(before)? {
                    Some(limit) => before.wrapping_add(limit),
                    None => before ^ 5,
                };
            }
        }
        Ok(End::Next)
    }

    fn repeat(&mut self, inner: &Loop, locals: &mut Locals) -> Result<End, Leave> {
        let mut index = 0;
        loop {
            self.count_step()?;
            let goes_on = match inner.form {
                LoopForm::For => index < inner.count && self.loop_test(inner, locals)?,
                LoopForm::While => {
                    index += 1;
                    index <= inner.count && self.loop_test(inner, locals)?
                }
                LoopForm::Endless => index < inner.count,
                LoopForm::WhileTrue => {
                    index += 1;
                    index <= inner.count
                }
                LoopForm::DoWhile => true,
            };
            let is_endless = matches!(inner.form, LoopForm::Endless | LoopForm::WhileTrue);
            if !goes_on {
                let returns = is_endless && inner.returns;
                return Ok(if returns { End::Return(locals.early_result()) } else { End::Next });
            }
            match self.statements(&inner.body, locals)? {
                End::Next => locals.variables[1] = locals.variables[1].wrapping_add(index),
                End::Continue => {}
                End::Break => return Ok(End::Next),
                end => return Ok(end),
            }
            match inner.form {
                LoopForm::For | LoopForm::Endless => {
                    index += 1;
                    if let Some((variable, value)) = &inner.step {
                        locals.variables[*variable] = self.value(value, locals)?;
                    }
                }
                LoopForm::DoWhile => {
                    index += 1;
                    if !(index < inner.count && self.loop_test(inner, locals)?) {
                        return Ok(End::Next);
                    }
                }
                LoopForm::While | LoopForm::WhileTrue => {}
            }
        }
    }

    fn loop_test(&mut self, inner: &Loop, locals: &mut Locals) -> Result<bool, Leave> {
        inner.test.as_ref().map_or(Ok(true), |test| self.test(test, locals))
    }

    fn test(&mut self, test: &Test, locals: &mut Locals) -> Result<bool, Leave> {
        Ok(match test {
            Test::Variable(Condition { variable, divisor }) => {
                locals.variables[*variable].is_multiple_of(*divisor)
            }
            Test::Flag => locals.flag == 1,
            Test::Not(inner) => !self.test(inner, locals)?,
            Test::Both(first, second) => self.test(first, locals)? && self.test(second, locals)?,
            Test::Either(first, second) => self.test(first, locals)? || self.test(second, locals)?,
            Test::Divides(value, divisor) => self.value(value, locals)?.is_multiple_of(*divisor),
            Test::Report(variable) => self.report(locals.variables[*variable])?.is_some(),
        })
    }

    fn value(&mut self, value: &Value, locals: &mut Locals) -> Result<u32, Leave> {
        self.count_step()?;
        Ok(match value {
            Value::Operand(operand) => self.operand(*operand, locals),
            Value::Operation(operation, operand, value) => {
                let first = self.operand(*operand, locals);
                operate(*operation, first, self.value(value, locals)?)
            }
            Value::Trace(ray, value) => {
                let value = self.value(value, locals)?;
                self.trace(value, *ray)?
            }
            Value::Callable(value) => {
                let value = self.value(value, locals)?;
                self.callable(value)?
            }
            Value::Call(function, argument, variable) => {
                let argument = self.value(argument, locals)?;
                let signature = self.shader.functions[*function].signature;
                let last = if signature == Signature::InOut { locals.variables[*variable] } else { 7 };
                let own = if signature == Signature::InOutStruct { locals.own } else { [0; STRUCT_WORDS] };
                let (result, callee) = self.call(*function, [argument, last], own)?;
                match signature {
                    Signature::InOut | Signature::Out => locals.variables[*variable] = callee.variables[2],
                    Signature::InOutStruct => locals.own = callee.own,
                    Signature::Bool => return Ok(if result % 2 == 0 { 21 } else { 4 }),
                    _ => {}
                }
                result
            }
            Value::Choice(test, yes, no) => {
                let chosen = if self.test(test, locals)? { yes } else { no };
                self.value(chosen, locals)?
            }
        })
    }

    fn operand(&self, operand: Operand, locals: &mut Locals) -> u32 {
        match operand {
            Operand::Variable(index) => locals.variables[index],
            Operand::Constant(value) => value,
            Operand::BuiltIn => self.builtin,
            Operand::Record => self.record,
            Operand::Global => self.global,
            Operand::Place(place, index) => *locals.place(place, locals.variables[index]).0,
        }
    }

    fn trace(&mut self, value: u32, ray: Ray) -> Result<u32, Leave> {
        self.count_step()?;
        if self.depth >= MAX_DEPTH {
            return Ok(value.wrapping_mul(3));
        }
        let (hits, misses) = (self.pipeline.hits.len(), self.pipeline.misses.len());
        let target = value as usize % (hits + misses);
        let hit = if target < hits { self.first_hit(target, value, ray)? } else { None };
        let (shader, record, builtin) = match hit {
            Some(_) if ray == Ray::Shadow => return Ok(value),
            Some(Hit { closest_hit: None, .. }) => return Ok(value),
            Some(Hit { closest_hit: Some(shader), group, builtin }) => {
                (shader, record(2, group), builtin.wrapping_add(self.launch))
            }
            None => {
                let miss = target.saturating_sub(hits);
                (&self.pipeline.misses[miss], record(1, miss), self.launch + 10)
            }
        };
        let (depth, calls, candidate) = (self.depth + 1, 0, Candidate::None);
        Invocation { shader, record, builtin, depth, calls, global: 17, candidate, ..*self }.shade(value)
    }

    fn callable(&self, value: u32) -> Result<u32, Leave> {
        self.count_step()?;
        if self.calls >= MAX_CALLABLE_DEPTH {
            return Ok(value.wrapping_mul(5));
        }
        let index = value as usize % self.pipeline.callables.len();
        let (shader, record) = (&self.pipeline.callables[index], record(3, index));
        let (builtin, depth, calls, candidate) = (self.launch, 0, self.calls + 1, Candidate::None);
        Invocation { shader, record, builtin, depth, calls, global: 17, candidate, ..*self }.shade(value)
    }
}

impl Locals {
    /// The result of a function that returns early.
    fn early_result(&self) -> u32 {
        self.variables[0].wrapping_add(self.variables[1])
    }

    /// Returns the word of a place, and the divisor of values that are written to it.
    fn place(&mut self, place: Place, index: u32) -> (&mut u32, Option<u32>) {
        let at = |length: usize| index as usize % length;
        match place {
            Place::Element => (&mut self.array[at(ELEMENTS)], None),
            Place::Flag => (&mut self.flag, Some(2)),
            Place::Weight => (&mut self.weight, Some(4096)),
            Place::Vector => (&mut self.vector[at(3)], None),
            Place::Matrix => (&mut self.matrix[at(2)], Some(4096)),
            Place::Struct(field) => member(&mut self.own, field, index),
            Place::Structs(field) => member(&mut self.structs[at(STRUCTS)], field, index),
        }
    }
}

fn member(words: &mut [u32; STRUCT_WORDS], field: Field, index: u32) -> (&mut u32, Option<u32>) {
    let index = index as usize;
    match field {
        Field::Number => (&mut words[0], None),
        Field::Flag => (&mut words[1], Some(2)),
        Field::Weights => (&mut words[2 + index % 2], Some(4096)),
        Field::Inner => (&mut words[4], None),
        Field::InnerFloat => (&mut words[5], Some(4096)),
        Field::Vector => (&mut words[6 + index % 3], None),
        Field::Matrix => (&mut words[9 + index % 2], Some(4096)),
    }
}

fn operate(operation: Operation, first: u32, second: u32) -> u32 {
    match operation {
        Operation::Add => first.wrapping_add(second),
        Operation::Multiply => first.wrapping_mul(second),
        Operation::Xor => first ^ second,
    }
}
