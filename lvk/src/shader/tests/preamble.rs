//! Tests of the preamble in every stage.

use ::spirv::{Capability, Op};

use super::*;

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
        words::instructions(&words).any(|i| i.unwrap().op == Some(Op::ImageSampleImplicitLod))
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
