//! The text of statements and values of random shaders.

use super::glsl::RAYS;
use super::program::{
    Case, Condition, ELEMENTS, Field, Loop, LoopForm, Operand, Operation, Place, Ray, STRUCTS, Signature,
    Statement, Test, Value,
};

/// A trace where it stands, without a branch, so that several may share a block.
const IN_PLACE: &str = "
        at = VARIABLE % (hits + misses);
        isHit = uint(at < hits);
        sent.value = VARIABLE;
        sent.depth = gDepth + 1u;
        traceRayEXT(kTLAS[tlas], FLAGS, 0xFF, 0, 0, (at - hits) * (1u - isHit), vec3(column(at), 0.25, -1), 0.0,
            vec3(0, 0, 2.0 * isHit - 1.0), 10.0, 2);
        VARIABLE = sent.value;
";

/// Forms of traces.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Traces {
    /// Calls of a function.
    Called,
    /// Where they stand.
    InPlace,
    /// None: the recursion has ended.
    Ended,
}

/// Writes the body of a function.
pub struct Writer<'a> {
    pub text: String,
    pub traces: Traces,
    /// Loops around the next statement.
    pub loops: u32,
    pub signature: Signature,
    /// Those of all functions.
    pub signatures: &'a [Signature],
}

impl Writer<'_> {
    pub fn write_statements(&mut self, statements: &[Statement]) {
        statements.iter().for_each(|statement| self.write_statement(statement));
    }

    fn line(&mut self, line: &str) {
        self.text.push_str(line);
        self.text.push('\n');
    }

    /// Writes the return of a value.
    pub fn write_return(&mut self, value: &str) {
        let line = match self.signature {
            Signature::Main => format!("{{ FINISH({value}) return; }}"),
            Signature::Bool => format!("return ({value}) % 2u == 0u;"),
            Signature::Void => format!("{{ v0 = {value}; return; }}"),
            Signature::Struct => format!("{{ own.number ^= {value}; return own; }}"),
            _ => format!("return {value};"),
        };
        self.line(&line);
    }

    fn write_statement(&mut self, statement: &Statement) {
        match statement {
            Statement::Set(target, operation, value) => {
                let line =
                    format!("v{target} = v{target} {} {};", symbol(*operation), self.value_text(value));
                self.line(&line);
            }
            Statement::Assign(target, value) => {
                self.line(&format!("v{target} = {};", self.value_text(value)))
            }
            Statement::SetGlobal(variable) => self.line(&format!("g ^= v{variable};")),
            Statement::Keep(place, index, value) => {
                let (target, kind) = place_text(*place, *index);
                let value = self.value_text(value);
                let value = match kind {
                    Kind::Number => value,
                    Kind::Flag => format!("({value}) % 2u == 1u"),
                    Kind::Float => format!("float(({value}) % 4096u)"),
                };
                self.line(&format!("{target} = {value};"));
            }
            Statement::CopyStruct(index, true) => {
                self.line(&format!("own = structs[v{index} % {STRUCTS}u];"))
            }
            Statement::CopyStruct(index, false) => {
                self.line(&format!("structs[v{index} % {STRUCTS}u] = own;"))
            }
            Statement::If(test, yes, no) => {
                self.line(&format!("if ({}) {{", self.test_text(test)));
                self.write_statements(yes);
                if !no.is_empty() {
                    self.line("} else {");
                    self.write_statements(no);
                }
                self.line("}");
            }
            Statement::Loop(inner) => self.write_loop(inner),
            Statement::Switch(value, divisor, cases) => {
                self.line(&format!("switch (({}) % {divisor}u) {{", self.value_text(value)));
                cases.iter().for_each(|case| self.write_case(case));
                self.line("}");
            }
            Statement::Trace(ray, variable) => self.write_trace(*ray, *variable),
            Statement::Call(function, variable) => self.write_call(*function, *variable),
            Statement::ReturnIf(test) => {
                self.text.push_str(&format!("if ({}) ", self.test_text(test)));
                self.write_return("v0 + v1");
            }
            Statement::ContinueIf(test) => {
                self.line(&format!("if ({}) {{ v2 += 1u; continue; }}", self.test_text(test)));
            }
            Statement::BreakIf(test) => self.line(&format!("if ({}) break;", self.test_text(test))),
            Statement::Return(value) => self.write_return(&self.value_text(value)),
            Statement::Continue => self.line("continue;"),
            Statement::Break => self.line("break;"),
            Statement::IgnoreIf(test) => {
                self.line(&format!("if ({}) ignoreIntersectionEXT;", self.test_text(test)))
            }
            Statement::TerminateIf(test) => {
                let test = self.test_text(test);
                self.line(&format!("if (({test}) && gl_InstanceID < int(2u * MOST_HITS)) terminateRayEXT;"));
            }
            Statement::Report(variable) => {
                let report = format!(
                    "mark = v{variable}; if (reportIntersectionEXT(0.5 + float(v{variable} % 8u) * 0.125, v{variable} % 100u))"
                );
                self.line(&format!(
                    "{report} {{ v{variable} += uint(gl_RayTmaxEXT * 8.0); }} else {{ v{variable} ^= 5u; }}"
                ));
            }
        }
    }

    fn write_case(&mut self, case: &Case) {
        self.line(&case.label.map_or("default:".to_owned(), |label| format!("case {label}u:")));
        self.write_statements(&case.body);
        let has_ended =
            matches!(case.body.last(), Some(Statement::Break | Statement::Continue | Statement::Return(_)));
        if case.falls_through {
            self.line("v1 += 0u;");
        } else if !has_ended {
            self.line("break;");
        }
    }

    fn write_loop(&mut self, inner: &Loop) {
        let (i, count) = (format!("i{}", self.loops), inner.count);
        let test =
            inner.test.as_ref().map_or(String::new(), |test| format!(" && ({})", self.test_text(test)));
        let step = inner
            .step
            .as_ref()
            .map_or(String::new(), |(variable, value)| format!(", v{variable} = {}", self.value_text(value)));
        let leave = |writer: &mut Self, test: &str| {
            writer.text.push_str(&format!("if ({test}) "));
            if inner.returns {
                writer.write_return("v0 + v1");
            } else {
                writer.line("break;");
            }
        };
        match inner.form {
            LoopForm::For => {
                self.line(&format!("for (uint {i} = 0u; {i} < {count}u{test}; ++{i}{step}) {{"));
            }
            LoopForm::Endless => {
                self.line(&format!("for (uint {i} = 0u;; ++{i}{step}) {{"));
                leave(self, &format!("{i} >= {count}u"));
            }
            LoopForm::While => {
                self.line(&format!("{{ uint {i} = 0u; while ({i}++ < {count}u{test}) {{"));
            }
            LoopForm::WhileTrue => {
                self.line(&format!("{{ uint {i} = 0u; while (true) {{"));
                leave(self, &format!("{i}++ >= {count}u"));
            }
            LoopForm::DoWhile => self.line(&format!("{{ uint {i} = 0u; do {{")),
        }
        self.loops += 1;
        self.write_statements(&inner.body);
        self.loops -= 1;
        self.line(&format!("v1 += {i};"));
        self.line(&match inner.form {
            LoopForm::For | LoopForm::Endless => "}".to_owned(),
            LoopForm::While | LoopForm::WhileTrue => "} }".to_owned(),
            LoopForm::DoWhile => format!("}} while (++{i} < {count}u{test}); }}"),
        });
    }

    fn write_trace(&mut self, ray: Ray, variable: usize) {
        let (name, flags) = RAYS[ray as usize];
        let line = match self.traces {
            Traces::Ended => format!("v{variable} = v{variable} * 3u;"),
            Traces::Called => format!("v{variable} = {name}(v{variable});"),
            Traces::InPlace => IN_PLACE.replace("VARIABLE", &format!("v{variable}")).replace("FLAGS", flags),
        };
        self.line(&line);
    }

    fn test_text(&self, test: &Test) -> String {
        match test {
            Test::Variable(condition) => condition_text(*condition),
            Test::Flag => "flag".to_owned(),
            Test::Not(inner) => format!("!({})", self.test_text(inner)),
            Test::Both(first, second) => {
                format!("({}) && ({})", self.test_text(first), self.test_text(second))
            }
            Test::Either(first, second) => {
                format!("({}) || ({})", self.test_text(first), self.test_text(second))
            }
            Test::Divides(value, divisor) => format!("({}) % {divisor}u == 0u", self.value_text(value)),
            Test::Report(variable) => format!("reported(v{variable})"),
        }
    }

    fn value_text(&self, value: &Value) -> String {
        match value {
            Value::Operand(operand) => operand_text(*operand),
            Value::Operation(operation, operand, value) => {
                format!("({} {} ({}))", operand_text(*operand), symbol(*operation), self.value_text(value))
            }
            Value::Trace(ray, value) => format!("{}({})", RAYS[*ray as usize].0, self.value_text(value)),
            Value::Callable(value) => format!("called({})", self.value_text(value)),
            Value::Call(function, argument, variable) => {
                let argument = self.value_text(argument);
                match self.signatures[*function] {
                    Signature::InOut | Signature::Out => format!("f{function}({argument}, v{variable})"),
                    Signature::InOutStruct => format!("f{function}({argument}, own)"),
                    Signature::Bool => format!("(f{function}({argument}) ? 21u : 4u)"),
                    _ => format!("f{function}({argument})"),
                }
            }
            Value::Choice(test, yes, no) => {
                format!("(({}) ? {} : {})", self.test_text(test), self.value_text(yes), self.value_text(no))
            }
        }
    }

    /// Writes the call of a function without a result, or of one that returns the struct.
    fn write_call(&mut self, function: usize, variable: usize) {
        let line = match self.signatures[function] {
            Signature::Struct => format!("own = f{function}(v{variable}, own);"),
            _ => format!("f{function}(v{variable});"),
        };
        self.line(&line);
    }
}

/// The type of a place.
enum Kind {
    Number,
    Flag,
    Float,
}

fn place_text(place: Place, index: usize) -> (String, Kind) {
    match place {
        Place::Element => (format!("a[v{index} % {ELEMENTS}u]"), Kind::Number),
        Place::Flag => ("flag".to_owned(), Kind::Flag),
        Place::Weight => ("weight".to_owned(), Kind::Float),
        Place::Vector => (format!("vector[v{index} % 3u]"), Kind::Number),
        Place::Matrix => (format!("matrix[v{index} % 2u].y"), Kind::Float),
        Place::Struct(field) => member_text("own", field, index),
        Place::Structs(field) => member_text(&format!("structs[v{index} % {STRUCTS}u]"), field, index),
    }
}

fn member_text(of: &str, field: Field, index: usize) -> (String, Kind) {
    match field {
        Field::Number => (format!("{of}.number"), Kind::Number),
        Field::Flag => (format!("{of}.flag"), Kind::Flag),
        Field::Weights => (format!("{of}.weights[v{index} % 2u]"), Kind::Float),
        Field::Inner => (format!("{of}.inner.x"), Kind::Number),
        Field::InnerFloat => (format!("{of}.inner.y"), Kind::Float),
        Field::Vector => (format!("{of}.vector[v{index} % 3u]"), Kind::Number),
        Field::Matrix => (format!("{of}.matrix[v{index} % 2u].y"), Kind::Float),
    }
}

fn operand_text(operand: Operand) -> String {
    match operand {
        Operand::Variable(index) => format!("v{index}"),
        Operand::Constant(value) => format!("{value}u"),
        Operand::BuiltIn => "BUILT_IN".to_owned(),
        Operand::Record => "tag".to_owned(),
        Operand::Global => "g".to_owned(),
        Operand::Place(place, index) => match place_text(place, index) {
            (text, Kind::Number) => text,
            (text, _) => format!("uint({text})"),
        },
    }
}

fn symbol(operation: Operation) -> &'static str {
    match operation {
        Operation::Add => "+",
        Operation::Multiply => "*",
        Operation::Xor => "^",
    }
}

fn condition_text(condition: Condition) -> String {
    format!("v{} % {}u == 0u", condition.variable, condition.divisor)
}
