//! Forms of code that compilers write into ray tracing shaders, on every path of ray tracing pipelines.

use lvk::{
    Context, HitGroup, Holder, OptionalFeature, RayTracingPipelineDesc, RayTracingPipelinePath, Result,
    ShaderModuleHandle, ShaderStage,
};
use lvk_tests::pipeline_paths::pipeline_devices;
use lvk_tests::ray_tracer::shader;
use lvk_tests::shader_groups::{Counts, GroupScene, answering};

/// One hit, and one miss.
const COUNTS: Counts = Counts { hits: 1, misses: 1, callables: 0 };

/// Stands in front of ray generation shaders.
const PUSH: &str = "
    layout(buffer_reference, scalar) buffer Words { uint at[]; };
    layout(push_constant, scalar) uniform Push { Words results; uint tlas; uint hits; uint misses; };
    layout(location = 0) rayPayloadEXT uint value;
    vec3 direction() { return vec3(0, 0, gl_LaunchIDEXT.x < hits ? 1 : -1); }";

/// Returns the results of a launch by a pipeline with one hit group.
fn launch(
    ctx: &Context,
    ray_gen: ShaderModuleHandle,
    miss: ShaderModuleHandle,
    group: HitGroup<'_>,
) -> Result<Vec<u32>> {
    let pipeline = ctx.create_ray_tracing_pipeline(&RayTracingPipelineDesc {
        ray_gen: &[ray_gen],
        miss: &[miss],
        hit_groups: &[group],
        ..Default::default()
    })?;
    GroupScene::new(ctx)?.run(*pipeline, 0, COUNTS)
}

/// Returns the results of a launch whose rays hit and miss. The closest-hit shader answers 20, the miss shader 30.
fn results(ctx: &Context, ray_gen: &str, mask: Option<&str>) -> Result<Vec<u32>> {
    let ray_gen = shader(ctx, ShaderStage::RayGen, &format!("{PUSH}\n{ray_gen}"))?;
    let answers = |stage, answer: &str| -> Result<Holder<ShaderModuleHandle>> {
        match mask {
            Some(mask) => {
                let globals = "#extension GL_EXT_ray_cull_mask : require";
                answering(ctx, stage, globals, &format!("{answer} + {mask}"))
            }
            None => answering(ctx, stage, "", answer),
        }
    };
    let (hit, miss) = (answers(ShaderStage::ClosestHit, "20u")?, answers(ShaderStage::Miss, "30u")?);
    launch(ctx, *ray_gen, *miss, HitGroup { closest_hit: Some(*hit), ..Default::default() })
}

/// Two functions deep, with early returns, and with indices of several types.
#[test]
fn structures_are_passed_to_functions() -> Result<()> {
    const ARGUMENT: &str = "
        void traced(accelerationStructureEXT scene, vec3 direction) {
            if (direction.z == 0.0) return;
            traceRayEXT(scene, 0, 0xff, 0, 0, 0, vec3(0.25, 0.25, -1), 0.0, direction, 10.0, 0);
        }
        uint outer(uint add, accelerationStructureEXT scene) {
            for (uint i = 0; i < 2; i++) {
                traced(scene, direction());
                if (value > 25) return value + add;
            }
            return value + 2 * add;
        }
        void main() {
            value = 0;
            uint first = outer(100, kTLAS[tlas]);
            uint second = outer(1000, kTLAS[INDEX]);
            results.at[gl_LaunchIDEXT.x] = first + second;
        }";
    for (path, ctx) in pipeline_devices() {
        for index in ["tlas", "int(tlas)", "nonuniformEXT(tlas + gl_LaunchIDEXT.y)"] {
            let found = results(&ctx, &ARGUMENT.replace("INDEX", index), None)?;
            assert_eq!(found, [2 * 20 + 2 * 1100, 2 * 30 + 1100], "{path:?}, {index}");
        }
    }
    Ok(())
}

/// Shaders see the eight bits that count.
#[test]
fn shaders_read_the_cull_mask() -> Result<()> {
    const MASKED: &str = "
        void main() {
            value = 0;
            traceRayEXT(kTLAS[tlas], 0, 0x1f00 | (gl_LaunchIDEXT.x + 5), 0, 0, 0, vec3(0.25, 0.25, -1), 0.0, direction(), 10.0, 0);
            results.at[gl_LaunchIDEXT.x] = value;
        }";
    for (path, ctx) in pipeline_devices() {
        let caps = ctx.capabilities();
        let is_hardware = path == RayTracingPipelinePath::Hardware;
        if is_hardware && !caps.has(OptionalFeature::RayTracingMaintenance1) {
            eprintln!("NOT TESTED, {} does not tell shaders the cull mask", caps.device_name);
            continue;
        }
        let found = results(&ctx, MASKED, Some("100 * gl_CullMaskEXT"))?;
        assert_eq!(found, [500 + 20, 600 + 30], "{path:?}");
    }
    Ok(())
}

/// Stands in front of closest-hit shaders that trace.
const HIT: &str = "
    layout(buffer_reference, scalar) buffer Words { uint at[]; };
    layout(push_constant, scalar) uniform Push { Words results; uint tlas; uint hits; uint misses; };
    layout(location = 0) rayPayloadInEXT uint value;
    layout(location = 1) rayPayloadEXT uint inner;
    void trace(uint flags, float z) {
        traceRayEXT(kTLAS[tlas], flags, 0xff, 0, 0, 0, vec3(0.25, 0.25, -1), 0.0, vec3(0, 0, z), 10.0, 1);
    }";

/// A miss shader.
const ADD_1000: &str = "layout(location = 0) rayPayloadInEXT uint value; void main() { value += 1000; }";

/// Returns the sums, over three rays each whose payload starts with 0, 1 and 2, of rays that hit and that miss. Each miss adds 1,000.
fn sums(ctx: &Context, hit: &str) -> Result<Vec<u32>> {
    const RAYS: &str = "
        void main() {
            uint sum = 0;
            for (uint ray = 0; ray < 3; ++ray) {
                value = ray;
                traceRayEXT(kTLAS[tlas], 0, 0xff, 0, 0, 0, vec3(0.25, 0.25, -1), 0.0, direction(), 10.0, 0);
                sum += value;
            }
            results.at[gl_LaunchIDEXT.x] = sum;
        }";
    let ray_gen = shader(ctx, ShaderStage::RayGen, &format!("{PUSH}\n{RAYS}"))?;
    let miss = shader(ctx, ShaderStage::Miss, ADD_1000)?;
    let hit = shader(ctx, ShaderStage::ClosestHit, hit)?;
    let pipeline = ctx.create_ray_tracing_pipeline(&RayTracingPipelineDesc {
        ray_gen: &[*ray_gen],
        miss: &[*miss],
        hit_groups: &[HitGroup { closest_hit: Some(*hit), ..Default::default() }],
        max_recursion: 4,
        ..Default::default()
    })?;
    GroupScene::new(ctx)?.run(*pipeline, 0, COUNTS)
}

/// The shadow ray of tutorials: it runs no closest-hit shader, and a miss says that there is light.
#[test]
fn closest_hit_shaders_trace_shadow_rays() -> Result<()> {
    const FLAGS: &str = "gl_RayFlagsTerminateOnFirstHitEXT | gl_RayFlagsSkipClosestHitShaderEXT";
    let shadow = |flags: &str| {
        format!(
            "{HIT}
            void main() {{
                inner = 7;
                trace({flags}, value % 2 == 0 ? 1 : -1);
                value = value * 10 + inner;
            }}"
        )
    };
    let direct = shadow(FLAGS).replace("trace(gl", "traceRayEXT(kTLAS[tlas], gl").replace(
        "EXT, value % 2 == 0 ? 1 : -1)",
        "EXT, 0xff, 0, 0, 0, vec3(0.25, 0.25, -1), 0.0, vec3(0, 0, value % 2 == 0 ? 1 : -1), 10.0, 1)",
    );
    let also_onward = format!(
        "{HIT}
        void main() {{
            inner = 7;
            traceRayEXT(kTLAS[tlas], {FLAGS}, 0xff, 0, 0, 0, vec3(0.25, 0.25, -1), 0.0, vec3(0, 0, value % 2 == 0 ? 1 : -1), 10.0, 1);
            uint shadow = inner;
            if (value < 6) {{ inner = value + 5; trace(0, 1); shadow += inner; }}
            value = value * 10 + shadow + uint(gl_HitTEXT);
        }}"
    );
    for (path, ctx) in pipeline_devices() {
        for text in [&direct, &shadow(FLAGS), &shadow(&format!("{FLAGS} | (misses & 0)"))] {
            assert_eq!(sums(&ctx, text)?, [30 + 7 + 1007 + 7, 3003], "{path:?}");
        }
        // A ray with 5, 6 or 7 hits once or twice more.
        let depth = |value: u32| if value.is_multiple_of(2) { 7 } else { 1007 };
        fn known(value: u32, depth: &dyn Fn(u32) -> u32) -> u32 {
            let onward = if value < 6 { known(value + 5, depth) } else { 0 };
            value * 10 + depth(value) + onward + 1
        }
        let hits = (0..3).map(|value| known(value, &depth)).sum();
        assert_eq!(sums(&ctx, &also_onward)?, [hits, 3003], "{path:?}");
    }
    Ok(())
}

/// Variables of a shader that waits for rays start anew in each of its runs.
#[test]
fn variables_have_their_initial_values_in_each_run() -> Result<()> {
    let hit = format!(
        "#extension GL_EXT_null_initializer : require
        {HIT}
        void main() {{
            uint counts[4] = {{}};
            counts[value & 3] += 1 + value;
            inner = value + 4;
            if (value < 8) {{ trace(0, 1); }}
            counts[(value + 1) & 3] += inner;
            value = counts[0] + counts[1] + counts[2] + counts[3];
        }}"
    );
    fn known(value: u32) -> u32 {
        1 + value + if value < 8 { known(value + 4) } else { value + 4 }
    }
    for (path, ctx) in pipeline_devices() {
        assert_eq!(sums(&ctx, &hit)?, [(0..3).map(known).sum(), 3003], "{path:?}");
    }
    Ok(())
}

/// Barycentrics lie in the first two floats of what a shader declares for them.
#[test]
fn attributes_of_triangles_have_many_types() -> Result<()> {
    let types = [
        ("vec2 a;", "a.x", "a.y"),
        ("vec3 a;", "a.x", "a.y"),
        ("float a[2];", "a[0]", "a[1]"),
        ("uvec2 a;", "uintBitsToFloat(a.x)", "uintBitsToFloat(a.y)"),
        ("Pair a;", "a.u", "a.v"),
        ("Wide a;", "a.both.x", "a.both.y"),
    ];
    for (path, ctx) in pipeline_devices() {
        for (ty, first, second) in types {
            let hit = format!(
                "{HIT}
                struct Pair {{ float u, v; }};
                struct Wide {{ vec2 both; uint other; }};
                hitAttributeEXT {ty}
                void main() {{ value = uint(round({first} * 1024)) + 10000 * uint(round({second} * 1024)); }}"
            );
            let found = sums(&ctx, &hit)?;
            assert_eq!(found, [3 * (256 + 10000 * 256), 3003], "{path:?}, {ty}");
        }
    }
    Ok(())
}

#[test]
fn attributes_that_cannot_hold_barycentrics_are_refused() {
    let hit = format!(
        "#extension GL_EXT_shader_explicit_arithmetic_types_float64 : require
        {HIT}
        hitAttributeEXT f64vec2 a;
        void main() {{ value = uint(a.x); }}"
    );
    for (path, ctx) in pipeline_devices() {
        if path == RayTracingPipelinePath::Hardware {
            continue;
        }
        let error = sums(&ctx, &hit).unwrap_err().to_string();
        assert!(error.contains("OpVariable of hit attributes"), "{path:?}: {error}");
    }
}

/// GLSL declares payloads as structs or as blocks.
#[test]
fn payloads_are_blocks() -> Result<()> {
    const RAYS: &str = "
        layout(location = 1) rayPayloadEXT Block { uint number; vec3 color; } sent;
        void main() {
            sent.number = 3;
            sent.color = vec3(1, 2, 4);
            traceRayEXT(kTLAS[tlas], 0, 0xff, 0, 0, 0, vec3(0.25, 0.25, -1), 0.0, direction(), 10.0, 1);
            results.at[gl_LaunchIDEXT.x] = sent.number + uint(sent.color.z);
        }";
    const ANSWER: &str = "
        layout(location = 1) rayPayloadInEXT Block { uint number; vec3 color; } sent;
        void main() { sent.number *= FACTOR; sent.color += float(FACTOR); }";
    for (path, ctx) in pipeline_devices() {
        let answer = |stage, factor: &str| shader(&ctx, stage, &ANSWER.replace("FACTOR", factor));
        let ray_gen = shader(&ctx, ShaderStage::RayGen, &format!("{PUSH}\n{RAYS}"))?;
        let (hit, miss) = (answer(ShaderStage::ClosestHit, "10")?, answer(ShaderStage::Miss, "100")?);
        let group = HitGroup { closest_hit: Some(*hit), ..Default::default() };
        assert_eq!(launch(&ctx, *ray_gen, *miss, group)?, [44, 404], "{path:?}");
    }
    Ok(())
}

/// Compute shaders have no scope of related shader calls.
#[test]
fn barriers_and_atomics_have_the_scope_of_shader_calls() -> Result<()> {
    let hit = format!(
        "#extension GL_KHR_memory_scope_semantics : require
        {HIT}
        void main() {{
            memoryBarrier(gl_ScopeShaderCallEXT, gl_StorageSemanticsBuffer, gl_SemanticsAcquireRelease);
            uint before = atomicLoad(results.at[1], gl_ScopeShaderCallEXT, gl_StorageSemanticsBuffer, gl_SemanticsAcquire);
            value = 6 * value + (before & 0);
        }}"
    );
    for (path, ctx) in pipeline_devices() {
        assert_eq!(sums(&ctx, &hit)?, [18, 3003], "{path:?}");
    }
    Ok(())
}

/// The any-hit shader may end in functions whose results are the addresses of buffers, alone and in structs.
#[test]
fn functions_that_ignore_hits_return_addresses() -> Result<()> {
    const RAYS: &str = "
        void main() {
            value = 7;
            traceRayEXT(kTLAS[tlas], gl_RayFlagsNoOpaqueEXT, 0xff, 0, 0, 0, vec3(0.25, 0.25, -1), 0.0, direction(), 10.0, 0);
            results.at[gl_LaunchIDEXT.x] = value;
        }";
    const ANY_HIT: &str = "
        layout(buffer_reference, scalar) buffer Words { uint at[]; };
        layout(push_constant, scalar) uniform Push { Words results; uint tlas; uint hits; uint misses; };
        struct Pair { Words words; uint number; };
        Words alone(uint number) { if (number == IGNORED) ignoreIntersectionEXT; return results; }
        Pair both(uint number) { if (number == IGNORED + 1) ignoreIntersectionEXT; return Pair(results, number); }
        void main() {
            Words first = alone(hits);
            Pair pair = both(hits);
            if (first.at[0] == 77 && pair.words.at[0] == 77) terminateRayEXT;
        }";
    for (path, ctx) in pipeline_devices() {
        let ray_gen = shader(&ctx, ShaderStage::RayGen, &format!("{PUSH}\n{RAYS}"))?;
        let hit = answering(&ctx, ShaderStage::ClosestHit, "", "20u")?;
        let miss = answering(&ctx, ShaderStage::Miss, "", "30u")?;
        // One hit is asked for: the first function ignores it, the second, or none.
        for (ignored, expected) in [("1u", 30), ("0u", 30), ("5u", 20)] {
            let any = shader(&ctx, ShaderStage::AnyHit, &ANY_HIT.replace("IGNORED", ignored))?;
            let group = HitGroup { closest_hit: Some(*hit), any_hit: Some(*any), ..Default::default() };
            assert_eq!(launch(&ctx, *ray_gen, *miss, group)?, [expected, 30], "{path:?}, {ignored}");
        }
    }
    Ok(())
}

/// A ray that runs no closest-hit shader, and one that does, without anything between them where the code could be split.
#[test]
fn a_shadow_ray_and_a_ray_that_recurses_may_follow_each_other() -> Result<()> {
    const SHADOW_FIRST: &str = "
        void main() {
            uint me = value;
            if (me >= 3) return;
            traceRayEXT(kTLAS[tlas], 9, 0xff, 0, 0, 0, vec3(0.25, 0.25, -1), 0.0, vec3(0, 0, 1), 10.0, 1);
            inner = me + 1;
            traceRayEXT(kTLAS[tlas], 1, 0xff, 0, 0, 0, vec3(0.25, 0.25, -1), 0.0, vec3(0, 0, 1), 10.0, 1);
            value = 10 * me + inner;
        }";
    for (path, ctx) in pipeline_devices() {
        let found = sums(&ctx, &format!("{HIT}\n{SHADOW_FIRST}"))?;
        assert_eq!(found, [33 + 33 + 23, 3003], "{path:?}");
    }
    Ok(())
}

/// Compilers make the pair of image and sampler before they compute the place, where a shader may end.
#[test]
fn a_shader_may_end_while_it_computes_the_place_of_a_texel() -> Result<()> {
    const PAYLOAD: &str = "
        layout(location = 0) rayPayloadInEXT uint value;
        hitAttributeEXT vec2 barycentrics;
        float place(float x) { if (value == 7) ignoreIntersectionEXT; return x; }
        uint opacity() {
            vec2 at = vec2(place(gl_HitTEXT), 0.5);
            return uint(textureLod(sampler2D(kTextures2D[0], kSamplers[0]), at, 0.0).a * 4.0);
        }";
    const RAYS: &str = "
        void main() {
            uint sum = 0;
            for (uint ray = 6; ray < 9; ++ray) {
                value = ray;
                traceRayEXT(kTLAS[tlas], 2, 0xff, 0, 0, 0, vec3(0.25, 0.25, -1), 0.0, direction(), 10.0, 0);
                sum += value;
            }
            results.at[gl_LaunchIDEXT.x] = sum;
        }";
    for (path, ctx) in pipeline_devices() {
        let ray_gen = shader(&ctx, ShaderStage::RayGen, &format!("{PUSH}\n{RAYS}"))?;
        let miss = shader(&ctx, ShaderStage::Miss, ADD_1000)?;
        let any_hit = format!("{PAYLOAD}\nvoid main() {{ value += 100 * opacity(); }}");
        let any_hit = shader(&ctx, ShaderStage::AnyHit, &any_hit)?;
        let hit = "layout(location = 0) rayPayloadInEXT uint value; void main() { value += 20; }";
        let hit = shader(&ctx, ShaderStage::ClosestHit, hit)?;
        let group = HitGroup { closest_hit: Some(*hit), any_hit: Some(*any_hit), ..Default::default() };
        let found = launch(&ctx, *ray_gen, *miss, group)?;
        assert_eq!(found, [2 * 420 + 1000 + 6 + 7 + 8, 3000 + 6 + 7 + 8], "{path:?}");
    }
    Ok(())
}

/// A return inside of a loop without a condition, as of rejection sampling, and one in a switch that is never left otherwise. Both functions
/// use variables of the shader, and are called where the shader branches between rays.
#[test]
fn functions_return_from_inside_of_loops_and_switches() -> Result<()> {
    const RETURNING: &str = "
        uint root() { for (uint k = 0;; k++) { if (k * k >= value) return k; } }
        uint tripled() { switch (value & 3) { case 0: value += 2; case 1: value += 1; default: return 3 * value; } }
        void traced() { traceRayEXT(kTLAS[tlas], 0, 0xff, 0, 0, 0, vec3(0.25, 0.25, -1), 0.0, direction(), 10.0, 0); }
        void main() {
            uint sum = 0;
            for (uint round = 0; round < 3; round++) {
                traced();
                if (round != 1) sum += root();
                traced();
                if (round == 1) { sum += 100 * tripled(); }
                traced();
                sum += value;
                traced();
                traced();
            }
            results.at[gl_LaunchIDEXT.x] = sum;
        }";
    for (path, ctx) in pipeline_devices() {
        let found = results(&ctx, RETURNING, None)?;
        assert_eq!(found, [2 * 5 + 100 * 3 * 23 + 3 * 20, 2 * 6 + 100 * 3 * 30 + 3 * 30], "{path:?}");
    }
    Ok(())
}
