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
    let pipeline = ctx.create_ray_tracing_pipeline(&RayTracingPipelineDesc {
        ray_gen: &[*ray_gen],
        miss: &[*miss],
        hit_groups: &[HitGroup { closest_hit: Some(*hit), ..Default::default() }],
        ..Default::default()
    })?;
    GroupScene::new(ctx)?.run(*pipeline, 0, COUNTS)
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
