//! The text of random shaders.

use std::fmt::Write;

use lvk::ShaderStage;

use super::program::{
    ELEMENTS, MAX_CALLABLE_DEPTH, MAX_DEPTH, MOST_HITS, Pipeline, STRUCTS, Shader, Signature, never_ends,
};
use super::statements::{Traces, Writer};

const HEADER: &str = "
    #extension GL_EXT_null_initializer : require
    struct Passed { uint value; uint depth; float unused[2]; };
    struct Inner { uint x; float y; };
    struct Struct { uint number; bool flag; float weights[2]; Inner inner; uvec3 vector; mat2 matrix; };
    layout(buffer_reference, scalar) buffer Words { uint at[]; };
    layout(push_constant, scalar) uniform Push { Words results; uint tlas; uint hits; uint misses; };
    layout(shaderRecordEXT, scalar) buffer Record { uint skipped; uint tag; };
    uint g = 17u;
    uint gDepth = 0u;
    uint gCalls = 0u;
";

/// The column of instances that a ray to a target is sent along.
const COLUMN: &str =
    "float column(uint target) { return target + ((PROCEDURAL >> target) & 1u) * MOST_HITS + 0.25; }";

const TRACE: &str = "
    uint traced(uint v) {
        if (gDepth >= MAX_DEPTH) return v * 3u;
        uint target = v % (hits + misses);
        bool isHit = target < hits;
        sent.value = v;
        sent.depth = gDepth + 1u;
        traceRayEXT(kTLAS[tlas], FLAGS, 0xFF, 0, 0, isHit ? 0u : target - hits, vec3(column(target), 0.25, -1), 0.0,
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

const REPORT: &str = "
    bool reported(uint v) {
        mark = v;
        return reportIntersectionEXT(0.5 + float(v % 8u) * 0.125, v % 100u);
    }
";

/// Flags of rays, as the functions that trace them have names.
pub const RAYS: [(&str, &str); 3] = [
    ("traced", "0"),
    ("tracedShadow", "gl_RayFlagsTerminateOnFirstHitEXT | gl_RayFlagsSkipClosestHitShaderEXT"),
    ("tracedOpaque", "gl_RayFlagsOpaqueEXT"),
];

/// Stands in front of the functions of a shader.
pub const FUNCTIONS: &str = "// Functions:\n";

/// Returns the text of a shader of a pipeline. `is_procedural`: it is of a hit group of AABBs.
pub fn text(pipeline: &Pipeline, shader: &Shader, stage: ShaderStage, is_procedural: bool) -> String {
    let mut text = HEADER.to_owned();
    write_macros(&mut text, pipeline, stage, is_procedural);
    write_interface(&mut text, stage, is_procedural);
    text.push_str(FUNCTIONS);
    let signatures: Vec<Signature> = shader.functions.iter().map(|function| function.signature).collect();
    let depth = match stage {
        ShaderStage::RayGen | ShaderStage::AnyHit | ShaderStage::Intersection => "",
        ShaderStage::Callable => "gCalls = given.depth;",
        _ => "gDepth = given.depth;",
    };
    let in_place = pipeline.traces_in_place && traces(stage);
    for (index, function) in shader.functions.iter().enumerate() {
        let signature = function.signature;
        let mut writer = Writer {
            text: String::new(),
            traces: Traces::Called,
            loops: 0,
            signature,
            signatures: &signatures,
        };
        if in_place {
            writer.text.push_str("uint at; uint isHit; if (gDepth >= MAX_DEPTH) {\n");
            writer.traces = Traces::Ended;
            writer.write_statements(&function.body);
            writer.text.push_str("} else {\n");
            writer.traces = Traces::InPlace;
            writer.write_statements(&function.body);
            writer.text.push_str("}\n");
        } else {
            writer.write_statements(&function.body);
        }
        let (mut variables, result) = locals(&writer.text, signature);
        if !never_ends(&function.body) {
            writer.write_return(&result);
        }
        if signature == Signature::Main {
            variables = format!("{depth} uint v0 = INPUT; {variables}");
        }
        writeln!(text, "{} {{ {variables}\n{} }}", head(index, signature), writer.text).ok();
    }
    if signatures.last() == Some(&Signature::Plain) {
        let last = signatures.len() - 1;
        writeln!(text, "void main() {{ {depth} FINISH(f{last}(INPUT)) }}").ok();
    }
    text
}

/// True for stages whose shaders trace rays.
fn traces(stage: ShaderStage) -> bool {
    matches!(stage, ShaderStage::RayGen | ShaderStage::Miss | ShaderStage::ClosestHit)
}

fn write_macros(text: &mut String, pipeline: &Pipeline, stage: ShaderStage, is_procedural: bool) {
    let kind = if is_procedural { " + gl_HitKindEXT + mark" } else { "" };
    let hit = format!("uint(gl_InstanceID) + uint(gl_HitTEXT * 8.0 + 0.5) + gl_LaunchIDEXT.x{kind}");
    let builtin = match stage {
        ShaderStage::ClosestHit | ShaderStage::AnyHit => &hit,
        ShaderStage::Intersection => "uint(gl_InstanceID) + gl_LaunchIDEXT.x",
        ShaderStage::Miss => "gl_LaunchIDEXT.x + uint(gl_RayTmaxEXT)",
        _ => "gl_LaunchIDEXT.x",
    };
    let (input, finish) = match stage {
        ShaderStage::RayGen => ("gl_LaunchIDEXT.x", "results.at[gl_LaunchIDEXT.x] = (X) + g;"),
        ShaderStage::AnyHit => ("given.value + BUILT_IN", "g ^= (X);"),
        ShaderStage::Intersection => ("BUILT_IN + tag", "g ^= (X);"),
        _ => ("given.value", "given.value = (X) + g;"),
    };
    let macros = [
        ("MAX_DEPTH", format!("{MAX_DEPTH}u")),
        ("MAX_CALLABLE_DEPTH", format!("{MAX_CALLABLE_DEPTH}u")),
        ("CALLABLES", format!("{}u", pipeline.callables.len())),
        ("PROCEDURAL", format!("{}u", pipeline.procedural())),
        ("MOST_HITS", format!("{MOST_HITS}u")),
        ("BUILT_IN", format!("({builtin})")),
        ("INPUT", input.to_owned()),
        ("FINISH(X)", finish.to_owned()),
    ];
    for (name, value) in macros {
        writeln!(text, "#define {name} {value}").ok();
    }
}

/// Writes the payloads and the functions that wait or report.
fn write_interface(text: &mut String, stage: ShaderStage, is_procedural: bool) {
    if is_procedural {
        text.push_str("hitAttributeEXT uint mark;\n");
    }
    if traces(stage) {
        text.push_str("layout(location = 2) rayPayloadEXT Passed sent;\n");
        text.push_str(COLUMN);
        for (name, flags) in RAYS {
            text.push_str(&TRACE.replace("traced", name).replace("FLAGS", flags));
        }
    }
    match stage {
        ShaderStage::RayGen => text.push_str(CALL),
        ShaderStage::Intersection => text.push_str(REPORT),
        ShaderStage::Callable => {
            text.push_str(CALL);
            text.push_str("layout(location = 0) callableDataInEXT Passed given;\n");
        }
        ShaderStage::AnyHit => text.push_str("layout(location = 0) rayPayloadInEXT Passed given;\n"),
        _ => {
            text.push_str(CALL);
            text.push_str("layout(location = 0) rayPayloadInEXT Passed given;\n");
        }
    }
}

/// Returns the result and the parameters of a function.
fn head(index: usize, signature: Signature) -> String {
    match signature {
        Signature::Main => "void main()".to_owned(),
        Signature::Plain => format!("uint f{index}(uint v0)"),
        Signature::Bool => format!("bool f{index}(uint v0)"),
        Signature::InOut => format!("uint f{index}(uint v0, inout uint v2)"),
        Signature::Out => format!("uint f{index}(uint v0, out uint v2)"),
        Signature::InOutStruct => format!("uint f{index}(uint v0, inout Struct own)"),
        Signature::Void => format!("void f{index}(inout uint v0)"),
        Signature::Struct => format!("Struct f{index}(uint v0, Struct own)"),
    }
}

/// Returns the variables of a function, of those that its text names, and its result.
fn locals(body: &str, signature: Signature) -> (String, String) {
    let last = match signature {
        Signature::InOut => "",
        Signature::Out => "v2 = 7u;",
        _ => "uint v2 = 7u;",
    };
    let mut variables = format!("uint v1 = v0 + 1u; {last} uint a[{ELEMENTS}] = {{}};");
    let mut result = "v0 ^ v1 * 3u ^ v2 ^ a[1]".to_owned();
    let has_struct = matches!(signature, Signature::InOutStruct | Signature::Struct);
    let optional = [
        ("flag", "bool flag = false;".to_owned(), " ^ uint(flag) * 7u"),
        ("weight", "float weight = 0.0;".to_owned(), " ^ uint(weight)"),
        ("vector", "uvec3 vector = {};".to_owned(), ""),
        ("matrix", "mat2 matrix = {};".to_owned(), ""),
        ("own", if has_struct { String::new() } else { "Struct own = {};".to_owned() }, " ^ own.number"),
        ("structs", format!("Struct structs[{STRUCTS}] = {{}};"), ""),
    ];
    for (name, declaration, part) in optional {
        let is_parameter = name == "own" && has_struct;
        if is_parameter || names(body, name) {
            variables.push_str(&declaration);
            result.push_str(part);
        }
    }
    (variables, result)
}

/// True if a text has a variable of this name, and not only a member.
fn names(body: &str, name: &str) -> bool {
    body.match_indices(name).any(|(at, _)| {
        let before = body[..at].chars().next_back().unwrap_or(' ');
        let behind = body[at + name.len()..].chars().next().unwrap_or(' ');
        !before.is_alphanumeric() && before != '.' && !behind.is_alphanumeric()
    })
}
