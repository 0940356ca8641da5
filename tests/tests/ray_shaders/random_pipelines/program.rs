//! Shaders as functions of statements over a few variables, and pipelines of them.

use lvk::ShaderStage;

/// Numbers of variables that each function has.
pub const VARIABLES: usize = 3;
/// Elements of the array that each function has, which are 0 at first.
pub const ELEMENTS: usize = 3;
/// Words of the struct that functions may have.
pub const STRUCT_WORDS: usize = 11;
/// Elements of the array of structs that functions may have.
pub const STRUCTS: usize = 2;
/// Deepest recursion of traces.
pub const MAX_DEPTH: u32 = 4;
/// Deepest nesting of callable shaders.
pub const MAX_CALLABLE_DEPTH: u32 = 2;
/// Hit groups that rays are sent to.
pub const MOST_HITS: usize = 3;

/// A member of the struct that functions may have.
#[derive(Debug, Clone, Copy)]
pub enum Field {
    /// A number.
    Number,
    /// A boolean value.
    Flag,
    /// An array of two floats.
    Weights,
    /// A number in a struct in the struct.
    Inner,
    /// A float beside it.
    InnerFloat,
    /// A vector of three numbers.
    Vector,
    /// Two columns of a matrix, of which one row is used.
    Matrix,
}

/// A local variable beside the three numbers.
#[derive(Debug, Clone, Copy)]
pub enum Place {
    /// The array.
    Element,
    /// A boolean variable.
    Flag,
    /// A float.
    Weight,
    /// A vector of three numbers.
    Vector,
    /// Two columns of a matrix, of which one row is used.
    Matrix,
    /// A member of the struct.
    Struct(Field),
    /// A member of an element of the array of structs.
    Structs(Field),
}

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
    /// A place, which takes an index from a variable.
    Place(Place, usize),
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

/// A ray.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ray {
    /// Runs any-hit shaders and closest-hit shaders.
    Closest,
    /// Ends at the first hit, and runs no closest-hit shader.
    Shadow,
    /// Runs no any-hit shader.
    Opaque,
}

/// A value, which may wait for rays and callable shaders while it is computed.
#[derive(Debug, Clone)]
pub enum Value {
    /// An operand.
    Operand(Operand),
    /// An operation, whose operand is read first.
    Operation(Operation, Operand, Box<Value>),
    /// The payload of a ray that has run. The value chooses its target, and is its payload at first.
    Trace(Ray, Box<Value>),
    /// The data of a callable shader that has run, likewise.
    Callable(Box<Value>),
    /// The result of a function for an argument. The variable is passed too, where the signature has another parameter.
    Call(usize, Box<Value>, usize),
    /// One of two values.
    Choice(Box<Test>, Box<Value>, Box<Value>),
}

/// A condition on one variable: a variable modulo a number is 0.
#[derive(Debug, Clone, Copy)]
pub struct Condition {
    /// The variable.
    pub variable: usize,
    /// The divisor, from 2 on.
    pub divisor: u32,
}

/// A condition.
#[derive(Debug, Clone)]
pub enum Test {
    /// A condition on one variable.
    Variable(Condition),
    /// The boolean variable.
    Flag,
    /// The opposite.
    Not(Box<Test>),
    /// Both; the second is computed if the first holds.
    Both(Box<Test>, Box<Test>),
    /// One of them; the second is computed if the first does not hold.
    Either(Box<Test>, Box<Test>),
    /// A value modulo a number is 0.
    Divides(Box<Value>, u32),
    /// A report of a hit at the distance of a variable is taken.
    Report(usize),
}

/// The head of a loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LoopForm {
    /// `for` with a condition.
    For,
    /// `for` without a condition, which its body leaves.
    Endless,
    /// `while` with a condition.
    While,
    /// `while (true)`, which its body leaves.
    WhileTrue,
    /// `do` with a condition behind the body.
    DoWhile,
}

/// A loop.
#[derive(Debug, Clone)]
pub struct Loop {
    /// The head.
    pub form: LoopForm,
    /// Most iterations.
    pub count: u32,
    /// A condition of further iterations, for forms that have one.
    pub test: Option<Test>,
    /// The variable and its value behind each iteration, for forms of `for`.
    pub step: Option<(usize, Value)>,
    /// True for an endless loop that returns after the last iteration; else it breaks.
    pub returns: bool,
    /// The body.
    pub body: Vec<Statement>,
}

/// A case of a switch.
#[derive(Debug, Clone)]
pub struct Case {
    /// The number; `None` for the default.
    pub label: Option<u32>,
    /// The body.
    pub body: Vec<Statement>,
    /// True if the next case follows; else the switch ends.
    pub falls_through: bool,
}

/// A statement.
#[derive(Debug, Clone)]
pub enum Statement {
    /// `target = target op value`.
    Set(usize, Operation, Value),
    /// `target = value`.
    Assign(usize, Value),
    /// `global ^= variable`.
    SetGlobal(usize),
    /// Writes a value to a place, which takes an index from the variable.
    Keep(Place, usize, Value),
    /// Copies an element of the array of structs, by a variable, to the struct, or the struct to the element.
    CopyStruct(usize, bool),
    /// A selection.
    If(Test, Vec<Statement>, Vec<Statement>),
    /// A loop.
    Loop(Box<Loop>),
    /// A switch over a value modulo a number.
    Switch(Value, u32, Vec<Case>),
    /// Traces a ray where the statement stands, with the variable as target and payload.
    Trace(Ray, usize),
    /// Calls a function without a result, or one that returns the struct, with the variable as argument.
    Call(usize, usize),
    /// Returns from the function, on a condition.
    ReturnIf(Test),
    /// Goes on with the next iteration, on a condition.
    ContinueIf(Test),
    /// Leaves the loop or the switch, on a condition.
    BreakIf(Test),
    /// Returns a value.
    Return(Value),
    /// Goes on with the next iteration.
    Continue,
    /// Leaves the loop or the switch.
    Break,
    /// Ignores the candidate, on a condition.
    IgnoreIf(Test),
    /// Accepts the candidate and ends the ray, on a condition, if no hit can be nearer.
    TerminateIf(Test),
    /// Reports a hit at the distance of a variable, and changes the variable by the answer.
    Report(usize),
}

impl Statement {
    /// Returns the lists of statements in the statement.
    pub fn bodies_mut(&mut self) -> Vec<&mut Vec<Self>> {
        match self {
            Self::If(_, yes, no) => vec![yes, no],
            Self::Loop(inner) => vec![&mut inner.body],
            Self::Switch(_, _, cases) => cases.iter_mut().map(|case| &mut case.body).collect(),
            _ => Vec::new(),
        }
    }
}

/// True if the end of the statements is never reached.
pub fn never_ends(statements: &[Statement]) -> bool {
    match statements.last() {
        Some(Statement::Return(_)) => true,
        Some(Statement::If(_, yes, no)) => never_ends(yes) && never_ends(no),
        Some(Statement::Loop(inner)) => {
            let is_endless = matches!(inner.form, LoopForm::Endless | LoopForm::WhileTrue);
            is_endless && inner.returns && !has_break(&inner.body)
        }
        Some(Statement::Switch(_, _, cases)) => {
            let stays =
                |case: &Case| (case.falls_through || never_ends(&case.body)) && !has_break(&case.body);
            cases.iter().any(|case| case.label.is_none()) && cases.iter().all(stays)
        }
        _ => false,
    }
}

/// True if a statement leaves the loop or the switch that the statements are in.
fn has_break(statements: &[Statement]) -> bool {
    statements.iter().any(|statement| match statement {
        Statement::Break | Statement::BreakIf(_) => true,
        Statement::If(_, yes, no) => has_break(yes) || has_break(no),
        _ => false,
    })
}

/// Parameters and result of a function. The first parameter is the variable 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Signature {
    /// The entry point of the shader.
    Main,
    /// Returns a number.
    Plain,
    /// Returns a boolean value.
    Bool,
    /// Returns a number; the variable 2 is an `inout` parameter.
    InOut,
    /// Returns a number; the variable 2 is an `out` parameter.
    Out,
    /// Returns a number; the struct is an `inout` parameter.
    InOutStruct,
    /// Returns nothing; the variable 0 is an `inout` parameter.
    Void,
    /// Returns the struct, which is a parameter.
    Struct,
}

/// A function.
#[derive(Debug, Clone)]
pub struct Function {
    /// Parameters and result.
    pub signature: Signature,
    /// The body.
    pub body: Vec<Statement>,
}

/// A shader: functions, the last of which is the main function or called by it. Functions call earlier ones only.
#[derive(Debug, Clone)]
pub struct Shader {
    /// The functions.
    pub functions: Vec<Function>,
}

/// The shaders of a hit group.
#[derive(Debug, Clone)]
pub struct Group {
    /// The closest-hit shader.
    pub closest_hit: Shader,
    /// The any-hit shader.
    pub any_hit: Option<Shader>,
    /// The intersection shader of a group of AABBs.
    pub intersection: Option<Shader>,
}

/// A pipeline.
#[derive(Debug, Clone)]
pub struct Pipeline {
    /// The ray generation shader.
    pub ray_gen: Shader,
    /// Miss shaders.
    pub misses: Vec<Shader>,
    /// Groups that rays are sent to.
    pub hits: Vec<Group>,
    /// The group of triangles behind the first ones along each ray.
    pub behind: Option<Group>,
    /// Callable shaders.
    pub callables: Vec<Shader>,
    /// True if traces stand where they are written, several to a block; else each is a call of a function.
    pub traces_in_place: bool,
}

impl Pipeline {
    /// Returns a bit for each group of `hits` that is one of AABBs.
    pub fn procedural(&self) -> u32 {
        let bits = self.hits.iter().enumerate();
        bits.map(|(index, group)| u32::from(group.intersection.is_some()) << index).sum()
    }

    /// Returns all shaders with their stages, and true for those of a group of AABBs.
    pub fn shaders_mut(&mut self) -> Vec<(ShaderStage, bool, &mut Shader)> {
        let mut all = vec![(ShaderStage::RayGen, false, &mut self.ray_gen)];
        all.extend(self.misses.iter_mut().map(|shader| (ShaderStage::Miss, false, shader)));
        for group in self.hits.iter_mut().chain(&mut self.behind) {
            let is_procedural = group.intersection.is_some();
            all.push((ShaderStage::ClosestHit, is_procedural, &mut group.closest_hit));
            all.extend(group.any_hit.as_mut().map(|shader| (ShaderStage::AnyHit, is_procedural, shader)));
            all.extend(
                group.intersection.as_mut().map(|shader| (ShaderStage::Intersection, is_procedural, shader)),
            );
        }
        all.extend(self.callables.iter_mut().map(|shader| (ShaderStage::Callable, false, shader)));
        all
    }
}
