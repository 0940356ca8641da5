//! Compiles real shaders and reads them back.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test")]

use std::path::Path;

use ::spirv::{Capability, Decoration, Op};
use proptest::prelude::*;

use super::*;
use crate::error::{Error, Result};

fn desc(stage: ShaderStage, text: &str) -> ShaderModuleDesc<'_> {
    ShaderModuleDesc {
        stage,
        source: ShaderSource::Glsl(text),
        debug_name: "test",
        ..ShaderModuleDesc::default()
    }
}

fn build(desc: &ShaderModuleDesc<'_>) -> Result<Vec<u32>> {
    compile(desc, &CompileOptions::default(), None)
}

fn words(stage: ShaderStage, text: &str) -> Vec<u32> {
    build(&desc(stage, text)).unwrap_or_else(|error| panic!("{stage:?}: {error}\n{text}"))
}

fn facts(stage: ShaderStage, text: &str) -> Reflection {
    reflect("test", stage, &words(stage, text)).unwrap()
}

/// The log of the error; the error must be about the shader.
fn log<T: std::fmt::Debug>(result: Result<T>) -> String {
    match result {
        Err(Error::Shader { name, log }) => {
            assert_eq!(name, "test");
            log
        }
        other => panic!("not a shader error: {other:?}"),
    }
}

fn error(stage: ShaderStage, text: &str) -> String {
    log(build(&desc(stage, text)))
}

fn capabilities(words: &[u32]) -> Vec<u32> {
    let instructions = spirv::instructions(words).map(|i| i.unwrap());
    instructions.filter(|i| i.op == Some(Op::Capability)).map(|i| i.operand(0)).collect()
}

fn declares(words: &[u32], name: &str) -> bool {
    spirv::instructions(words).map(|i| i.unwrap()).any(|i| i.op == Some(Op::Name) && i.string(1).0 == name)
}

/// A whole shader of `stage` around a body; `globals` stand in front of `main`.
fn shader(stage: ShaderStage, globals: &str, body: &str) -> String {
    let layout = match stage {
        ShaderStage::Compute | ShaderStage::Task => "layout(local_size_x = 32) in;",
        ShaderStage::TessControl => "layout(vertices = 3) out;",
        ShaderStage::TessEval => "layout(triangles) in;",
        ShaderStage::Geometry => "layout(triangles) in; layout(triangle_strip, max_vertices = 3) out;",
        ShaderStage::Mesh => {
            "layout(local_size_x = 32) in; layout(triangles, max_vertices = 3, max_primitives = 1) out;"
        }
        _ => "",
    };
    format!("{layout}\n{globals}\nvoid main() {{\n{body}\n}}\n")
}

const HELPERS: &str = "
    uint tex = push.tex; uint smp = push.smp; vec2 uv = push.uv; vec3 dir = vec3(uv, 0.5);
    vec4 sum = textureBindless2D(tex, smp, uv) + textureBindless2DLod(tex, smp, uv, 1.0)
        + textureBindless2DGrad(tex, smp, uv, uv, uv) + textureBindless2DGather(tex, smp, uv)
        + textureBindless2DShadow(tex, smp, dir) + textureBindless2DArray(tex, smp, dir)
        + textureBindless2DArrayLod(tex, smp, dir, 1.0) + textureBindless3D(tex, smp, dir)
        + textureBindless3DLod(tex, smp, dir, 1.0) + textureBindlessCube(tex, smp, dir)
        + textureBindlessCubeLod(tex, smp, dir, 1.0) + textureBindlessFetch2D(tex, ivec2(1), 0)
        + vec4(textureBindlessFetchU2D(tex, ivec2(1), 0)) + vec4(textureBindlessFetchI2D(tex, ivec2(1), 0));
    ivec3 size = ivec3(textureBindlessSize2D(tex), 1) + textureBindlessSize2DArray(tex) + textureBindlessSize3D(tex)
        + ivec3(textureBindlessSizeCube(tex), 1);
    int levels = textureBindlessQueryLevels2D(tex) + textureBindlessQueryLevelsCube(tex);
    vec4 shadowed = texture2DSample(tex, smp, uv);
    imageStore(kImages2D[tex], ivec2(1), sum + shadowed);
    imageStore(kImages2DArray[nonuniformEXT(tex)], size, vec4(levels));
    imageStore(kImages3D[tex], ivec3(1), sum);
    imageStore(kImagesU2D[tex], ivec2(1), uvec4(1));
    imageStore(kImagesI2D[tex], ivec2(1), ivec4(1));
    imageStore(kRgba8[tex], ivec2(1), imageLoad(kRgba8[tex], ivec2(2)));
    imageAtomicAdd(kCounters[tex], ivec2(1), 1u);
    imageAtomicAdd(kSigned[tex], ivec2(1), 1);
    imageStore(kVolumes[tex], ivec3(1), imageLoad(kVolumes[tex], ivec3(1)));
";

const GLOBALS: &str = "
LVK_STORAGE_IMAGES_2D(rgba8, kRgba8);
LVK_STORAGE_IMAGES_U2D(r32ui, kCounters);
LVK_STORAGE_IMAGES_I2D(r32i, kSigned);
LVK_STORAGE_IMAGES(image3D, r32f, kVolumes);
layout(push_constant, scalar) uniform Push { uint tex; uint smp; vec2 uv; } push;
vec4 texture2DSample(uint tex, uint smp, vec2 uv) {
    return textureLod(sampler2D(kTextures2DShadow[tex], kSamplers[smp]), uv, 0.0);
}
";

#[test]
fn every_helper_compiles_in_every_stage() {
    for stage in ShaderStage::ALL {
        let found = facts(stage, &shader(stage, GLOBALS, HELPERS));
        assert_eq!(found.bindings, [0, 1, 2], "{stage:?}");
        assert_eq!(found.push_constant_bytes, 16, "{stage:?}");
        assert_eq!(found.ray_tracing, stage.is_ray_tracing(), "{stage:?}");
        assert!(!found.ray_query, "{stage:?}");
    }
}

#[test]
fn implicit_level_is_used_only_where_derivatives_exist() {
    let body = "vec4 c = textureBindless2D(1, 2, vec2(0.5)); imageStore(kImages2D[0], ivec2(0), c);";
    let implicit = |stage| {
        let words = words(stage, &shader(stage, "", body));
        spirv::instructions(&words).any(|i| i.unwrap().op == Some(Op::ImageSampleImplicitLod))
    };
    for stage in ShaderStage::ALL {
        assert_eq!(implicit(stage), stage == ShaderStage::Fragment, "{stage:?}");
    }
}

#[test]
fn an_empty_shader_asks_nothing_of_the_device() {
    for stage in [ShaderStage::Vertex, ShaderStage::Fragment, ShaderStage::Compute] {
        let words = words(stage, &shader(stage, "", ""));
        let allowed = [Capability::Shader as u32, Capability::RuntimeDescriptorArray as u32];
        for capability in capabilities(&words) {
            assert!(allowed.contains(&capability), "{stage:?}: {:?}", Capability::from_u32(capability));
        }
        assert!(!declares(&words, "kTextures2D"), "{stage:?} keeps an unused array");
        assert!(reflect("test", stage, &words).unwrap().bindings.is_empty());
    }
}

#[test]
fn used_arrays_survive_the_removal_of_unused_ones() {
    let words = words(
        ShaderStage::Compute,
        &shader(ShaderStage::Compute, "", "imageStore(kImages2D[3], ivec2(0), vec4(1));"),
    );
    assert!(declares(&words, "kImages2D"));
    assert!(!declares(&words, "kImages3D"));
    assert_eq!(reflect("test", ShaderStage::Compute, &words).unwrap().bindings, [2]);
}

#[test]
fn removal_leaves_no_loose_ends() {
    for stage in ShaderStage::ALL {
        let words = words(stage, &shader(stage, GLOBALS, HELPERS));
        let all: Vec<_> = spirv::instructions(&words).map(|i| i.unwrap()).collect();
        let variables: Vec<u32> =
            all.iter().filter(|i| i.op == Some(Op::Variable)).map(|i| i.operand(1)).collect();
        let entry = all.iter().find(|i| i.op == Some(Op::EntryPoint)).unwrap();
        let interface = &entry.operands()[2 + entry.string(2).1..];
        assert!(interface.iter().all(|id| variables.contains(id)), "{stage:?}");
        let bound =
            all.iter().filter(|i| i.op == Some(Op::Decorate) && i.operand(1) == Decoration::Binding as u32);
        for decorate in bound {
            assert!(variables.contains(&decorate.operand(0)), "{stage:?}");
        }
    }
}

#[test]
fn sampled_operands_are_marked_non_uniform() {
    let text = shader(ShaderStage::Compute, "", "uint i = gl_LocalInvocationIndex;
        imageStore(kImages2D[0], ivec2(0), textureBindless2D(i, i, vec2(0)) + textureBindlessFetch2D(i, ivec2(0), 0));");
    let words = words(ShaderStage::Compute, &text);
    let all: Vec<_> = spirv::instructions(&words).map(|i| i.unwrap()).collect();
    let non_uniform = |id: u32| {
        let marks = |i: &&spirv::Instruction<'_>| {
            i.op == Some(Op::Decorate) && i.operand(1) == Decoration::NonUniform as u32
        };
        all.iter().filter(marks).any(|i| i.operand(0) == id)
    };
    for op in [Op::ImageSampleExplicitLod, Op::ImageFetch] {
        let image = all.iter().find(|i| i.op == Some(op)).unwrap().operand(2);
        assert!(non_uniform(image), "{op:?}");
        // Not by a copy of what was loaded or combined: SwiftShader misses the mark there.
        let is_maker = |i: &&spirv::Instruction<'_>| matches!(i.op, Some(Op::SampledImage | Op::Load));
        assert!(all.iter().filter(is_maker).any(|i| i.operand(1) == image), "{op:?}");
    }
}

#[test]
fn formatless_reads_follow_the_device() {
    let text = shader(
        ShaderStage::Compute,
        "",
        "imageStore(kImages2D[1], ivec2(0), imageLoad(kImages2D[0], ivec2(0)));",
    );
    let read = CompileOptions { formatless_read: true, ..Default::default() };
    let words = compile(&desc(ShaderStage::Compute, &text), &read, None).unwrap();
    assert!(capabilities(&words).contains(&(Capability::StorageImageReadWithoutFormat as u32)));
    assert!(error(ShaderStage::Compute, &text).contains("writeonly"));
}

#[test]
fn errors_carry_the_callers_lines() {
    let plain = error(ShaderStage::Compute, "void main() {\n    int a = 1;\n    foo = 2;\n}");
    assert!(plain.starts_with("line 3: 'foo' : undeclared identifier"), "{plain}");
    assert!(!plain.contains("ERROR") && !plain.contains("compilation"), "{plain}");
    let versioned =
        error(ShaderStage::Fragment, "// é\r\n#version 460 core\r\nvoid main() {\r\n    foo = 2;\r\n}");
    assert!(versioned.starts_with("line 4: 'foo'"), "{versioned}");
    let ray_gen = error(ShaderStage::RayGen, "void main() { foo = 2; }");
    assert!(ray_gen.starts_with("line 1: 'foo'"), "{ray_gen}");
    let late = error(ShaderStage::Compute, "int a;\n#version 460\nvoid main() {}");
    assert!(late.starts_with("line 2: "), "{late}");
}

#[test]
fn errors_in_included_files_name_file_and_line() {
    let includes =
        [("brdf/a.glsl", "// first\n#include \"b.glsl\"\n"), ("brdf/b.glsl", "int ok;\n\nint bad = foo;\n")];
    let text = "\n#include \"brdf/a.glsl\"\nvoid main() { bar = 1; }\n";
    let module = ShaderModuleDesc { includes: &includes, ..desc(ShaderStage::Compute, text) };
    let found = log(build(&module));
    assert!(found.contains("brdf/b.glsl:3: 'foo'"), "{found}");
    let good = [includes[0], ("brdf/b.glsl", "int ok;")];
    let found = log(build(&ShaderModuleDesc { includes: &good, ..module }));
    assert!(found.starts_with("line 3: 'bar'"), "{found}");
}

#[test]
fn includes_are_found_beside_the_includer_and_in_the_folders() {
    let dir = std::env::temp_dir().join(format!("lvk-include-{}", std::process::id()));
    std::fs::create_dir_all(dir.join("sub")).unwrap();
    std::fs::write(dir.join("sub/a.glsl"), "#pragma once\n#include \"b.glsl\"\nint a() { return b(); }\n")
        .unwrap();
    std::fs::write(dir.join("sub/b.glsl"), "int b() { return LISTED; }\n").unwrap();
    std::fs::write(dir.join("bad.glsl"), "int x;\nint y = z;\n").unwrap();
    let dirs: [&Path; 1] = [&dir];
    let text = "#include \"sub/a.glsl\"\n#include <sub/a.glsl>\n#include \"listed.glsl\"\nvoid main() { int c = a(); }";
    let includes = [("listed.glsl", "int listed;")];
    let module = ShaderModuleDesc {
        includes: &includes,
        include_dirs: &dirs,
        defines: &[("LISTED", "7")],
        ..desc(ShaderStage::Compute, text)
    };
    let result = build(&module);
    let bad = build(&ShaderModuleDesc {
        source: ShaderSource::Glsl("#include \"bad.glsl\"\nvoid main(){}"),
        ..module
    });
    std::fs::remove_dir_all(&dir).unwrap();
    result.unwrap();
    assert!(log(bad).contains("bad.glsl:2: 'z'"));
}

#[test]
fn debug_info_holds_the_texts_as_written() {
    let text = "// first line\n#include \"one.glsl\"\n#include \"one.glsl\"\nvoid main() { one(); }\n";
    let one = "#pragma once\nvoid one() {}\n";
    let desc = ShaderModuleDesc {
        includes: &[("one.glsl", one)],
        debug_info: true,
        debug_name: "textful",
        ..desc(ShaderStage::Vertex, text)
    };
    let words = build(&desc).unwrap();
    let code: Vec<_> = spirv::instructions(&words).map(Result::unwrap).collect();
    let sources: Vec<_> = code.iter().filter(|i| i.op == Some(Op::Source)).collect();
    let name = |id: u32| {
        let is_named = |i: &&spirv::Instruction<'_>| i.op == Some(Op::String) && i.operand(0) == id;
        code.iter().find(is_named).unwrap().string(1).0
    };
    let found: Vec<_> = sources.iter().map(|i| (name(i.operand(2)), i.string(3).0)).collect();
    let owned = |(a, b): (&str, &str)| (a.to_owned(), b.to_owned());
    let once = one.replace("#pragma once", "");
    assert_eq!(found, [owned(("textful", text)), owned(("one.glsl", &once))]);
    assert!(reflect("textful", ShaderStage::Vertex, &words).is_ok());
    let bare = build(&ShaderModuleDesc { debug_info: false, ..desc }).unwrap();
    assert!(bare.len() + text.len() / 4 < words.len());
}

#[test]
fn a_missing_include_names_the_places_and_the_chain() {
    let includes = [("a.glsl", "\n\n#include \"nothing.glsl\"\n")];
    let module = ShaderModuleDesc {
        includes: &includes,
        ..desc(ShaderStage::Compute, "#include \"a.glsl\"\nvoid main() {}")
    };
    let found = log(build(&module));
    assert!(
        found.contains("a.glsl:3: include 'nothing.glsl' not found in the listed includes (a.glsl)"),
        "{found}"
    );
    assert!(found.contains("included by a.glsl"), "{found}");
    let found = error(ShaderStage::Compute, "\n#include <lvk/nothing.glsl>\nvoid main() {}");
    assert!(
        found.starts_with(
            "line 2: the library has no <lvk/nothing.glsl>; it has <lvk/hardware_ray_query.glsl>"
        ),
        "{found}"
    );
    let found = error(ShaderStage::Compute, "#include \"x\"\nvoid main() {}");
    assert_eq!(found, "line 1: include 'x' not found: the module lists no includes and no include_dirs");
    let found = error(ShaderStage::Compute, "\n\n#include <y>\nvoid main() {}");
    assert!(found.starts_with("line 3: include 'y' not found"), "{found}");
}

#[test]
fn include_cycles_end_in_an_error_with_the_chain() {
    let cycle = [("a", "#include \"b\"\n"), ("b", "#include \"a\"\n")];
    let module =
        ShaderModuleDesc { includes: &cycle, ..desc(ShaderStage::Compute, "#include \"a\"\nvoid main() {}") };
    let found = log(build(&module));
    assert!(
        found.contains("'a' includes itself") && found.contains("included by b, included by a"),
        "{found}"
    );
    let guarded = [
        ("a", "#ifndef A\n#define A\n#include \"b\"\n#endif\n"),
        ("b", "#pragma once\n#include \"a\"\nint b;\n"),
    ];
    build(&ShaderModuleDesc { includes: &guarded, ..module }).unwrap();
}

#[test]
fn damaged_text_is_an_error() {
    assert!(error(ShaderStage::Compute, "void main() {\n\0}").starts_with("line 2: a NUL"));
    assert!(error(ShaderStage::Compute, "void main() {\n int é; }").starts_with("line 2: the character"));
    assert!(
        error(ShaderStage::Compute, "#version 310 es\nvoid main() {}").starts_with("line 1: #version 310 es")
    );
    assert!(!error(ShaderStage::Compute, "").is_empty());
    let includes = [("a", "int a;\n\0")];
    let module = ShaderModuleDesc {
        includes: &includes,
        ..desc(ShaderStage::Compute, "#include \"a\"\nvoid main() {}")
    };
    assert!(log(build(&module)).contains("a:2: a NUL"));
    for define in [("A B", ""), ("1A", ""), ("", ""), ("A", "1\nint x;"), ("A", "\\"), ("A\0", "")] {
        let defines = [define];
        let module = ShaderModuleDesc { defines: &defines, ..desc(ShaderStage::Compute, "void main() {}") };
        assert!(log(build(&module)).starts_with("define '"), "{define:?}");
    }
}

#[test]
fn own_extensions_may_follow_the_preamble() {
    let text = "#version 460\n#extension GL_EXT_ray_query : require\n#extension GL_EXT_fragment_shader_barycentric : enable\n\
                void main() { rayQueryEXT rq; }";
    words(ShaderStage::Fragment, text);
}

const QUERY: &str = "
    LvkRayQuery rq;
    vec3 v = vec3(0); uint n = 0u; float t = 0.0; bool b = false; mat4x3 m = mat4x3(0);
    lvkRayQueryInitialize(rq, 5u, LVK_RAY_FLAG_OPAQUE | LVK_RAY_FLAG_TERMINATE_ON_FIRST_HIT, 0xFFu, vec3(0), 0.0, vec3(0, 0, 1), 9.0);
    while (lvkRayQueryProceed(rq)) {
        if (lvkRayQueryType(rq, LVK_CANDIDATE) == LVK_CANDIDATE_TRIANGLE) lvkRayQueryConfirmIntersection(rq);
        else if (lvkRayQueryCandidateAabbOpaque(rq)) lvkRayQueryGenerateIntersection(rq, 1.0);
        else lvkRayQueryTerminate(rq);
    }
    if (lvkRayQueryType(rq, LVK_COMMITTED) != LVK_COMMITTED_NONE) {
        t += lvkRayQueryT(rq, LVK_COMMITTED) + lvkRayQueryTMin(rq);
        n += uint(lvkRayQueryInstanceId(rq, LVK_COMMITTED, 0) + lvkRayQueryInstanceCustomIndex(rq, LVK_COMMITTED)
            + lvkRayQueryGeometryIndex(rq, LVK_COMMITTED) + lvkRayQueryPrimitiveIndex(rq, LVK_COMMITTED, 0));
        n += lvkRayQuerySbtOffset(rq, LVK_COMMITTED) + lvkRayQueryFlags(rq);
        v += vec3(lvkRayQueryBarycentrics(rq, LVK_COMMITTED), 0) + lvkRayQueryObjectRayOrigin(rq, LVK_COMMITTED)
            + lvkRayQueryObjectRayDirection(rq, LVK_COMMITTED) + lvkRayQueryWorldRayOrigin(rq) + lvkRayQueryWorldRayDirection(rq);
        b = lvkRayQueryFrontFace(rq, LVK_COMMITTED);
        m = lvkRayQueryObjectToWorld(rq, LVK_COMMITTED) + lvkRayQueryWorldToObject(rq, LVK_COMMITTED);
    }
    imageStore(kImages2D[0], ivec2(0), vec4(v + m[0], t + float(n) + float(b)));
";

#[test]
fn ray_queries_compile_in_every_stage() {
    for stage in ShaderStage::ALL {
        let text = shader(stage, "#include <lvk/ray_query.glsl>\n#include \"lvk/ray_query.glsl\"", QUERY);
        let found = facts(stage, &text);
        assert!(found.ray_query, "{stage:?}");
        assert_eq!(found.ray_tracing, stage.is_ray_tracing(), "{stage:?}");
        assert_eq!(found.bindings, [2, 4, 5], "{stage:?}");
    }
}

#[test]
fn ray_tracing_pipelines_have_their_array_and_flags() {
    let trace = "traceRayEXT(kTLAS[push.tlas], LVK_RAY_FLAG_OPAQUE, 0xFF, 0, 0, 0, vec3(0), 0.0, vec3(0, 0, 1), 9.0, 0);
        executeCallableEXT(2, 1);";
    let push = "layout(push_constant) uniform Push { uint tlas; } push;";
    let payload =
        "layout(location = 0) rayPayloadEXT vec3 colour; layout(location = 1) callableDataEXT float data;";
    let ray_gen =
        facts(ShaderStage::RayGen, &shader(ShaderStage::RayGen, &format!("{push}{payload}"), trace));
    assert_eq!((ray_gen.bindings, ray_gen.push_constant_bytes), (vec![4], 4));
    let incoming = "layout(location = 0) rayPayloadInEXT vec3 colour; hitAttributeEXT vec2 bary;";
    let record = "layout(shaderRecordEXT, scalar) buffer Record { vec3 tint; } record;";
    let hit = format!("{incoming}{record}");
    facts(
        ShaderStage::ClosestHit,
        &shader(ShaderStage::ClosestHit, incoming, "colour = vec3(bary, gl_HitTEXT);"),
    );
    facts(ShaderStage::ClosestHit, &shader(ShaderStage::ClosestHit, &hit, "colour = record.tint;"));
    facts(
        ShaderStage::AnyHit,
        &shader(ShaderStage::AnyHit, incoming, "if (bary.x > 0.5) ignoreIntersectionEXT;"),
    );
    facts(
        ShaderStage::Miss,
        "layout(location = 0) rayPayloadInEXT vec3 colour; void main() { colour = vec3(0); }",
    );
    facts(
        ShaderStage::Intersection,
        "hitAttributeEXT vec2 bary; void main() { bary = vec2(0); reportIntersectionEXT(1.0, 0u); }",
    );
    facts(
        ShaderStage::Callable,
        "layout(location = 1) callableDataInEXT float data; void main() { data = 1.0; }",
    );
    let wrong = error(ShaderStage::Compute, "#include <lvk/ray_tracing.glsl>\nvoid main() {}");
    assert!(wrong.contains("ray_query"), "{wrong}");
}

#[test]
fn push_constants_are_measured_by_their_layout() {
    let bytes = |layout: &str, block: &str| {
        let globals = format!(
            "layout(buffer_reference) buffer Node;\nlayout(buffer_reference, scalar) buffer Node {{ Node next; float v; }};\nstruct S {{ vec3 a; float b; vec3 c; }};\n\
             layout(push_constant, {layout}) uniform Push {{ {block} }} push;"
        );
        let body = "imageStore(kImages2D[0], ivec2(0), vec4(push.last));";
        facts(ShaderStage::Compute, &shader(ShaderStage::Compute, &globals, body)).push_constant_bytes
    };
    assert_eq!(bytes("scalar", "vec3 a; float last;"), 16);
    assert_eq!(bytes("std430", "float a; vec3 b; float last;"), 32);
    assert_eq!(bytes("scalar", "float a; vec3 b; float last;"), 20);
    assert_eq!(bytes("scalar", "uint a; Node node; float last;"), 20);
    assert_eq!(bytes("std430", "float last; Node node;"), 16);
    assert_eq!(bytes("scalar", "float last; vec3 a[3];"), 40);
    assert_eq!(bytes("std430", "float last; vec3 a[3];"), 64);
    assert_eq!(bytes("scalar", "float last; S s[2];"), 60);
    assert_eq!(bytes("std430", "float last; S s;"), 44);
    assert_eq!(bytes("scalar", "float last; mat3 m; mat4x3 n;"), 88);
    assert_eq!(bytes("std430", "mat3 m; float last;"), 52);
    assert_eq!(bytes("std430", "float last; mat4 m[2];"), 144);
    assert_eq!(bytes("scalar", "float last; layout(row_major) mat4x3 m;"), 52);
    assert_eq!(bytes("scalar", "float last; uint64_t address; uint8_t small;"), 20);
    assert_eq!(bytes("scalar", "layout(offset = 64) float last;"), 68);
    assert_eq!(facts(ShaderStage::Compute, "void main() {}").push_constant_bytes, 0);
}

#[test]
fn work_group_sizes_and_specialization_are_reported() {
    let plain = facts(ShaderStage::Compute, "layout(local_size_x = 8, local_size_y = 4) in; void main() {}");
    assert_eq!((plain.local_size, plain.local_size_ids), ([8, 4, 1], [None; 3]));
    let text = "layout(local_size_x = 8, local_size_x_id = 3) in; layout(constant_id = 1) const bool on = true;\n\
                layout(constant_id = 9) const double big = 1.0; layout(constant_id = 2) const uint n = 4;\n\
                void main() { if (on) imageStore(kImages2D[n], ivec2(gl_WorkGroupSize.x), vec4(float(big))); }";
    let found = facts(ShaderStage::Compute, text);
    assert_eq!((found.local_size, found.local_size_ids), ([8, 1, 1], [Some(3), None, None]));
    assert_eq!(found.specialization, [(1, 4), (2, 4), (3, 4), (9, 8)]);
    let mesh = shader(ShaderStage::Mesh, "", "SetMeshOutputsEXT(0u, 0u);");
    let mesh = facts(ShaderStage::Mesh, &mesh);
    assert_eq!((mesh.local_size, mesh.mesh_outputs), ([32, 1, 1], [3, 1]));
    let fragment = facts(ShaderStage::Fragment, "void main() {}");
    assert_eq!((fragment.local_size, fragment.mesh_outputs), ([0; 3], [0; 2]));
}

#[test]
fn foreign_bindings_are_refused_with_the_remedy() {
    let refuse = |declaration: &str, uses: &str| {
        let text = shader(ShaderStage::Fragment, declaration, &format!("colour = {uses};"));
        let words = words(ShaderStage::Fragment, &format!("layout(location = 0) out vec4 colour;\n{text}"));
        log(reflect("test", ShaderStage::Fragment, &words))
    };
    let found =
        refuse("layout(set = 1, binding = 3) uniform texture2D albedo;", "texelFetch(albedo, ivec2(0), 0)");
    assert!(
        found.contains("'albedo' is in set 1, binding 3; resources live in set 0 at bindings 0 sampled"),
        "{found}"
    );
    let found = refuse("layout(set = 0, binding = 0) uniform sampler2D both;", "texture(both, vec2(0))");
    assert!(found.contains("binding 0, which holds sampled images"), "{found}");
    let found = refuse("layout(set = 0, binding = 7) uniform texture2D t;", "texelFetch(t, ivec2(0), 0)");
    assert!(found.contains("binding 7, which does not exist"), "{found}");
    let found = refuse("layout(set = 0, binding = 0) uniform Block { vec4 c; } block;", "block.c");
    assert!(found.contains("buffer_reference"), "{found}");
    let found = refuse("layout(set = 0, binding = 2) buffer Block { vec4 c; } block;", "block.c");
    assert!(found.contains("buffer_reference"), "{found}");
    let found = refuse("layout(set = 0, binding = 0) uniform textureBuffer t;", "texelFetch(t, 0)");
    assert!(found.contains("which holds sampled images"), "{found}");
}

#[test]
fn the_entry_point_must_match_the_stage() {
    let words = words(ShaderStage::Fragment, "void main() {}");
    let found = log(reflect("test", ShaderStage::Compute, &words));
    assert_eq!(found, "no entry point 'main' for the compute stage; the module has 'main' (fragment)");
}

#[test]
fn spirv_words_are_checked() {
    let good = words(ShaderStage::Compute, "void main() {}");
    let take = |words: &[u32]| {
        build(&ShaderModuleDesc { source: ShaderSource::Spirv(words), ..desc(ShaderStage::Compute, "") })
    };
    assert_eq!(take(&good).unwrap(), good);
    assert!(log(take(&[])).contains("magic number"));
    assert!(log(take(&good[..3])).contains("header"));
    assert!(log(take(&good[..good.len() - 1])).contains("ends inside a function"));
    assert!(log(take(&good[..good.len() - 3])).contains("cut off"));
    let swapped: Vec<u32> = good.iter().map(|word| word.swap_bytes()).collect();
    assert!(log(take(&swapped)).contains("byte order"));
    let mut newer = good;
    newer[1] = 0x0001_0700;
    assert!(log(take(&newer)).contains("newer than 1.6"));
}

#[test]
fn many_threads_compile_at_once() {
    let text = shader(ShaderStage::Compute, "#include <lvk/ray_query.glsl>", QUERY);
    let expected = words(ShaderStage::Compute, &text);
    std::thread::scope(|scope| {
        for thread in 0..4 {
            let (text, expected) = (&text, &expected);
            scope.spawn(move || {
                for round in 0..4 {
                    assert_eq!(&words(ShaderStage::Compute, text), expected, "{thread} {round}");
                    assert!(error(ShaderStage::Miss, "void main() { foo = 1; }").starts_with("line 1"));
                }
            });
        }
    });
}

/// A module with blocks, arrays, matrices, images and a query, to be damaged.
fn rich() -> &'static [u32] {
    static WORDS: std::sync::LazyLock<Vec<u32>> = std::sync::LazyLock::new(|| {
        let globals = "#include <lvk/ray_query.glsl>\nstruct S { vec3 a; mat3 m[2]; };\n\
                       layout(push_constant, std430) uniform Push { S s[2]; float last; } push;\n\
                       layout(constant_id = 4) const uint n = 4;";
        let body =
            format!("{QUERY} imageStore(kImages2D[n], ivec2(1), textureBindless2D(1, 2, vec2(push.last)));");
        words(ShaderStage::Compute, &shader(ShaderStage::Compute, globals, &body))
    });
    &WORDS
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, ..ProptestConfig::default() })]

    #[test]
    fn random_words_never_panic(mut words in prop::collection::vec(any::<u32>(), 0..64), small in any::<bool>()) {
        if let (Some(first), true) = (words.first_mut(), small) {
            *first = ::spirv::MAGIC_NUMBER;
        }
        for stage in ShaderStage::ALL {
            prop_assert!(reflect("test", stage, &words).is_err());
        }
        _ = unused::without_unused_resources(words);
    }

    #[test]
    fn random_instructions_never_panic(code in prop::collection::vec((0u32..400, prop::collection::vec(0u32..24, 0..6)), 0..80)) {
        let mut words = rich()[..5].to_vec();
        // Entry point 'main' of a compute shader, so that reading goes on.
        words.extend([6 << 16 | Op::EntryPoint as u32, 5, 1, u32::from_le_bytes(*b"main"), 0, 2]);
        for (op, operands) in code {
            words.push((operands.len() as u32 + 1) << 16 | op);
            words.extend(operands);
        }
        _ = reflect("test", ShaderStage::Compute, &words);
        let sound = spirv::check(&words).is_ok();
        let kept = unused::without_unused_resources(words);
        prop_assert_eq!(spirv::check(&kept).is_ok(), sound);
    }

    #[test]
    fn damaged_modules_never_panic(cut in any::<prop::sample::Index>(), flips in prop::collection::vec((any::<prop::sample::Index>(), 0u32..32), 0..8)) {
        let whole = rich();
        let mut words = whole.to_vec();
        for (word, bit) in flips {
            let at = word.index(words.len());
            words[at] ^= 1 << bit;
        }
        _ = reflect("test", ShaderStage::Compute, &words);
        _ = unused::without_unused_resources(words.clone());
        words.truncate(cut.index(whole.len()));
        _ = reflect("test", ShaderStage::Compute, &words);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, ..ProptestConfig::default() })]

    #[test]
    fn random_text_is_compiled_or_refused(
        text in "([ -~é\n\\x00]{0,40}|(void main\\(\\) \\{|\\}|#include <lvk/ray_query.glsl>|#version 460|#line 9 \"a\"|#define A\\(x\\) x|A\\(1\\)|;|//|/\\*|\\*/|\"|\n| ){0,20})"
    ) {
        for stage in [ShaderStage::Compute, ShaderStage::AnyHit] {
            match build(&desc(stage, &text)) {
                Ok(words) => _ = reflect("test", stage, &words),
                Err(Error::Shader { log, .. }) => prop_assert!(!log.is_empty()),
                Err(other) => prop_assert!(false, "{other:?}"),
            }
        }
    }
}
