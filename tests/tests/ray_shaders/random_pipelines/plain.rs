//! Random pipelines of the simplest forms, which lavapipe's own ray tracing pipelines compute correctly for the seeds of the test.

use super::generator::{condition, one_in, operation};
use super::program::{
    Case, Function, Group, Loop, LoopForm, Operand, Pipeline, Ray, Shader, Signature, Statement, Test,
    VARIABLES, Value,
};
use lvk_tests::random::Random;

/// Calls that a kind of shader may have.
#[derive(Clone, Copy)]
struct Allowed {
    traces: bool,
    callables: bool,
}

/// Returns the pipeline of a seed.
pub fn plain_pipeline(seed: u64) -> Pipeline {
    let mut random = Random::new(seed);
    // Few pipelines have traces or calls in all kinds of shaders.
    let (traces, callables) = (!one_in(&mut random, 3), !one_in(&mut random, 2));
    let allowed = Allowed { traces, callables };
    let nested = Allowed { traces: false, callables: !one_in(&mut random, 2) };
    let shaders = |random: &mut Random, most, allowed| -> Vec<Shader> {
        let count = 1 + random.bits() % most;
        (0..count).map(|_| shader(random, allowed)).collect()
    };
    let ray_gen = shader(&mut random, Allowed { traces: true, callables: true });
    let misses = shaders(&mut random, 2, allowed);
    let hits = shaders(&mut random, 3, allowed);
    let group = |closest_hit| Group { closest_hit, any_hit: None, intersection: None };
    Pipeline {
        ray_gen,
        misses,
        hits: hits.into_iter().map(group).collect(),
        behind: None,
        callables: shaders(&mut random, 2, nested),
        traces_in_place: seed % 2 == 1,
    }
}

fn shader(random: &mut Random, allowed: Allowed) -> Shader {
    let count = 1 + (random.bits() % 3) as usize;
    // Waits multiply along calls and loops, so each function has few.
    let function = |index| {
        let mut waits = 2;
        let body = statements(random, allowed, index, 3, &mut waits);
        Function { signature: Signature::Plain, body }
    };
    Shader { functions: (0..count).map(function).collect() }
}

fn statements(
    random: &mut Random,
    allowed: Allowed,
    callees: usize,
    nesting: u32,
    waits: &mut u32,
) -> Vec<Statement> {
    let count = 2 + random.bits() % 3;
    (0..count).map(|_| statement(random, allowed, callees, nesting, waits)).collect()
}

fn statement(
    random: &mut Random,
    allowed: Allowed,
    callees: usize,
    nesting: u32,
    waits: &mut u32,
) -> Statement {
    let variable = random.bits() as usize % VARIABLES;
    let mut inner = |random: &mut Random| match nesting {
        0 => Vec::new(),
        _ => statements(random, allowed, callees, nesting - 1, waits),
    };
    let argument = || Box::new(Value::Operand(Operand::Variable(variable)));
    match random.bits() % 12 {
        0 if nesting > 0 => {
            let condition = condition(random);
            let yes = inner(random);
            let no = if one_in(random, 2) { inner(random) } else { Vec::new() };
            Statement::If(Test::Variable(condition), yes, no)
        }
        1 if nesting > 0 => {
            let mut body = inner(random);
            let maybe = |random: &mut Random| one_in(random, 3).then(|| Test::Variable(condition(random)));
            let count = 1 + (random.bits() % 2) as u32;
            body.extend(maybe(random).map(Statement::BreakIf));
            let skip = maybe(random).map(Statement::ContinueIf);
            let body = skip.into_iter().chain(body).collect();
            let (form, test, step, returns) = (LoopForm::For, None, None, false);
            Statement::Loop(Box::new(Loop { form, count, test, step, returns, body }))
        }
        2 if nesting > 0 => {
            let case = |label, body, falls_through| Case { label, body, falls_through };
            let cases = vec![
                case(Some(0), inner(random), true),
                case(Some(1), inner(random), false),
                case(None, inner(random), false),
            ];
            Statement::Switch(*argument(), 3, cases)
        }
        3 => Statement::ReturnIf(Test::Variable(condition(random))),
        4 => Statement::SetGlobal(variable),
        5 | 6 if allowed.traces && *waits > 0 => {
            *waits -= 1;
            Statement::Trace(Ray::Closest, variable)
        }
        7 if allowed.callables && *waits > 0 => {
            *waits -= 1;
            Statement::Assign(variable, Value::Callable(argument()))
        }
        8 if callees > 0 && *waits > 0 => {
            *waits -= 1;
            let callee = random.bits() as usize % callees;
            Statement::Assign(variable, Value::Call(callee, argument(), 0))
        }
        _ => Statement::Set(variable, operation(random), Value::Operand(operand(random))),
    }
}

fn operand(random: &mut Random) -> Operand {
    match random.bits() % 6 {
        0 | 1 => Operand::Variable(random.bits() as usize % VARIABLES),
        2 => Operand::BuiltIn,
        3 => Operand::Record,
        4 => Operand::Global,
        _ => Operand::Constant((random.bits() >> 32) as u32),
    }
}
