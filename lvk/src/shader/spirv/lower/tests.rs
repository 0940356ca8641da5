//! Unit tests of lowered pipelines.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test")]

use ::spirv::Op;

use super::*;
use crate::shader::options::{CompileFiles, CompileOptions};
use crate::shader::{ShaderModuleDesc, ShaderSource, compile};

/// Compiles a shader.
fn compiled(stage: ShaderStage, text: &str, options: &CompileOptions) -> Vec<u32> {
    let desc = ShaderModuleDesc {
        stage,
        source: ShaderSource::Glsl(text),
        debug_name: "shader",
        ..Default::default()
    };
    compile(&desc, options, CompileFiles::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// The traversals, with the file of each and its options.
fn donors() -> [(&'static str, Traversal, CompileOptions); 4] {
    let options = CompileOptions { position_fetch: true, ..CompileOptions::default() };
    let software = CompileOptions { software_ray_query: true, ..options };
    let cpu = CompileOptions { is_cpu: true, ..software };
    [
        ("query.spv", Traversal::Query, options),
        ("software_gpu.spv", Traversal::SoftwareGpu, software),
        ("software_cpu.spv", Traversal::SoftwareCpu, cpu),
        (
            "software_cpu_pairs.spv",
            Traversal::SoftwareCpuPairs,
            CompileOptions { gathers_pairs: true, ..cpu },
        ),
    ]
}

/// `LVK_UPDATE_KERNELS=1 cargo test -p lvk kernel` rewrites the words.
#[test]
fn the_kernels_of_lowered_pipelines_are_those_of_their_source() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("src/shader/spirv/lower/donor");
    let text = std::fs::read_to_string(folder.join("lowered_pipeline.comp.glsl")).unwrap();
    for (file, _, options) in donors() {
        let words = compiled(ShaderStage::Compute, &text, &options);
        let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        if std::env::var("LVK_UPDATE_KERNELS").is_ok() {
            std::fs::write(folder.join(file), bytes).unwrap();
        } else {
            assert!(
                std::fs::read(folder.join(file)).unwrap() == bytes,
                "{file}: set LVK_UPDATE_KERNELS=1 once"
            );
        }
    }
}

/// The shaders of a pipeline: stage and text.
struct Pipeline<'a> {
    shaders: Vec<(ShaderStage, &'a str)>,
    miss: Vec<usize>,
    hit: Vec<HitShaders>,
    callable: Vec<usize>,
    max_recursion: u32,
}

/// Lowers a pipeline for each traversal, with the first shader as the ray generation shader.
fn lowered(pipeline: &Pipeline<'_>) -> Vec<Result<Vec<u32>, LoweringError>> {
    let one = |(_, traversal, options): (&str, Traversal, CompileOptions)| {
        let words: Vec<Vec<u32>> =
            pipeline.shaders.iter().map(|(stage, text)| compiled(*stage, text, &options)).collect();
        let stages = pipeline.shaders.iter().map(|(stage, _)| *stage);
        let modules: Vec<_> = stages
            .zip(&words)
            .map(|(stage, words)| StageModule { name: "shader", stage, words, specialization: &[] })
            .collect();
        lower(&Lowering {
            traversal,
            is_for_swiftshader: traversal == Traversal::SoftwareCpu,
            modules: &modules,
            ray_gen: 0,
            miss: &pipeline.miss,
            hit: &pipeline.hit,
            callable: &pipeline.callable,
            strides: [16, 32, 16],
            push_constant_bytes: 100,
            launch_offset: 248,
            max_recursion: pipeline.max_recursion,
            max_callable_depth: 2,
        })
    };
    donors().into_iter().map(one).collect()
}

const RAY_GEN: &str = "
    layout(location = 0) rayPayloadEXT vec3 color;
    layout(push_constant, scalar) uniform Push { uint tlas; vec3 eye; mat4 view; uint image; };
    void main() {
        color = vec3(0);
        vec3 direction = vec3(vec2(gl_LaunchIDEXT.xy) / vec2(gl_LaunchSizeEXT.xy), 1);
        traceRayEXT(kTLAS[tlas], gl_RayFlagsNoneEXT, 0xFF, 0, 1, 0, (view * vec4(eye, 1)).xyz, 0.0, direction, 100.0, 0);
        imageStore(kImages2D[image], ivec2(gl_LaunchIDEXT.xy), vec4(color, 1));
    }";

const MISS: &str = "
    layout(location = 0) rayPayloadInEXT vec3 color;
    void main() { color = gl_WorldRayDirectionEXT; }";

const CLOSEST_HIT: &str = "
    layout(location = 0) rayPayloadInEXT vec3 color;
    hitAttributeEXT vec2 attributes;
    layout(shaderRecordEXT, scalar) buffer Record { vec3 albedo; uint index; };
    void main() {
        color = albedo * attributes.x * gl_HitTEXT + vec3(gl_InstanceCustomIndexEXT, gl_PrimitiveID, index)
            + gl_ObjectToWorldEXT * vec4(1);
    }";

fn simple() -> Pipeline<'static> {
    Pipeline {
        shaders: vec![
            (ShaderStage::RayGen, RAY_GEN),
            (ShaderStage::Miss, MISS),
            (ShaderStage::ClosestHit, CLOSEST_HIT),
        ],
        miss: vec![1],
        hit: vec![HitShaders { closest_hit: Some(2), ..HitShaders::default() }],
        callable: vec![],
        max_recursion: 1,
    }
}

/// Traces in loops, in functions and in the branches of a switch.
const BUSY_RAY_GEN: &str = "
    struct Payload { vec3 color; float weights[3]; bool done; };
    layout(location = 0) rayPayloadEXT Payload payload;
    layout(location = 1) rayPayloadEXT float shadow;
    layout(location = 0) callableDataEXT vec4 data;
    layout(push_constant, scalar) uniform Push { uint tlas; uint count; uint image; };
    float visible(vec3 from, vec3 to) {
        if (from == to) return 1.0;
        shadow = 0.0;
        for (uint i = 0; i < 3; ++i) {
            if (i == count) return shadow;
            traceRayEXT(kTLAS[tlas], gl_RayFlagsTerminateOnFirstHitEXT | gl_RayFlagsSkipClosestHitShaderEXT, 0xFF, 0, 0, 1,
                from, 0.001, to - from, 1.0, 1);
        }
        return shadow;
    }
    void main() {
        vec3 sum = vec3(0);
        uint i = 0;
        do {
            payload = Payload(vec3(0), float[3](1.0, 2.0, 3.0), false);
            switch (i % 3) {
                case 0: sum += visible(vec3(i), vec3(1)); break;
                case 1: sum *= 2.0;
                default:
                    traceRayEXT(kTLAS[tlas], 0, 0xFF, 0, 1, 0, vec3(i), 0.0, vec3(0, 0, 1), 100.0, 0);
                    for (int j = 0; j < 3; ++j) { if (payload.weights[j] > 2.0) break; sum += payload.weights[j]; }
            }
            if (payload.done) continue;
            executeCallableEXT(i & 1, 0);
            sum += payload.color * data.xyz + (i > 4 && visible(sum, vec3(2)) > 0.5 ? 1.0 : 0.0);
            ++i;
        } while (i < count);
        imageStore(kImages2D[image], ivec2(gl_LaunchIDEXT.xy), vec4(sum, 1));
    }";

const MIRROR: &str = "
    struct Payload { vec3 color; float weights[3]; bool done; };
    layout(location = 0) rayPayloadInEXT Payload result;
    layout(location = 1) rayPayloadEXT Payload inner;
    hitAttributeEXT vec2 attributes;
    layout(shaderRecordEXT, scalar) buffer Record { uint tlas; vec3 tint; };
    vec3 kScale = vec3(0.5);
    vec3 reflected(vec3 from) {
        inner.color = vec3(0);
        traceRayEXT(kTLAS[tlas], 0, 0xFF, 0, 1, 0, from, 0.001, reflect(gl_WorldRayDirectionEXT, vec3(0, 1, 0)), 100.0, 1);
        return inner.color;
    }
    void main() {
        vec3 at = gl_WorldRayOriginEXT + gl_HitTEXT * gl_WorldRayDirectionEXT;
        vec3 color = tint;
        if (attributes.x > 0.25) { color *= reflected(at) * kScale; kScale += 1.0; }
        result.color = color * kScale + attributes.y + float(gl_PrimitiveID);
        result.weights[1] = inner.weights[2];
    }";

const STRUCT_MISS: &str = "
    struct Payload { vec3 color; float weights[3]; bool done; };
    layout(location = 0) rayPayloadInEXT Payload result;
    void main() { result.color = vec3(gl_RayTmaxEXT); result.done = true; }";

const SHADOW_MISS: &str = "layout(location = 1) rayPayloadInEXT float shadow; void main() { shadow += 1.0; }";

const ANY_HIT: &str = "
    hitAttributeEXT vec2 attributes;
    bool judged(float x) {
        for (int i = 0; i < 4; ++i) {
            if (x * float(i) > 1.5) ignoreIntersectionEXT;
            if (x * float(i) > 1.25) terminateRayEXT;
        }
        return x > 0.5;
    }
    void main() { if (judged(attributes.x)) { ignoreIntersectionEXT; } }";

const INTERSECTION: &str = "
    hitAttributeEXT vec3 normal;
    bool tried(float t) {
        normal = gl_ObjectRayOriginEXT + t;
        if (reportIntersectionEXT(t, 7u)) { return gl_RayTmaxEXT > 2.0; }
        return false;
    }
    void main() { if (!tried(1.0)) { tried(2.0); } else { reportIntersectionEXT(0.5, 3u); } }";

const BOX_HIT: &str = "
    struct Payload { vec3 color; float weights[3]; bool done; };
    layout(location = 0) rayPayloadInEXT Payload result;
    hitAttributeEXT vec3 normal;
    void main() { result.color = normal + float(gl_HitKindEXT); }";

const CALLABLE: &str = "
    layout(location = 0) callableDataInEXT vec4 data;
    void main() { data += vec4(1); }";

const CALLING: &str = "
    layout(location = 0) callableDataInEXT vec4 data;
    layout(location = 1) callableDataEXT vec4 inner;
    void main() { float kept = data.x; inner = data * 2.0; executeCallableEXT(0, 1); data += inner * kept; }";

/// A pipeline of everything; `callables` are its callable shaders.
fn busy(callables: [&'static str; 2]) -> Pipeline<'static> {
    Pipeline {
        shaders: vec![
            (ShaderStage::RayGen, BUSY_RAY_GEN),
            (ShaderStage::Miss, STRUCT_MISS),
            (ShaderStage::Miss, SHADOW_MISS),
            (ShaderStage::ClosestHit, MIRROR),
            (ShaderStage::AnyHit, ANY_HIT),
            (ShaderStage::Intersection, INTERSECTION),
            (ShaderStage::ClosestHit, BOX_HIT),
            (ShaderStage::Callable, callables[0]),
            (ShaderStage::Callable, callables[1]),
        ],
        miss: vec![1, 2],
        hit: vec![
            HitShaders { closest_hit: Some(3), any_hit: Some(4), intersection: None },
            HitShaders { closest_hit: Some(6), any_hit: None, intersection: Some(5) },
            HitShaders::default(),
            HitShaders { closest_hit: Some(3), any_hit: None, intersection: None },
        ],
        callable: vec![7, 8],
        max_recursion: 8,
    }
}

/// A closest-hit shader that traces a ray which runs no closest-hit shader.
const SHADOWED_HIT: &str = "
    layout(location = 0) rayPayloadInEXT vec3 color;
    layout(location = 1) rayPayloadEXT vec3 light;
    layout(push_constant, scalar) uniform Push { uint tlas; };
    void main() {
        light = vec3(0);
        traceRayEXT(kTLAS[tlas], gl_RayFlagsSkipClosestHitShaderEXT, 0xFF, 0, 1, 0, color, 0.0, vec3(0, 1, 0), 9.0, 1);
        color *= light;
    }";

fn shadowed() -> Pipeline<'static> {
    let mut pipeline = simple();
    pipeline.shaders[2].1 = SHADOWED_HIT;
    pipeline.max_recursion = 2;
    pipeline
}

#[test]
fn every_kind_of_pipeline_is_lowered() {
    let pipelines = [simple(), shadowed(), busy([CALLABLE; 2]), busy([CALLABLE, CALLING])];
    for pipeline in &pipelines {
        for words in lowered(pipeline) {
            let words = words.unwrap();
            crate::shader::spirv::words::validate(&words).unwrap();
            // No function calls itself, through others either.
            module::Module::parse(&words).unwrap();
            crate::test_support::kept_modules::write_module(&words);
        }
    }
}

/// The ray generation shader keeps the address of its words while it traces.
#[test]
fn variables_hold_no_pointers_where_the_driver_needs_it() {
    use ::spirv::{Op, StorageClass};

    const RAY_GEN: &str = "
        layout(buffer_reference, scalar) buffer Words { uint at[]; };
        layout(location = 0) rayPayloadEXT vec3 color;
        layout(push_constant, scalar) uniform Push { Words words; uint tlas; };
        void main() {
            Words own = words;
            for (uint i = 0; i < 3; i++) {
                traceRayEXT(kTLAS[tlas], 0, 0xFF, 0, 1, 0, vec3(i), 0.0, vec3(1), 9.0, 0);
                own = Words(uvec2(color.x, own.at[i]));
            }
            traceRayEXT(kTLAS[tlas], 0, 0xFF, 0, 1, 0, color, 0.0, vec3(1), 9.0, 0);
            traceRayEXT(kTLAS[tlas], 0, 0xFF, 0, 1, 0, color, 0.0, vec3(1), 9.0, 0);
            own.at[0] = 1;
        }";
    let mut pipeline = simple();
    pipeline.shaders[0].1 = RAY_GEN;
    for ((_, traversal, _), words) in donors().into_iter().zip(lowered(&pipeline)) {
        let words = words.unwrap();
        crate::shader::spirv::words::validate(&words).unwrap();
        let code: Vec<_> = crate::shader::spirv::words::instructions(&words).map(Result::unwrap).collect();
        let pointer = |ty: u32| {
            let found = code.iter().find(|inst| inst.op == Some(Op::TypePointer) && inst.operand(0) == ty);
            found.map(|inst| (inst.operand(1), inst.operand(2)))
        };
        let holds_pointer = |ty: u32| {
            let target = pointer(ty).and_then(|(_, target)| pointer(target));
            target.is_some_and(|(storage, _)| storage == StorageClass::PhysicalStorageBuffer as u32)
        };
        // A variable that is passed to a function is written once.
        let calls = || code.iter().filter(|inst| inst.op == Some(Op::FunctionCall));
        let is_passed = |variable: u32| calls().any(|inst| inst.words[4..].contains(&variable));
        let mut variables = code.iter().filter(|inst| inst.op == Some(Op::Variable));
        let has_any = variables.any(|inst| holds_pointer(inst.operand(0)) && !is_passed(inst.operand(1)));
        assert_eq!(has_any, traversal != Traversal::SoftwareCpu);
    }
}

/// The index of the image is the same for all rays, and the shader does not decorate it.
#[test]
fn images_are_decorated_where_the_driver_needs_it() {
    use ::spirv::{Decoration, Op};

    for ((_, traversal, _), words) in donors().into_iter().zip(lowered(&simple())) {
        let words = words.unwrap();
        let code: Vec<_> = crate::shader::spirv::words::instructions(&words).map(Result::unwrap).collect();
        let image = code.iter().find(|inst| inst.op == Some(Op::ImageWrite)).unwrap().operand(0);
        let decorations =
            code.iter().filter(|inst| inst.op == Some(Op::Decorate) && inst.operand(0) == image);
        let count = decorations.filter(|inst| inst.operand(1) == Decoration::NonUniform as u32).count();
        assert_eq!(count, usize::from(traversal == Traversal::SoftwareCpu));
    }
}

/// Returns a closest-hit shader that traces a ray, with a ray query of its own before and behind the trace.
fn querying_hit(before: &str, behind: &str) -> String {
    format!(
        "#extension GL_EXT_ray_query : require
         layout(location = 0) rayPayloadInEXT vec3 color;
         layout(push_constant, scalar) uniform Push {{ uint tlas; }};
         #define START rayQueryInitializeEXT(query, kTLAS[tlas], 0, 0xFF, vec3(0), 0.0, vec3(1), 9.0)
         void main() {{
             rayQueryEXT query;
             for (uint i = 0; i < 2; i++) {{
                 {before}
                 traceRayEXT(kTLAS[tlas], 0, 0xFF, 0, 1, 0, color, 0.0, vec3(1), 9.0, 0);
                 {behind}
                 while (rayQueryProceedEXT(query)) {{ color.x += 1.0; }}
             }}
         }}"
    )
}

#[test]
fn queries_that_go_on_behind_a_trace_are_refused() {
    let lowered_by_queries = |text: &str| {
        let mut pipeline: Pipeline<'_> = simple();
        let place = pipeline.shaders.iter().position(|(stage, _)| *stage == ShaderStage::ClosestHit).unwrap();
        pipeline.shaders[place].1 = text;
        pipeline.max_recursion = 2;
        lowered(&pipeline).swap_remove(0)
    };
    let words = lowered_by_queries(&querying_hit("", "START;")).unwrap();
    crate::shader::spirv::words::validate(&words).unwrap();
    let error = lowered_by_queries(&querying_hit("START;", "")).unwrap_err();
    assert!(error.message.contains("a ray query that goes on behind OpTraceRayKHR"), "{}", error.message);
}

/// The elements of a column of a matrix whose rows lie one behind another are not side by side.
#[test]
fn columns_of_row_major_matrices_are_aligned_as_their_elements() {
    use ::spirv::Op;

    const HIT: &str = "
        layout(location = 0) rayPayloadInEXT vec3 color;
        layout(shaderRecordEXT, scalar, LAYOUT) buffer Record { uint words[4]; mat4 matrix; };
        void main() { color = matrix[2].xyz; }";
    let loads = |layout: &str| -> Vec<Vec<u32>> {
        let text = HIT.replace("LAYOUT", layout);
        let mut pipeline = simple();
        pipeline.shaders[2].1 = &text;
        let alignments = |words: Vec<u32>| {
            let code = crate::shader::spirv::words::instructions(&words).map(Result::unwrap);
            let loads = code.filter(|inst| inst.op == Some(Op::Load) && inst.words.len() == 6);
            let mut found: Vec<u32> = loads.map(|inst| inst.operand(4)).collect();
            found.sort_unstable();
            found
        };
        lowered(&pipeline).into_iter().map(|words| alignments(words.unwrap())).collect()
    };
    for (rows, mut columns) in loads("row_major").into_iter().zip(loads("column_major")) {
        let place = columns.iter().position(|alignment| *alignment == 16).unwrap();
        columns[place] = 4;
        columns.sort_unstable();
        assert_eq!(rows, columns);
    }
}

/// Each instruction of ray tracing in a stage that does not have it: words of the right stage, under the name of another.
#[test]
fn instructions_of_other_stages_are_refused() {
    let options = CompileOptions::default();
    let trace = "layout(location = 1) rayPayloadEXT vec3 light;
        void main() { traceRayEXT(kTLAS[0], 0, 0xFF, 0, 0, 0, vec3(0), 0.0, vec3(1), 9.0, 1); }";
    let call = "layout(location = 1) callableDataEXT vec3 data; void main() { executeCallableEXT(0, 1); }";
    let report = "void main() { reportIntersectionEXT(1.0, 0u); }";
    use ShaderStage::{AnyHit, Callable, ClosestHit, Intersection, Miss, RayGen};
    for (stage, text, op, allowed) in [
        (RayGen, trace, "OpTraceRayKHR", &[RayGen, Miss, ClosestHit][..]),
        (RayGen, call, "OpExecuteCallableKHR", &[RayGen, Miss, ClosestHit, Callable]),
        (Intersection, report, "OpReportIntersectionKHR", &[Intersection]),
        (AnyHit, "void main() { ignoreIntersectionEXT; }", "OpIgnoreIntersectionKHR", &[AnyHit]),
        (AnyHit, "void main() { terminateRayEXT; }", "OpTerminateRayKHR", &[AnyHit]),
    ] {
        let words = compiled(stage, text, &options);
        for other in [RayGen, Miss, ClosestHit, AnyHit, Intersection, Callable] {
            let mut words = words.clone();
            let entry = words.windows(2).position(|pair| pair[0] & 0xffff == Op::EntryPoint as u32);
            words[entry.unwrap() + 1] = stage::execution_model(other) as u32;
            let mut linker = linker::Linker::new(VERSION_1_6);
            let module = StageModule { name: "shader", stage: other, words: &words, specialization: &[] };
            match stage::link_stage(&mut linker, &module) {
                Ok(_) => assert!(allowed.contains(&other), "{op} in {other:?}"),
                Err(message) => {
                    let expected = format!("{op} is not allowed in a shader of the stage {other:?}");
                    assert!(!allowed.contains(&other) && message == expected, "{op} in {other:?}: {message}");
                }
            }
        }
    }
}

/// Sixteen kilobytes that are needed behind a trace, at nine levels.
#[test]
fn stacks_have_a_limit() {
    const HIT: &str = "
        layout(location = 0) rayPayloadInEXT vec3 color;
        layout(location = 1) rayPayloadEXT vec3 own;
        void main() {
            uint kept[4096];
            for (uint i = 0; i < 4096; ++i) { kept[i] = i * gl_PrimitiveID; }
            own = color;
            traceRayEXT(kTLAS[0], 0, 0xFF, 0, 1, 0, color, 0.0, vec3(1), 9.0, 1);
            color.x += float(kept[uint(color.y) & 4095u]);
        }";
    for (max_recursion, is_lowered) in [(2, true), (8, false)] {
        let mut pipeline = simple();
        let place = pipeline.shaders.iter().position(|(stage, _)| *stage == ShaderStage::ClosestHit).unwrap();
        pipeline.shaders[place].1 = HIT;
        pipeline.max_recursion = max_recursion;
        for result in lowered(&pipeline) {
            assert_eq!(result.is_ok(), is_lowered, "{:?}", result.err());
            let Err(error) = result else { continue };
            let words = ["bytes of values at 9 levels", "at most 65536", "lower `max_recursion`"];
            assert!(words.iter().all(|word| error.message.contains(word)), "{}", error.message);
        }
    }
}

/// A module has one memory model, and the traversal has that of GLSL.
#[test]
fn shaders_of_the_vulkan_memory_model_are_refused() {
    const MISS: &str = "
        #pragma use_vulkan_memory_model
        layout(location = 0) rayPayloadInEXT vec3 color;
        void main() { color = vec3(1); }";
    let mut pipeline = simple();
    pipeline.shaders[1].1 = MISS;
    for result in lowered(&pipeline) {
        let error = result.unwrap_err();
        assert_eq!(error.message, "OpCapability VulkanMemoryModel cannot be lowered");
    }
}

/// Returns a ray generation shader whose deepest function has `statement` some times, and is called through three levels.
fn nested(statement: &str, [times, calls]: [usize; 2]) -> String {
    let level = |name: &str, called: &str| format!("void {name}() {{ {} }}", called.repeat(calls));
    format!(
        "layout(location = 0) rayPayloadEXT vec3 color;
        layout(location = 1) callableDataEXT vec3 data;
        layout(push_constant, scalar) uniform Push {{ uint tlas; uint image; }};
        void trace(uint flags) {{
            traceRayEXT(kTLAS[tlas], flags, 0xFF, 0, 1, 0, vec3(0), 0.0, vec3(0, 0, 1), 100.0, 0);
        }}
        void a() {{ {} }}
        {} {} {}
        void main() {{ d(); trace(0u); trace(1u); trace(2u);
            imageStore(kImages2D[image], ivec2(gl_LaunchIDEXT.xy), vec4(color + data, 1)); }}",
        statement.repeat(times),
        level("b", "a();"),
        level("c", "b();"),
        level("d", "c();")
    )
}

/// Lowers a ray generation shader with a miss shader and a callable shader that does nothing more.
fn lowered_ray_gen(text: &str) -> Vec<Result<Vec<u32>, LoweringError>> {
    const CALLABLE: &str = "layout(location = 0) callableDataInEXT vec3 data; void main() { data += 1.0; }";
    lowered(&Pipeline {
        shaders: vec![
            (ShaderStage::RayGen, text),
            (ShaderStage::Miss, MISS),
            (ShaderStage::Callable, CALLABLE),
        ],
        miss: vec![1],
        hit: Vec::new(),
        callable: vec![2],
        max_recursion: 1,
    })
}

#[test]
fn every_id_is_defined_once_where_calls_are_replaced_in_place() {
    let shadow = "traceRayEXT(kTLAS[tlas], 12u, 0xFF, 0, 1, 0, vec3(0), 0.0, vec3(0, 0, 1), 100.0, 0);";
    for (statement, counts) in [("executeCallableEXT(image, 1);", [1, 10]), (shadow, [1, 8])] {
        for words in lowered_ray_gen(&nested(statement, counts)) {
            let module = module::Module::parse(&words.unwrap()).unwrap();
            let code = module.functions.iter().flat_map(module::Function::code);
            let mut ids: Vec<u32> = code.filter_map(instruction::Inst::result).collect();
            let count = ids.len();
            ids.sort_unstable();
            ids.dedup();
            assert_eq!(ids.len(), count, "{statement} {counts:?}");
            assert!(ids.last() < Some(&module.bound));
        }
    }
}

/// Decorations of memory belong to variables and parameters, and those of arithmetic to what computes a value.
#[test]
fn qualifiers_of_parameters_are_not_those_of_arguments() {
    use ::spirv::{Decoration, Op};

    const OF_MEMORY: [Decoration; 6] = [
        Decoration::Aliased,
        Decoration::Restrict,
        Decoration::Volatile,
        Decoration::Coherent,
        Decoration::NonWritable,
        Decoration::NonReadable,
    ];
    const RAY_GEN: &str = "
        layout(location = 0) rayPayloadEXT vec3 color;
        layout(buffer_reference, scalar) readonly buffer Lights { vec4 at[]; };
        layout(push_constant, scalar) uniform Push { Lights lights; uint tlas; uint image; float size; };
        void shade(const Lights given, writeonly image2D target, const mediump float size) {
            traceRayEXT(kTLAS[tlas], 0, 0xFF, 0, 1, 0, given.at[0].xyz, 0.0, vec3(0, 0, size), 100.0, 0);
            imageStore(target, ivec2(gl_LaunchIDEXT.xy), vec4(color, given.at[1].x));
        }
        void main() {
            float wide = size * 1.5;
            shade(lights, kImages2D[image], wide);
            shade(lights, kImages2D[image + 1], wide);
            shade(lights, kImages2D[image + 2], wide);
            imageStore(kImages2D[image], ivec2(0), vec4(wide));
        }";
    for words in lowered_ray_gen(RAY_GEN) {
        let words = words.unwrap();
        let code: Vec<_> = crate::shader::spirv::words::instructions(&words).map(Result::unwrap).collect();
        let defining = |id: u32| {
            let is_it =
                |op: Op| code.iter().any(|inst| inst.op == Some(op) && inst.words.get(2) == Some(&id));
            [Op::Variable, Op::FunctionParameter].into_iter().any(is_it)
        };
        let decorated = |kinds: &[Decoration]| -> Vec<u32> {
            let is_one = |word: u32| kinds.iter().any(|kind| word == *kind as u32);
            let decorations =
                code.iter().filter(|inst| inst.op == Some(Op::Decorate) && is_one(inst.operand(1)));
            decorations.map(|inst| inst.operand(0)).collect()
        };
        for id in decorated(&OF_MEMORY) {
            assert!(defining(id), "%{id} is neither a variable nor a parameter");
        }
        let products =
            code.iter().filter(|inst| inst.op == Some(Op::FMul)).filter_map(|inst| inst.words.get(2));
        let precise: Vec<u32> = products.copied().collect();
        let relaxed = decorated(&[Decoration::RelaxedPrecision]);
        assert!(!precise.is_empty() && precise.iter().all(|id| !relaxed.contains(id)), "{relaxed:?}");
    }
}
