//! A ray tracing pipeline with a shader of every kind, of which one comes from outside: the entry point of a fuzz target.

use std::sync::LazyLock;

use crate::shader::spirv::lower::{HitShaders, Lowering, LoweringError, StageModule, Traversal, lower};
use crate::shader::spirv::{reflect::reflect, words};
use crate::shader::{CompileFiles, CompileOptions, ShaderModuleDesc, ShaderSource, ShaderStage, compile};

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

/// Name of the shaders in errors.
pub(crate) const NAME: &str = "shader";

const TRAVERSALS: [Traversal; 4] =
    [Traversal::Query, Traversal::SoftwareGpu, Traversal::SoftwareCpu, Traversal::SoftwareCpuPairs];

/// The stages and the words of the pipeline.
pub(crate) static SHADERS: LazyLock<Vec<(ShaderStage, Vec<u32>)>> = LazyLock::new(|| {
    let texts = [
        (ShaderStage::RayGen, RAY_GEN),
        (ShaderStage::Miss, MISS),
        (ShaderStage::ClosestHit, MIRROR),
        (ShaderStage::AnyHit, ANY_HIT),
        (ShaderStage::Intersection, INTERSECTION),
        (ShaderStage::Callable, CALLABLE),
    ];
    let compiled = |(stage, text)| Some((stage, compiled(stage, ShaderSource::Glsl(text))?));
    texts.into_iter().filter_map(compiled).collect()
});

fn compiled(stage: ShaderStage, source: ShaderSource<'_>) -> Option<Vec<u32>> {
    let desc = ShaderModuleDesc { stage, source, debug_name: NAME, ..ShaderModuleDesc::default() };
    compile(&desc, &CompileOptions::default(), CompileFiles::default()).ok()
}

/// Lowers the pipeline with other words of the shader at `place`.
pub(crate) fn lower_with(
    place: usize,
    words: &[u32],
    traversal: Traversal,
) -> Result<Vec<u32>, LoweringError> {
    let module = |(index, (stage, intact)): (usize, &'static (ShaderStage, Vec<u32>))| {
        let words = if index == place { words } else { intact };
        StageModule { name: NAME, stage: *stage, words, specialization: &[] }
    };
    lower(&Lowering {
        traversal,
        is_for_swiftshader: traversal == Traversal::Query,
        modules: &SHADERS.iter().enumerate().map(module).collect::<Vec<_>>(),
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
    })
}

/// Creates the shader of these words as the creation of shader modules does, and lowers the pipeline with it. `choice`
/// chooses its place and the traversal. True if the pipeline is lowered.
///
/// # Panics
/// If the lowered words are no module.
pub fn read_ray_pipeline(choice: u8, outside: &[u32]) -> bool {
    let place = usize::from(choice) % SHADERS.len().max(1);
    let traversal = TRAVERSALS[usize::from(choice) / SHADERS.len().max(1) % TRAVERSALS.len()];
    let Some((stage, _)) = SHADERS.get(place) else { return false };
    let Some(outside) = compiled(*stage, ShaderSource::Spirv(outside)) else { return false };
    if reflect(NAME, *stage, &outside).is_err() {
        return false;
    }
    let lowered = lower_with(place, &outside, traversal);
    match &lowered {
        Ok(lowered) => assert!(words::validate(lowered).is_ok(), "the lowered words are no module"),
        Err(error) => assert!(!error.message.is_empty()),
    }
    lowered.is_ok()
}

/// Returns inputs of the fuzz target: each shader of the pipeline in its place, by each traversal.
pub fn example_ray_pipeline() -> Vec<(u8, Vec<u32>)> {
    let choice = |place: usize| place + place % TRAVERSALS.len() * SHADERS.len();
    SHADERS.iter().enumerate().map(|(place, (_, words))| (choice(place) as u8, words.clone())).collect()
}
