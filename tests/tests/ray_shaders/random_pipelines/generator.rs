//! Makes random pipelines.

use lvk::ShaderStage;
use lvk_tests::random::Random;

use super::PIPELINES;
use super::interpreter;
use super::program::{
    Case, Condition, Field, Function, Group, Loop, LoopForm, Operand, Operation, Pipeline, Place, Ray,
    Shader, Signature, Statement, Test, VARIABLES, Value,
};

/// Most weights of shaders, of which seeds take turns: its statements, with those of the functions that it calls in their place, and four for each wait.
/// Drivers and the validation layer take long for large ones.
const MOST_WEIGHTS: [u32; 4] = [20, 30, 30, 40];

/// Most weight of shaders in the normal test, which would take too long with others.
const LEAST_WEIGHT: u32 = 10;

/// Returns the pipeline of a seed. No invocation of `launches` takes long.
pub fn pipeline(seed: u64, launches: u32) -> Pipeline {
    let mut random = Random::new(seed);
    loop {
        let found = any_pipeline(&mut random, seed);
        if (0..launches).all(|launch| interpreter::run(&found, launch).is_some()) {
            return found;
        }
    }
}

fn any_pipeline(random: &mut Random, seed: u64) -> Pipeline {
    let traces_in_place = seed % 2 == 1;
    let most_weight =
        if seed < PIPELINES { LEAST_WEIGHT } else { MOST_WEIGHTS[seed as usize % MOST_WEIGHTS.len()] };
    // Few pipelines have traces or calls in all kinds of shaders.
    let (traces, callables, judges) = (!one_in(random, 3), !one_in(random, 2), one_in(random, 2));
    let outer = Allowed { rays: &RAYS, callables: true, stage: ShaderStage::RayGen, most_weight };
    let misses = Allowed {
        rays: if traces && !one_in(random, 3) { &RAYS } else { &[] },
        callables,
        stage: ShaderStage::Miss,
        most_weight,
    };
    let only_shadows = one_in(random, 3);
    let rays: &[Ray] = if only_shadows { &RAYS[2..3] } else { &RAYS };
    let hits = Allowed {
        rays: if traces { rays } else { &[] },
        callables,
        stage: ShaderStage::ClosestHit,
        most_weight,
    };
    let nested =
        Allowed { rays: &[], callables: !one_in(random, 2), stage: ShaderStage::Callable, most_weight };
    let judge = |stage| Allowed { rays: &[], callables: false, stage, most_weight };
    let group = |random: &mut Random, may_be_boxes: bool| {
        let closest_hit = shader(random, hits);
        let intersection = judges && may_be_boxes && one_in(random, 2);
        let intersection = intersection.then(|| shader(random, judge(ShaderStage::Intersection)));
        let any_hit = judges && !one_in(random, 4);
        let any_hit = any_hit.then(|| shader(random, judge(ShaderStage::AnyHit)));
        Group { closest_hit, any_hit, intersection }
    };
    let mut pipeline = Pipeline {
        ray_gen: shader(random, outer),
        misses: (0..1 + random.bits() % 2).map(|_| shader(random, misses)).collect(),
        hits: (0..1 + random.bits() % 3).map(|_| group(random, true)).collect(),
        behind: judges.then(|| group(random, false)),
        callables: (0..1 + random.bits() % 2).map(|_| shader(random, nested)).collect(),
        traces_in_place,
    };
    if traces_in_place {
        let closest = pipeline.hits.iter_mut().flat_map(|group| &mut group.closest_hit.functions);
        closest.for_each(|function| put_shadows_before_traces(&mut function.body));
    }
    pipeline
}

/// Rays, each as often as it is wanted.
const RAYS: [Ray; 4] = [Ray::Closest, Ray::Closest, Ray::Shadow, Ray::Opaque];

/// Puts a ray that runs no closest-hit shader in front of each that does.
fn put_shadows_before_traces(statements: &mut Vec<Statement>) {
    for mut statement in std::mem::take(statements) {
        if let Statement::Trace(Ray::Closest, variable) = statement {
            statements.push(Statement::Trace(Ray::Shadow, (variable + 1) % VARIABLES));
        }
        statement.bodies_mut().into_iter().for_each(put_shadows_before_traces);
        statements.push(statement);
    }
}

/// Calls that a kind of shader may have.
#[derive(Clone, Copy)]
struct Allowed {
    rays: &'static [Ray],
    callables: bool,
    stage: ShaderStage,
    most_weight: u32,
}

fn shader(random: &mut Random, allowed: Allowed) -> Shader {
    let count = 1 + random.bits() % 3;
    let mut made = Made { random, allowed, functions: Vec::new(), weight: 0, waits: 0 };
    let mut functions = Vec::new();
    for index in 0..count {
        let signature = if index + 1 < count {
            [
                Signature::Plain,
                Signature::Plain,
                Signature::Bool,
                Signature::InOut,
                Signature::Out,
                Signature::InOutStruct,
                Signature::Void,
                Signature::Struct,
            ][made.below(8)]
        } else {
            [Signature::Plain, Signature::Main][made.below(2)]
        };
        functions.push(made.function(signature));
    }
    Shader { functions }
}

/// What surrounds a statement.
#[derive(Clone, Copy)]
struct Around {
    /// Levels of statements that may follow.
    nesting: u32,
    /// True where `continue` is allowed.
    is_in_loop: bool,
    /// True where `break` is allowed.
    can_break: bool,
}

/// The functions of a shader that is made.
struct Made<'a> {
    random: &'a mut Random,
    allowed: Allowed,
    /// Signatures and weights of earlier functions.
    functions: Vec<(Signature, u32)>,
    /// Weight of this function.
    weight: u32,
    /// Waits that the function may still have: they multiply along calls and loops.
    waits: u32,
}

impl Made<'_> {
    fn below(&mut self, count: usize) -> usize {
        (self.random.bits() % count as u64) as usize
    }

    fn one_in(&mut self, count: u64) -> bool {
        one_in(self.random, count)
    }

    fn variable(&mut self) -> usize {
        self.below(VARIABLES)
    }

    fn function(&mut self, signature: Signature) -> Function {
        (self.weight, self.waits) = (0, 3);
        let around = Around { nesting: 3, is_in_loop: false, can_break: false };
        let mut body = self.statements(around);
        let end = match self.below(6) {
            0 => Some(self.endless_loop()),
            1 => Some(self.returning_switch()),
            2 => Some(Statement::Return(self.value(2))),
            _ => None,
        };
        body.extend(end);
        self.functions.push((signature, self.weight));
        Function { signature, body }
    }

    /// A loop that only returns leave.
    fn endless_loop(&mut self) -> Statement {
        let form = [LoopForm::Endless, LoopForm::WhileTrue][self.below(2)];
        let count = 1 + self.below(3) as u32;
        let body = self.statements(Around { nesting: 2, is_in_loop: true, can_break: false });
        Statement::Loop(Box::new(Loop { form, count, test: None, step: None, returns: true, body }))
    }

    /// A switch that only returns leave.
    fn returning_switch(&mut self) -> Statement {
        let value = self.value(1);
        let count = 1 + self.below(3);
        let cases = (0..=count).map(|index| {
            let mut body = self.statements(Around { nesting: 1, is_in_loop: false, can_break: false });
            let falls_through = index < count && self.one_in(4);
            if !falls_through {
                body.push(Statement::Return(self.value(1)));
            }
            Case { label: (index < count).then_some(index as u32), body, falls_through }
        });
        let cases = cases.collect();
        Statement::Switch(value, count as u32 + 1, cases)
    }

    fn statements(&mut self, around: Around) -> Vec<Statement> {
        let count = 1 + self.below(3);
        let mut list: Vec<_> = (0..count).map(|_| self.statement(around)).collect();
        let is_outermost = around.nesting == 3;
        match self.below(10) {
            0 if !is_outermost => list.push(Statement::Return(self.value(1))),
            1 if around.can_break => list.push(Statement::Break),
            2 if around.is_in_loop => list.push(Statement::Continue),
            _ => {}
        }
        list
    }

    fn inner(&mut self, around: Around) -> Vec<Statement> {
        self.statements(Around { nesting: around.nesting - 1, ..around })
    }

    fn statement(&mut self, around: Around) -> Statement {
        self.weight += 1;
        let variable = self.variable();
        let nests = around.nesting > 0 && self.weight < self.allowed.most_weight;
        match self.below(20) {
            0 if nests => {
                let (test, yes) = (self.test(2), self.inner(around));
                let no = if self.one_in(2) { self.inner(around) } else { Vec::new() };
                Statement::If(test, yes, no)
            }
            1..=3 if nests => self.a_loop(around),
            4 | 5 if nests => self.switch(around),
            6 => Statement::ReturnIf(self.test(1)),
            7 | 8 => {
                let place = self.place();
                Statement::Keep(place, variable, self.value(1))
            }
            9 => Statement::SetGlobal(variable),
            10 | 11 if self.takes_wait(!self.allowed.rays.is_empty()) => {
                let ray = self.ray();
                Statement::Trace(ray, variable)
            }
            12 => self.function_statement(variable),
            13 => Statement::CopyStruct(variable, self.one_in(2)),
            14 if around.can_break => Statement::BreakIf(self.test(1)),
            15 if around.is_in_loop => Statement::ContinueIf(self.test(1)),
            16 | 17 => self.verdict(variable),
            18 => Statement::Assign(variable, self.value(2)),
            _ => {
                let operation = operation(self.random);
                Statement::Set(variable, operation, self.value(2))
            }
        }
    }

    fn a_loop(&mut self, around: Around) -> Statement {
        let forms =
            [LoopForm::For, LoopForm::Endless, LoopForm::While, LoopForm::WhileTrue, LoopForm::DoWhile];
        let form = forms[self.below(5)];
        let test = if matches!(form, LoopForm::Endless | LoopForm::WhileTrue) || self.one_in(3) {
            None
        } else {
            Some(self.loop_test())
        };
        let has_step = matches!(form, LoopForm::For | LoopForm::Endless) && self.one_in(3);
        let step = has_step.then(|| (self.variable(), self.value(2)));
        let body = self.inner(Around { is_in_loop: true, can_break: true, ..around });
        let count = 1 + self.below(3) as u32;
        Statement::Loop(Box::new(Loop { form, count, test, step, returns: self.one_in(2), body }))
    }

    /// A condition that is computed anew for each iteration, often with a wait.
    fn loop_test(&mut self) -> Test {
        if self.one_in(2) && self.takes_wait(!self.allowed.rays.is_empty()) {
            let ray = self.ray();
            let value = Value::Trace(ray, Box::new(self.value(1)));
            return Test::Divides(Box::new(value), 2);
        }
        self.test(2)
    }

    fn switch(&mut self, around: Around) -> Statement {
        let value = self.value(1);
        let count = 1 + self.below(3);
        let default = self.below(count + 2);
        let cases = (0..count).map(|index| {
            let body = self.inner(Around { can_break: true, ..around });
            let falls_through = index + 1 < count && self.one_in(3);
            let label = (index != default).then_some(index as u32);
            Case { label, body, falls_through }
        });
        let cases = cases.collect();
        Statement::Switch(value, count as u32 + 1, cases)
    }

    /// A call of a function without a result, or of one that returns the struct.
    fn function_statement(&mut self, variable: usize) -> Statement {
        let callee = self.callee(|signature| matches!(signature, Signature::Void | Signature::Struct));
        match callee {
            Some(callee) => Statement::Call(callee, variable),
            None => Statement::Assign(variable, self.value(2)),
        }
    }

    fn verdict(&mut self, variable: usize) -> Statement {
        let stage = self.allowed.stage;
        match stage {
            ShaderStage::AnyHit if self.one_in(2) => Statement::IgnoreIf(self.test(1)),
            ShaderStage::AnyHit => Statement::TerminateIf(self.test(1)),
            ShaderStage::Intersection => Statement::Report(variable),
            _ => Statement::Assign(variable, self.value(2)),
        }
    }

    /// True if one more wait is allowed; then it is counted.
    fn takes_wait(&mut self, is_allowed: bool) -> bool {
        let takes = is_allowed && self.waits > 0;
        if takes {
            self.waits -= 1;
            self.weight += 4;
        }
        takes
    }

    fn ray(&mut self) -> Ray {
        self.allowed.rays[self.below(self.allowed.rays.len())]
    }

    /// Chooses an earlier function, and counts its weight.
    fn callee(&mut self, is_wanted: impl Fn(Signature) -> bool) -> Option<usize> {
        if self.functions.is_empty() {
            return None;
        }
        let callee = self.below(self.functions.len());
        let (signature, weight) = self.functions[callee];
        let fits = is_wanted(signature) && self.weight + weight <= self.allowed.most_weight;
        (fits && self.takes_wait(true)).then(|| {
            self.weight += weight;
            callee
        })
    }

    fn value(&mut self, nesting: u32) -> Value {
        if nesting == 0 {
            return Value::Operand(self.operand());
        }
        match self.below(9) {
            0 | 8 if self.takes_wait(!self.allowed.rays.is_empty()) => {
                let ray = self.ray();
                Value::Trace(ray, Box::new(self.value(nesting - 1)))
            }
            1 if self.takes_wait(self.allowed.callables) => {
                Value::Callable(Box::new(self.value(nesting - 1)))
            }
            2 | 3 => {
                let has_value = |signature| !matches!(signature, Signature::Void | Signature::Struct);
                match self.callee(has_value) {
                    Some(callee) => {
                        let argument = Box::new(self.value(nesting - 1));
                        Value::Call(callee, argument, self.variable())
                    }
                    None => Value::Operand(self.operand()),
                }
            }
            4 => {
                let (test, yes) = (Box::new(self.test(nesting - 1)), Box::new(self.value(nesting - 1)));
                Value::Choice(test, yes, Box::new(self.value(nesting - 1)))
            }
            5 => {
                let (operation, operand) = (operation(self.random), self.operand());
                Value::Operation(operation, operand, Box::new(self.value(nesting - 1)))
            }
            _ => Value::Operand(self.operand()),
        }
    }

    fn test(&mut self, nesting: u32) -> Test {
        if nesting == 0 {
            return Test::Variable(condition(self.random));
        }
        match self.below(9) {
            0 => Test::Flag,
            1 => Test::Not(Box::new(self.test(nesting - 1))),
            2 => Test::Both(Box::new(self.test(nesting - 1)), Box::new(self.test(nesting - 1))),
            3 => Test::Either(Box::new(self.test(nesting - 1)), Box::new(self.test(nesting - 1))),
            4 | 5 => Test::Divides(Box::new(self.value(nesting)), 2 + self.below(2) as u32),
            6 if self.allowed.stage == ShaderStage::Intersection => Test::Report(self.variable()),
            _ => Test::Variable(condition(self.random)),
        }
    }

    fn operand(&mut self) -> Operand {
        let variable = self.variable();
        match self.below(10) {
            0 => Operand::BuiltIn,
            1 => Operand::Record,
            2 => Operand::Global,
            3 | 4 => Operand::Place(self.place(), variable),
            5 => Operand::Constant((self.random.bits() >> 32) as u32),
            _ => Operand::Variable(variable),
        }
    }

    fn place(&mut self) -> Place {
        let fields = [
            Field::Number,
            Field::Flag,
            Field::Weights,
            Field::Inner,
            Field::InnerFloat,
            Field::Vector,
            Field::Matrix,
        ];
        let field = fields[self.below(7)];
        match self.below(8) {
            0 => Place::Element,
            1 => Place::Flag,
            2 => Place::Weight,
            3 => Place::Vector,
            4 => Place::Matrix,
            5 => Place::Structs(field),
            _ => Place::Struct(field),
        }
    }
}

/// Returns true once in `count` times.
pub fn one_in(random: &mut Random, count: u64) -> bool {
    random.bits().is_multiple_of(count)
}

/// Returns a condition on one variable.
pub fn condition(random: &mut Random) -> Condition {
    Condition { variable: random.bits() as usize % VARIABLES, divisor: 2 + (random.bits() % 3) as u32 }
}

/// Returns an operation.
pub fn operation(random: &mut Random) -> Operation {
    [Operation::Add, Operation::Multiply, Operation::Xor][random.bits() as usize % 3]
}
