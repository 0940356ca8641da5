//! Tests that compile shaders and reflect them.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test")]

mod damage;
#[cfg(feature = "software-ray-query")]
mod damaged_pipelines;
#[cfg(feature = "software-ray-query")]
mod glsl_names;
#[cfg(feature = "software-ray-query")]
mod interface;
#[cfg(feature = "software-ray-query")]
mod interface_page;
mod layouts;
mod modules;
mod preamble;
mod shared;
mod sources;

use ::spirv::Op;

use super::spirv::reflect::reflect;
use super::spirv::words;
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
    compile(desc, &CompileOptions::default(), CompileFiles::default())
}

fn words(stage: ShaderStage, text: &str) -> Vec<u32> {
    build(&desc(stage, text)).unwrap_or_else(|error| panic!("{stage:?}: {error}\n{text}"))
}

fn facts(stage: ShaderStage, text: &str) -> Reflection {
    reflect("test", stage, &words(stage, text)).unwrap()
}

/// Returns the log of the error, which must be a shader error.
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
    let instructions = words::instructions(words).map(|i| i.unwrap());
    instructions.filter(|i| i.op == Some(Op::Capability)).map(|i| i.operand(0)).collect()
}

fn declares(words: &[u32], name: &str) -> bool {
    words::instructions(words).map(|i| i.unwrap()).any(|i| i.op == Some(Op::Name) && i.string(1).0 == name)
}

/// Returns a complete shader of `stage` around a body; `globals` precede `main`.
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

const QUERY: &str = "
    LvkRayQuery rq;
    vec3 v = vec3(0); uint n = 0u; float t = 0.0; bool b = false; mat4x3 m = mat4x3(0);
    lvkRayQueryInitialize(rq, 5u, LVK_RAY_FLAG_OPAQUE | LVK_RAY_FLAG_TERMINATE_ON_FIRST_HIT, 0xFFu, vec3(0), 0.0, vec3(0, 0, 1), 9.0);
    while (lvkRayQueryProceed(rq)) {
        if (lvkRayQueryType(rq, LVK_CANDIDATE) == LVK_CANDIDATE_TRIANGLE) lvkRayQueryConfirmIntersection(rq);
        else if (lvkRayQueryCandidateAABBOpaque(rq)) lvkRayQueryGenerateIntersection(rq, 1.0);
        else lvkRayQueryTerminate(rq);
    }
    if (lvkRayQueryType(rq, LVK_COMMITTED) != LVK_COMMITTED_NONE) {
        t += lvkRayQueryT(rq, LVK_COMMITTED) + lvkRayQueryRayTMin(rq);
        n += uint(lvkRayQueryInstanceId(rq, LVK_COMMITTED, 0) + lvkRayQueryInstanceCustomIndex(rq, LVK_COMMITTED)
            + lvkRayQueryGeometryIndex(rq, LVK_COMMITTED) + lvkRayQueryPrimitiveIndex(rq, LVK_COMMITTED, 0));
        n += lvkRayQueryInstanceShaderBindingTableRecordOffset(rq, LVK_COMMITTED) + lvkRayQueryRayFlags(rq);
        v += vec3(lvkRayQueryBarycentrics(rq, LVK_COMMITTED), 0) + lvkRayQueryObjectRayOrigin(rq, LVK_COMMITTED)
            + lvkRayQueryObjectRayDirection(rq, LVK_COMMITTED) + lvkRayQueryWorldRayOrigin(rq) + lvkRayQueryWorldRayDirection(rq);
        b = lvkRayQueryFrontFace(rq, LVK_COMMITTED);
        m = lvkRayQueryObjectToWorld(rq, LVK_COMMITTED) + lvkRayQueryWorldToObject(rq, LVK_COMMITTED);
    }
    imageStore(kImages2D[0], ivec2(0), vec4(v + m[0], t + float(n) + float(b)));
";
