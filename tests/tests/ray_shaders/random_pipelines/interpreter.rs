//! Interprets random pipelines: the semantics of traces and callable shaders, in Rust.

use super::program::{
    Condition, ELEMENTS, MAX_CALLABLE_DEPTH, MAX_DEPTH, Operand, Operation, Pipeline, Shader, Statement,
    VARIABLES,
};

/// The record of a shader: kind and index give its number.
pub fn record(kind: u32, index: usize) -> u32 {
    1000 * kind + 10 * index as u32 + 3
}

/// Returns the result of an invocation of the ray generation shader.
pub fn run(pipeline: &Pipeline, launch: u32) -> u32 {
    let mut invocation = Invocation {
        pipeline,
        shader: &pipeline.ray_gen,
        launch,
        builtin: launch,
        record: record(0, 0),
        global: 17,
        depth: 0,
        calls: 0,
    };
    invocation.shade(launch)
}

struct Invocation<'a> {
    pipeline: &'a Pipeline,
    shader: &'a Shader,
    launch: u32,
    builtin: u32,
    record: u32,
    global: u32,
    depth: u32,
    calls: u32,
}

/// What a call of a function has for itself.
struct Locals {
    variables: [u32; VARIABLES],
    array: [u32; ELEMENTS],
}

/// How a list of statements ended.
enum End {
    Next,
    Return(u32),
}

impl Invocation<'_> {
    /// Runs the main function.
    fn shade(&mut self, value: u32) -> u32 {
        let result = self.call(self.shader.functions.len() - 1, value);
        result.wrapping_add(self.global)
    }

    fn call(&mut self, function: usize, argument: u32) -> u32 {
        let mut locals = Locals { variables: [argument, argument.wrapping_add(1), 7], array: [0; ELEMENTS] };
        let body = &self.shader.functions[function];
        match self.statements(body, &mut locals) {
            End::Return(value) => value,
            _ => {
                let [first, second, third] = locals.variables;
                first ^ second.wrapping_mul(3) ^ third ^ locals.array[1]
            }
        }
    }

    fn statements(&mut self, statements: &[Statement], locals: &mut Locals) -> End {
        for statement in statements {
            match self.statement(statement, locals) {
                End::Next => {}
                end => return end,
            }
        }
        End::Next
    }

    fn statement(&mut self, statement: &Statement, locals: &mut Locals) -> End {
        let holds = |condition: &Condition, v: &[u32; VARIABLES]| {
            v[condition.variable].is_multiple_of(condition.divisor)
        };
        let v = &mut locals.variables;
        match statement {
            Statement::Set(target, operation, operand) => {
                let operand = match operand {
                    Operand::Variable(index) => v[*index],
                    Operand::Constant(value) => *value,
                    Operand::BuiltIn => self.builtin,
                    Operand::Record => self.record,
                    Operand::Global => self.global,
                    Operand::Element(index) => locals.array[v[*index] as usize % ELEMENTS],
                };
                v[*target] = match operation {
                    Operation::Add => v[*target].wrapping_add(operand),
                    Operation::Multiply => v[*target].wrapping_mul(operand),
                    Operation::Xor => v[*target] ^ operand,
                };
            }
            Statement::SetGlobal(variable) => self.global ^= v[*variable],
            Statement::SetElement(index, variable) => {
                let element = &mut locals.array[v[*index] as usize % ELEMENTS];
                *element = element.wrapping_add(v[*variable]);
            }
            Statement::If(condition, yes, no) => {
                return self.statements(if holds(condition, v) { yes } else { no }, locals);
            }
            Statement::Loop(count, body, leave, skip) => {
                for index in 0..*count {
                    if skip.is_some_and(|condition| holds(&condition, &locals.variables)) {
                        locals.variables[2] = locals.variables[2].wrapping_add(1);
                        continue;
                    }
                    match self.statements(body, locals) {
                        End::Next => {}
                        end => return end,
                    }
                    if leave.is_some_and(|condition| holds(&condition, &locals.variables)) {
                        break;
                    }
                    locals.variables[1] = locals.variables[1].wrapping_add(index);
                }
            }
            Statement::Switch(variable, cases) => {
                let chosen = match v[*variable] % 3 {
                    0 => 0..2,
                    1 => 1..2,
                    _ => 2..3,
                };
                for case in chosen {
                    match self.statements(&cases[case], locals) {
                        End::Next => {}
                        end => return end,
                    }
                }
            }
            Statement::Trace(variable) => v[*variable] = self.trace(v[*variable], false),
            Statement::TraceShadow(variable) => v[*variable] = self.trace(v[*variable], true),
            Statement::Callable(variable) => v[*variable] = self.callable(v[*variable]),
            Statement::Call(function, variable) => v[*variable] = self.call(*function, v[*variable]),
            Statement::ReturnIf(condition) if holds(condition, v) => {
                return End::Return(v[0].wrapping_add(v[1]));
            }
            Statement::ReturnIf(_) => {}
        }
        End::Next
    }

    fn trace(&self, value: u32, skips_closest_hit: bool) -> u32 {
        if self.depth >= MAX_DEPTH {
            return value.wrapping_mul(3);
        }
        let (hits, misses) = (self.pipeline.hits.len(), self.pipeline.misses.len());
        let target = value as usize % (hits + misses);
        if skips_closest_hit && target < hits {
            return value;
        }
        let (shader, record, builtin) = match target.checked_sub(hits) {
            // The ray starts one unit in front of the triangle.
            None => (&self.pipeline.hits[target], record(2, target), target as u32 + 1 + self.launch),
            Some(miss) => (&self.pipeline.misses[miss], record(1, miss), self.launch + 10),
        };
        let (depth, calls) = (self.depth + 1, 0);
        Invocation { shader, record, builtin, depth, calls, global: 17, ..*self }.shade(value)
    }

    fn callable(&self, value: u32) -> u32 {
        if self.calls >= MAX_CALLABLE_DEPTH {
            return value.wrapping_mul(5);
        }
        let index = value as usize % self.pipeline.callables.len();
        let (shader, record) = (&self.pipeline.callables[index], record(3, index));
        let calls = self.calls + 1;
        Invocation { shader, record, builtin: self.launch, depth: 0, calls, global: 17, ..*self }.shade(value)
    }
}
