//! Random pipelines: shaders as statements over four numbers.

use lvk_tests::random::Random;

/// Numbers of variables that each function has.
pub const VARIABLES: usize = 3;
/// Elements of the array that each function has, which are 0 at first.
pub const ELEMENTS: usize = 3;
/// Deepest recursion of traces.
pub const MAX_DEPTH: u32 = 4;
/// Deepest nesting of callable shaders.
pub const MAX_CALLABLE_DEPTH: u32 = 2;

/// An operand.
#[derive(Debug, Clone, Copy)]
pub enum Operand {
    /// A variable of the function.
    Variable(usize),
    /// A constant.
    Constant(u32),
    /// A number that differs from launch to launch and from hit to hit.
    BuiltIn,
    /// The number in the shader's record.
    Record,
    /// The global variable of the shader.
    Global,
    /// An element of the function's array, by a variable modulo its length.
    Element(usize),
}

/// An operation on two numbers, which wraps.
#[derive(Debug, Clone, Copy)]
pub enum Operation {
    /// Sum.
    Add,
    /// Product.
    Multiply,
    /// Exclusive or.
    Xor,
}

/// A condition: a variable modulo a number is 0.
#[derive(Debug, Clone, Copy)]
pub struct Condition {
    /// The variable.
    pub variable: usize,
    /// The divisor, from 2 on.
    pub divisor: u32,
}

/// A statement.
#[derive(Debug, Clone)]
pub enum Statement {
    /// `target = target op operand`.
    Set(usize, Operation, Operand),
    /// `global ^= variable`.
    SetGlobal(usize),
    /// `array[variable % length] += variable`, of the first and the second variable.
    SetElement(usize, usize),
    /// A selection.
    If(Condition, Vec<Statement>, Vec<Statement>),
    /// A loop of a fixed number of iterations, left or continued on conditions.
    Loop(u32, Vec<Statement>, Option<Condition>, Option<Condition>),
    /// A switch over a variable modulo 3, whose first case falls through to the second.
    Switch(usize, [Vec<Statement>; 3]),
    /// Traces a ray, with the variable as target and payload.
    Trace(usize),
    /// Traces a ray that runs no closest-hit shader, likewise.
    TraceShadow(usize),
    /// Calls a callable shader, with the variable as index and data.
    Callable(usize),
    /// Calls a function of the shader, with the variable as argument and result.
    Call(usize, usize),
    /// Returns from the function.
    ReturnIf(Condition),
}

/// A shader: functions, the last of which is the main function. Functions call earlier ones only.
#[derive(Debug, Clone)]
pub struct Shader {
    /// Bodies of the functions.
    pub functions: Vec<Vec<Statement>>,
}

/// A pipeline. Rays hit as many instances as there are shaders in `hits`.
#[derive(Debug, Clone)]
pub struct Pipeline {
    /// The ray generation shader.
    pub ray_gen: Shader,
    /// Miss shaders.
    pub misses: Vec<Shader>,
    /// Closest-hit shaders.
    pub hits: Vec<Shader>,
    /// Callable shaders.
    pub callables: Vec<Shader>,
    /// True if traces stand where they are written, several to a block; else each is a call of a function.
    pub traces_in_place: bool,
}

/// Calls that a kind of shader may have.
#[derive(Clone, Copy)]
struct Allowed {
    traces: bool,
    /// All rays run no closest-hit shader.
    only_shadows: bool,
    /// True if there are elements of arrays, and rays that run no closest-hit shader.
    extras: bool,
    callables: bool,
}

impl Pipeline {
    /// Returns the pipeline of a seed, with or without elements of arrays and rays that run no closest-hit shader.
    pub fn random(seed: u64, extras: bool) -> Self {
        let mut random = Random::new(seed);
        let few = |random: &mut Random, most: u64| 1 + random.bits() % most;
        // Few pipelines have traces or calls in all kinds of shaders.
        let (traces, callables) = (!one_in(&mut random, 3), !one_in(&mut random, 2));
        let misses = Allowed {
            traces: traces && !(extras && one_in(&mut random, 3)),
            only_shadows: false,
            extras,
            callables,
        };
        let only_shadows = extras && one_in(&mut random, 3);
        let hits = Allowed { traces, only_shadows, extras, callables };
        let nested =
            Allowed { traces: false, only_shadows: false, extras, callables: !one_in(&mut random, 2) };
        let outer = Allowed { traces: true, only_shadows: false, extras, callables: true };
        let shaders = |random: &mut Random, most, allowed| {
            let count = few(random, most);
            (0..count).map(|_| shader(random, allowed)).collect()
        };
        let mut pipeline = Self {
            ray_gen: shader(&mut random, outer),
            misses: shaders(&mut random, 2, misses),
            hits: shaders(&mut random, 3, hits),
            callables: shaders(&mut random, 2, nested),
            traces_in_place: seed % 2 == 1,
        };
        if pipeline.traces_in_place && extras {
            for function in pipeline.hits.iter_mut().flat_map(|shader| &mut shader.functions) {
                put_shadows_before_traces(function);
            }
        }
        pipeline
    }
}

/// Puts a ray that runs no closest-hit shader in front of each that does.
fn put_shadows_before_traces(statements: &mut Vec<Statement>) {
    for mut statement in std::mem::take(statements) {
        match &mut statement {
            Statement::Trace(variable) => statements.push(Statement::TraceShadow((*variable + 1) % 3)),
            Statement::If(_, yes, no) => [yes, no].into_iter().for_each(put_shadows_before_traces),
            Statement::Loop(_, body, ..) => put_shadows_before_traces(body),
            Statement::Switch(_, cases) => cases.iter_mut().for_each(put_shadows_before_traces),
            _ => {}
        }
        statements.push(statement);
    }
}

fn shader(random: &mut Random, allowed: Allowed) -> Shader {
    let count = 1 + (random.bits() % 3) as usize;
    // Waits multiply along calls and loops, so each function has few.
    let function = |index| {
        let mut waits = 2;
        statements(random, allowed, index, 3, &mut waits)
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
    match random.bits() % 12 {
        0 if nesting > 0 => {
            let condition = condition(random);
            let yes = inner(random);
            let no = if one_in(random, 2) { inner(random) } else { Vec::new() };
            Statement::If(condition, yes, no)
        }
        1 if nesting > 0 => {
            let body = inner(random);
            let maybe = |random: &mut Random| one_in(random, 3).then(|| condition(random));
            Statement::Loop(1 + (random.bits() % 2) as u32, body, maybe(random), maybe(random))
        }
        2 if nesting > 0 => Statement::Switch(variable, [inner(random), inner(random), inner(random)]),
        3 => Statement::ReturnIf(condition(random)),
        4 if allowed.extras && one_in(random, 2) => {
            Statement::SetElement(variable, random.bits() as usize % VARIABLES)
        }
        4 => Statement::SetGlobal(variable),
        5 | 6 if allowed.traces && *waits > 0 => {
            *waits -= 1;
            if allowed.only_shadows || (allowed.extras && one_in(random, 4)) {
                Statement::TraceShadow(variable)
            } else {
                Statement::Trace(variable)
            }
        }
        7 if allowed.callables && *waits > 0 => {
            *waits -= 1;
            Statement::Callable(variable)
        }
        8 if callees > 0 && *waits > 0 => {
            *waits -= 1;
            Statement::Call(random.bits() as usize % callees, variable)
        }
        _ => Statement::Set(variable, operation(random), operand(random, allowed.extras)),
    }
}

/// Returns true once in `count` times.
fn one_in(random: &mut Random, count: u64) -> bool {
    random.bits().is_multiple_of(count)
}

fn condition(random: &mut Random) -> Condition {
    Condition { variable: random.bits() as usize % VARIABLES, divisor: 2 + (random.bits() % 3) as u32 }
}

fn operation(random: &mut Random) -> Operation {
    [Operation::Add, Operation::Multiply, Operation::Xor][random.bits() as usize % 3]
}

fn operand(random: &mut Random, extras: bool) -> Operand {
    match random.bits() % if extras { 7 } else { 6 } {
        6 => Operand::Element(random.bits() as usize % VARIABLES),
        0 | 1 => Operand::Variable(random.bits() as usize % VARIABLES),
        2 => Operand::BuiltIn,
        3 => Operand::Record,
        4 => Operand::Global,
        _ => Operand::Constant((random.bits() >> 32) as u32),
    }
}
