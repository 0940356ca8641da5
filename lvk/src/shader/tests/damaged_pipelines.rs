//! Tests that the lowering of damaged shaders ends, in words or in an error.

use std::sync::LazyLock;

use proptest::prelude::*;

use super::*;
use crate::shader::spirv::lower::{HitShaders, Lowering, StageModule, Traversal, lower};

const RAY_GEN: &str = "
    struct Payload { vec3 color; float weights[3]; };
    layout(location = 0) rayPayloadEXT Payload payload;
    layout(location = 0) callableDataEXT vec4 data;
    layout(push_constant, scalar) uniform Push { uint tlas; uint count; uint image; };
    layout(constant_id = 3) const uint kMost = 4;
    float traced(uint i) {
        if (i == count) return 0.5;
        traceRayEXT(kTLAS[tlas], 0, 0xFF, 0, 1, 0, vec3(i), 0.0, vec3(0, 0, 1), 100.0, 0);
        return payload.weights[i % 3];
    }
    void main() {
        vec3 sum = vec3(0);
        for (uint i = 0; i < kMost; ++i) {
            switch (i % 3) {
                case 0: sum += traced(i); break;
                default: executeCallableEXT(i & 1, 0); sum += data.xyz;
            }
        }
        imageStore(kImages2D[image], ivec2(gl_LaunchIDEXT.xy), vec4(sum * payload.color, 1));
    }";
const MISS: &str = "
    struct Payload { vec3 color; float weights[3]; };
    layout(location = 0) rayPayloadInEXT Payload result;
    void main() { result.color = gl_WorldRayDirectionEXT; }";
const MIRROR: &str = "
    struct Payload { vec3 color; float weights[3]; };
    layout(location = 0) rayPayloadInEXT Payload result;
    layout(location = 1) rayPayloadEXT Payload inner;
    hitAttributeEXT vec2 attributes;
    layout(shaderRecordEXT, scalar) buffer Record { uint tlas; vec3 tint; };
    void main() {
        inner.color = vec3(0);
        if (attributes.x > 0.5)
            traceRayEXT(kTLAS[tlas], 0, 0xFF, 0, 1, 0, gl_WorldRayOriginEXT, 0.1, vec3(0, 1, 0), 100.0, 1);
        result.color = tint * inner.color + float(gl_PrimitiveID);
    }";
const ANY_HIT: &str = "
    hitAttributeEXT vec2 attributes;
    void main() { if (attributes.x > 0.5) ignoreIntersectionEXT; if (attributes.y > 0.5) terminateRayEXT; }";
const INTERSECTION: &str = "
    hitAttributeEXT vec3 normal;
    void main() { normal = gl_ObjectRayOriginEXT; reportIntersectionEXT(1.0, 7u); }";
const CALLABLE: &str = "layout(location = 0) callableDataInEXT vec4 data; void main() { data += vec4(1); }";

/// A pipeline of every kind of shader.
static SHADERS: LazyLock<Vec<(ShaderStage, Vec<u32>)>> = LazyLock::new(|| {
    [
        (ShaderStage::RayGen, RAY_GEN),
        (ShaderStage::Miss, MISS),
        (ShaderStage::ClosestHit, MIRROR),
        (ShaderStage::AnyHit, ANY_HIT),
        (ShaderStage::Intersection, INTERSECTION),
        (ShaderStage::Callable, CALLABLE),
    ]
    .map(|(stage, text)| (stage, words(stage, text)))
    .into()
});

/// Lowers the pipeline with other words of the shader `damaged`, and returns whether it could be.
fn lowered(damaged: usize, words: &[u32]) -> bool {
    let module = |(index, (stage, intact)): (usize, &'static (ShaderStage, Vec<u32>))| {
        (*stage, if index == damaged { words.to_vec() } else { intact.clone() })
    };
    let shaders: Vec<_> = SHADERS.iter().enumerate().map(module).collect();
    let modules: Vec<_> = shaders
        .iter()
        .map(|(stage, words)| StageModule { name: "shader", stage: *stage, words, specialization: &[] })
        .collect();
    let result = lower(&Lowering {
        traversal: Traversal::Query,
        is_for_swiftshader: true,
        modules: &modules,
        ray_gen: 0,
        miss: &[1],
        hit: &[
            HitShaders { closest_hit: Some(2), any_hit: Some(3), intersection: None },
            HitShaders { closest_hit: Some(2), any_hit: None, intersection: Some(4) },
        ],
        callable: &[5],
        strides: [16, 32, 16],
        push_constant_bytes: 128,
        launch_offset: 248,
        max_recursion: 4,
        max_callable_depth: 1,
    });
    match result {
        Ok(words) => words::validate(&words).is_ok(),
        Err(error) => !error.message.is_empty() && error.shader == "shader",
    }
}

#[test]
fn the_intact_pipeline_is_lowered() {
    for (index, (_, words)) in SHADERS.iter().enumerate() {
        assert!(lowered(index, words));
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1000, ..ProptestConfig::default() })]

    /// Modules that the reader refuses never come to the lowering.
    #[test]
    fn damaged_shaders_are_lowered_or_refused(
        damaged in 0..6_usize,
        flips in prop::collection::vec((any::<prop::sample::Index>(), 0..32_u32), 1..3),
        swaps in prop::collection::vec((any::<prop::sample::Index>(), any::<prop::sample::Index>()), 0..2),
    ) {
        let (stage, intact) = &SHADERS[damaged];
        let mut words = intact.clone();
        for (place, bit) in flips {
            words[place.index(intact.len() - 5) + 5] ^= 1 << (bit % 8);
        }
        for (from, to) in swaps {
            words[to.index(intact.len() - 5) + 5] = words[from.index(intact.len() - 5) + 5];
        }
        if words::validate(&words).is_ok() && reflect("test", *stage, &words).is_ok() {
            prop_assert!(lowered(damaged, &words));
        }
    }
}
