//! Pipelines that are lowered to compute shaders, on devices whose own pipelines are hidden.

use lvk::{
    Context, Dependencies, DeviceProfile, Error, HitGroup, Holder, RayQueryRequest, RayTracingLibraryDesc,
    RayTracingPipelineDesc, RayTracingPipelineHandle, RayTracingPipelineRequest, Result, ShaderModuleDesc,
    ShaderSource, ShaderStage, SpecializationConstant, SpecializationValue,
};
use lvk_tests::compute::words_buffer;
use lvk_tests::device_with;
use lvk_tests::pipeline_paths::{lowered_devices, pipeline_devices};
use lvk_tests::shader_groups::{Counts, GroupScene, answering, ray_gen};

/// Returns a pipeline with a miss shader that answers 1, and two ray generation shaders of which the second adds 500.
fn pipeline(ctx: &Context) -> Result<Holder<RayTracingPipelineHandle>> {
    let ray_gens = [ray_gen(ctx, "", "0u")?, ray_gen(ctx, "", "500u")?];
    let miss = answering(ctx, ShaderStage::Miss, "", "1u")?;
    ctx.create_ray_tracing_pipeline(&RayTracingPipelineDesc {
        ray_gen: &[*ray_gens[0], *ray_gens[1]],
        miss: &[*miss],
        debug_name: "two answers",
        ..Default::default()
    })
}

#[test]
fn lowered_paths_are_reported_with_their_limits() {
    for (path, ctx) in lowered_devices() {
        let caps = ctx.capabilities();
        assert_eq!(caps.ray_tracing_pipeline_path, path);
        assert!(!caps.ray_tracing_pipeline_reason.is_empty());
        assert!(caps.ray_tracing_pipeline && caps.trace_rays_indirect && caps.pipeline_libraries);
        assert!(!caps.ray_query, "shaders of the application got no ray queries");
        let limits = &caps.limits;
        assert_eq!((limits.max_ray_recursion, limits.max_hit_attribute_bytes), (31, 32));
        assert_eq!((limits.sbt_handle_bytes, limits.sbt_max_stride), (0, 4096));
    }
}

#[test]
fn a_lowered_pipeline_traces_without_pipelines_of_the_device() -> Result<()> {
    for (_, ctx) in lowered_devices() {
        let scene = GroupScene::new(&ctx)?;
        let pipeline = pipeline(&ctx)?;
        let counts = Counts { hits: 0, misses: 1, callables: 0 };
        assert_eq!(scene.run(*pipeline, 0, counts)?, [1]);
        assert_eq!(scene.run(*pipeline, 1, counts)?, [501]);
        assert_eq!(ctx.ray_tracing_stack_bytes(*pipeline)?, 0);
        let raw = ctx.raw_ray_tracing_pipeline(*pipeline);
        assert!(matches!(raw, Err(Error::Unsupported { .. })), "{raw:?}");
    }
    Ok(())
}

/// A hit and a miss of one triangle, as of the sample `triangle`, under each built-in profile, by whatever `Auto` takes there.
#[test]
fn the_smallest_pipeline_traces_under_every_profile() -> Result<()> {
    for name in DeviceProfile::names() {
        let profile = DeviceProfile::named(name)?;
        let opened = device_with(|desc| {
            (desc.ray_query, desc.ray_tracing_pipeline) =
                (RayQueryRequest::Off, RayTracingPipelineRequest::Auto);
            desc.profile = Some(&profile);
        });
        let Some(ctx) = opened else { continue };
        let ray_gen = ray_gen(&ctx, "", "0u")?;
        let miss = answering(&ctx, ShaderStage::Miss, "", "1u")?;
        let hit = answering(&ctx, ShaderStage::ClosestHit, "", "2u")?;
        let pipeline = ctx.create_ray_tracing_pipeline(&RayTracingPipelineDesc {
            ray_gen: &[*ray_gen],
            miss: &[*miss],
            hit_groups: &[HitGroup { closest_hit: Some(*hit), ..Default::default() }],
            ..Default::default()
        })?;
        let counts = Counts { hits: 1, misses: 1, callables: 0 };
        let found = GroupScene::new(&ctx)?.run(*pipeline, 0, counts)?;
        assert_eq!(found, [2, 1], "{name}: {}", ctx.capabilities().ray_tracing_pipeline_reason);
    }
    Ok(())
}

/// A trace is inside of the label around it on every path: its time counts there.
#[test]
fn traces_are_profiled() -> Result<()> {
    for (path, ctx) in pipeline_devices() {
        let (scene, pipeline) = (GroupScene::new(&ctx)?, pipeline(&ctx)?);
        let counts = Counts { hits: 0, misses: 1, callables: 0 };
        let results = words_buffer(&ctx, &[0]);
        ctx.set_profiling(true)?;
        let mut cmd = ctx.acquire_command_buffer()?;
        for name in ["rays", "nothing"] {
            cmd.push_label(name);
            if name == "rays" {
                scene.bind(&mut cmd, *pipeline, counts, *results)?;
                let writes = Dependencies { buffers: &[*results], ..Default::default() };
                cmd.trace_rays([1, 1, 1], &writes)?;
            }
            cmd.pop_label();
        }
        ctx.wait(ctx.submit(cmd)?)?;
        let profile = ctx.last_profile()?.expect("the submission was profiled");
        let scopes: Vec<_> = profile.scopes.iter().map(|scope| (&*scope.name, scope.ms)).collect();
        let [("rays", rays), ("nothing", nothing)] = scopes[..] else { unreachable!("{path:?}: {scopes:?}") };
        assert!(rays > nothing, "{path:?}: {rays} and {nothing} ms");
    }
    Ok(())
}

#[test]
fn a_library_that_is_to_be_lowered_checks_its_constants() -> Result<()> {
    for (_, ctx) in lowered_devices() {
        let miss = answering(&ctx, ShaderStage::Miss, "", "1u")?;
        let constant = SpecializationConstant { id: 3, value: SpecializationValue::U32(1) };
        let library = ctx.create_ray_tracing_library(&RayTracingLibraryDesc {
            miss: &[*miss],
            specialization: &[constant],
            ..Default::default()
        });
        let Err(Error::InvalidUsage { message, .. }) = library.map(drop) else { unreachable!() };
        assert!(message.contains("no shader declares the specialization constant 3"), "{message}");
    }
    Ok(())
}

/// Ray generation shaders that no lowering can run, with words of the error.
const NOT_LOWERED: [(&str, &str); 3] = [
    (
        "layout(location = 0) rayPayloadEXT uint value;
         layout(push_constant, scalar) uniform Push { uvec2 scene; };
         void main() {
             traceRayEXT(accelerationStructureEXT(scene), 0, 0xff, 0, 0, 0, vec3(0), 0.0, vec3(1), 9.0, 0);
         }",
        "OpTraceRayKHR",
    ),
    (
        "#extension GL_EXT_shader_invocation_reorder : require
         layout(location = 0) rayPayloadEXT uint value;
         void main() {
             hitObjectEXT hit;
             hitObjectTraceRayEXT(hit, kTLAS[0], 0, 0xff, 0, 0, 0, vec3(0), 0.0, vec3(1), 9.0, 0);
             reorderThreadEXT(hit);
             hitObjectExecuteShaderEXT(hit, 0);
         }",
        "ShaderInvocationReorder",
    ),
    (
        "#extension GL_NV_shader_invocation_reorder : require
         void main() { reorderThreadNV(gl_LaunchIDEXT.x & 1, 1); }",
        "ShaderInvocationReorder",
    ),
];

/// The module is refused where the device lacks the feature of the shader, and the pipeline elsewhere.
#[test]
fn shaders_that_cannot_be_lowered_are_refused_by_name() -> Result<()> {
    for (path, ctx) in lowered_devices() {
        let miss = answering(&ctx, ShaderStage::Miss, "", "1u")?;
        for (text, words) in NOT_LOWERED {
            let module = ctx.create_shader_module(&ShaderModuleDesc {
                stage: ShaderStage::RayGen,
                source: ShaderSource::Glsl(text),
                debug_name: "odd camera",
                ..Default::default()
            });
            let made = module.and_then(|module| {
                ctx.create_ray_tracing_pipeline(&RayTracingPipelineDesc {
                    ray_gen: &[*module],
                    miss: &[*miss],
                    debug_name: "odd",
                    ..Default::default()
                })
            });
            match made.map(drop) {
                Err(Error::Lowering { pipeline, shader, why }) => {
                    assert_eq!((&*pipeline, &*shader), ("odd", "odd camera"));
                    assert!(why.contains(words), "{path:?}: {why}");
                }
                Err(Error::Unsupported { what, .. }) => {
                    assert!(what.contains("odd camera"), "{path:?}: {what}")
                }
                other => unreachable!("{path:?}: {other:?} for {text}"),
            }
        }
    }
    Ok(())
}
