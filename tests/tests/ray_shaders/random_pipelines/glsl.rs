//! The text of random shaders.

use std::fmt::Write;

use lvk::ShaderStage;

use super::program::{
    Condition, ELEMENTS, MAX_CALLABLE_DEPTH, MAX_DEPTH, Operand, Operation, Shader, Statement,
};

const HEADER: &str = "
    #extension GL_EXT_null_initializer : require
    struct Passed { uint value; uint depth; float unused[2]; };
    layout(buffer_reference, scalar) buffer Words { uint at[]; };
    layout(push_constant, scalar) uniform Push { Words results; uint tlas; uint hits; uint misses; };
    layout(shaderRecordEXT, scalar) buffer Record { uint skipped; uint tag; };
    uint g = 17u;
    uint gDepth = 0u;
    uint gCalls = 0u;
";

const TRACE: &str = "
    uint traced(uint v) {
        if (gDepth >= MAX_DEPTH) return v * 3u;
        uint target = v % (hits + misses);
        bool isHit = target < hits;
        sent.value = v;
        sent.depth = gDepth + 1u;
        traceRayEXT(kTLAS[tlas], FLAGS, 0xFF, 0, 0, isHit ? 0u : target - hits, vec3(target + 0.25, 0.25, -1), 0.0,
            vec3(0, 0, isHit ? 1 : -1), 10.0, 2);
        return sent.value;
    }
";

const CALL: &str = "
    layout(location = 1) callableDataEXT Passed data;
    uint called(uint v) {
        if (gCalls >= MAX_CALLABLE_DEPTH) return v * 5u;
        data.value = v;
        data.depth = gCalls + 1u;
        executeCallableEXT(v % CALLABLES, 1);
        return data.value;
    }
";

/// A trace where it stands, without a branch, so that several may share a block.
const IN_PLACE: &str = "
        at = VARIABLE % (hits + misses);
        isHit = uint(at < hits);
        sent.value = VARIABLE;
        sent.depth = gDepth + 1u;
        traceRayEXT(kTLAS[tlas], FLAGS, 0xFF, 0, 0, (at - hits) * (1u - isHit), vec3(at + 0.25, 0.25, -1), 0.0,
            vec3(0, 0, 2.0 * isHit - 1.0), 10.0, 2);
        VARIABLE = sent.value;
";
const SHADOW: &str = "gl_RayFlagsTerminateOnFirstHitEXT | gl_RayFlagsSkipClosestHitShaderEXT";

/// Forms of traces.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Traces {
    /// Calls of a function.
    Called,
    /// Where they stand.
    InPlace,
    /// None: the recursion has ended.
    Ended,
}

/// Returns the text of a shader in a pipeline with this number of callable shaders. `in_place`: its traces stand in its functions.
pub fn text(shader: &Shader, stage: ShaderStage, callables: usize, in_place: bool) -> String {
    let builtin = match stage {
        ShaderStage::ClosestHit => "uint(gl_InstanceID) + uint(gl_HitTEXT + 0.5) + gl_LaunchIDEXT.x",
        ShaderStage::Miss => "gl_LaunchIDEXT.x + uint(gl_RayTmaxEXT)",
        _ => "gl_LaunchIDEXT.x",
    };
    let mut text =
        format!("{HEADER}#define MAX_DEPTH {MAX_DEPTH}u\n#define MAX_CALLABLE_DEPTH {MAX_CALLABLE_DEPTH}u\n");
    writeln!(text, "#define CALLABLES {callables}u\n#define BUILT_IN ({builtin})").ok();
    if stage != ShaderStage::Callable {
        text.push_str("layout(location = 2) rayPayloadEXT Passed sent;\n");
        text.push_str(&TRACE.replace("FLAGS", "0"));
        text.push_str(&TRACE.replace("traced", "tracedShadow").replace("FLAGS", SHADOW));
    }
    text.push_str(CALL);
    match stage {
        ShaderStage::RayGen => {}
        ShaderStage::Callable => text.push_str("layout(location = 0) callableDataInEXT Passed given;\n"),
        _ => text.push_str("layout(location = 0) rayPayloadInEXT Passed given;\n"),
    }
    for (index, body) in shader.functions.iter().enumerate() {
        writeln!(
            text,
            "uint f{index}(uint v0) {{ uint v1 = v0 + 1u; uint v2 = 7u; uint a[{ELEMENTS}] = {{}};"
        )
        .ok();
        if in_place && stage != ShaderStage::Callable {
            text.push_str("uint at; uint isHit; if (gDepth >= MAX_DEPTH) {\n");
            write_statements(&mut text, body, (Traces::Ended, 0));
            text.push_str("} else {\n");
            write_statements(&mut text, body, (Traces::InPlace, 0));
            text.push_str("}\n");
        } else {
            write_statements(&mut text, body, (Traces::Called, 0));
        }
        writeln!(text, "return v0 ^ v1 * 3u ^ v2 ^ a[1]; }}").ok();
    }
    let last = shader.functions.len() - 1;
    let main = match stage {
        ShaderStage::RayGen => format!("results.at[gl_LaunchIDEXT.x] = f{last}(gl_LaunchIDEXT.x) + g;"),
        ShaderStage::Callable => format!("gCalls = given.depth; given.value = f{last}(given.value) + g;"),
        _ => format!("gDepth = given.depth; given.value = f{last}(given.value) + g;"),
    };
    writeln!(text, "void main() {{ {main} }}").ok();
    text
}

fn write_statements(text: &mut String, statements: &[Statement], within: (Traces, u32)) {
    statements.iter().for_each(|statement| write_statement(text, statement, within));
}

fn write_trace(text: &mut String, variable: usize, traces: Traces, is_shadow: bool) {
    let written = match traces {
        Traces::Ended => format!("v{variable} = v{variable} * 3u;"),
        Traces::Called if is_shadow => format!("v{variable} = tracedShadow(v{variable});"),
        Traces::Called => format!("v{variable} = traced(v{variable});"),
        Traces::InPlace => {
            let flags = if is_shadow { SHADOW } else { "0" };
            IN_PLACE.replace("VARIABLE", &format!("v{variable}")).replace("FLAGS", flags)
        }
    };
    writeln!(text, "{written}").ok();
}

/// `traces`: their form. `loops`: around the statement.
fn write_statement(text: &mut String, statement: &Statement, (traces, loops): (Traces, u32)) {
    match statement {
        Statement::Set(target, operation, operand) => {
            let symbol = match operation {
                Operation::Add => "+",
                Operation::Multiply => "*",
                Operation::Xor => "^",
            };
            writeln!(text, "v{target} = v{target} {symbol} {};", operand_text(*operand)).ok();
        }
        Statement::SetGlobal(variable) => _ = writeln!(text, "g ^= v{variable};"),
        Statement::SetElement(index, variable) => {
            writeln!(text, "a[v{index} % {ELEMENTS}u] += v{variable};").ok();
        }
        Statement::If(condition, yes, no) => {
            writeln!(text, "if ({}) {{", condition_text(*condition)).ok();
            write_statements(text, yes, (traces, loops));
            if !no.is_empty() {
                text.push_str("} else {\n");
                write_statements(text, no, (traces, loops));
            }
            text.push_str("}\n");
        }
        Statement::Loop(count, body, leave, skip) => {
            writeln!(text, "for (uint i{loops} = 0u; i{loops} < {count}u; ++i{loops}) {{").ok();
            if let Some(condition) = skip {
                writeln!(text, "if ({}) {{ v2 += 1u; continue; }}", condition_text(*condition)).ok();
            }
            write_statements(text, body, (traces, loops + 1));
            if let Some(condition) = leave {
                writeln!(text, "if ({}) break;", condition_text(*condition)).ok();
            }
            writeln!(text, "v1 += i{loops}; }}").ok();
        }
        Statement::Switch(variable, cases) => {
            writeln!(text, "switch (v{variable} % 3u) {{ case 0u:").ok();
            write_statements(text, &cases[0], (traces, loops));
            text.push_str("case 1u:\n");
            write_statements(text, &cases[1], (traces, loops));
            text.push_str("break;\ndefault:\n");
            write_statements(text, &cases[2], (traces, loops));
            text.push_str("break; }\n");
        }
        Statement::Trace(variable) => write_trace(text, *variable, traces, false),
        Statement::TraceShadow(variable) => write_trace(text, *variable, traces, true),
        Statement::Callable(variable) => _ = writeln!(text, "v{variable} = called(v{variable});"),
        Statement::Call(function, variable) => {
            writeln!(text, "v{variable} = f{function}(v{variable});").ok();
        }
        Statement::ReturnIf(condition) => {
            writeln!(text, "if ({}) return v0 + v1;", condition_text(*condition)).ok();
        }
    }
}

fn operand_text(operand: Operand) -> String {
    match operand {
        Operand::Variable(index) => format!("v{index}"),
        Operand::Constant(value) => format!("{value}u"),
        Operand::BuiltIn => "BUILT_IN".to_owned(),
        Operand::Record => "tag".to_owned(),
        Operand::Global => "g".to_owned(),
        Operand::Element(index) => format!("a[v{index} % {ELEMENTS}u]"),
    }
}

fn condition_text(condition: Condition) -> String {
    format!("v{} % {}u == 0u", condition.variable, condition.divisor)
}
