//! Devices without ray tracing: every entry point that needs it returns an error and none panics, on a driver without
//! ray tracing and under a profile that hides it.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::fmt::Debug;

use lvk::{
    AccelStructHandle, BlasDesc, BlasGeometry, BufferDesc, BufferUsage, BuildMode, Context, Dependencies,
    DeviceInstances, DeviceProfile, Error, Handle, HitGroup, Queue, RayTracingLibraryDesc,
    RayTracingPipelineDesc, RayTracingPipelineHandle, ShaderModuleDesc, ShaderModuleHandle, ShaderSource,
    ShaderStage, TlasDesc, TlasInstance, Triangles,
};
use lvk_tests::compute::words_buffer;
use lvk_tests::subprocess::on_swiftshader;
use lvk_tests::without_software;

const QUERY: &str = "
    #include <lvk/ray_query.glsl>
    #ifdef LVK_STAGE_COMPUTE
    layout(local_size_x = 1) in;
    #endif
    layout(push_constant, scalar) uniform Push { uint tlas; };
    void main() {
        LvkRayQuery query;
        lvkRayQueryInitialize(query, tlas, LVK_RAY_FLAG_OPAQUE, 0xffu, vec3(0), 0.0, vec3(0, 0, 1), 1.0);
    }";

/// A handle that names nothing.
fn nothing<H: Handle>() -> H {
    H::from_bits(u64::MAX)
}

/// The text of the refusal.
fn refusal<T: Debug>(what: &str, result: lvk::Result<T>) -> String {
    match result {
        Err(error @ Error::Unsupported { .. }) => error.to_string(),
        other => unreachable!("{what}: {other:?}"),
    }
}

fn shader(ctx: &Context, stage: ShaderStage, text: &str) -> lvk::Result<()> {
    let source = ShaderSource::Glsl(text);
    ctx.create_shader_module(&ShaderModuleDesc { stage, source, ..Default::default() }).map(drop)
}

fn creations(ctx: &Context) -> Vec<String> {
    let buffer = words_buffer(ctx, &[0; 9]);
    let geometries = [BlasGeometry::Triangles(Triangles::packed(*buffer, 3))];
    let blas = BlasDesc { geometries: &geometries, ..Default::default() };
    let input = BufferDesc { size_bytes: 36, usage: BufferUsage::ACCEL_INPUT, ..Default::default() };
    let instances = [TlasInstance::new(nothing())];
    let full = TlasDesc { instances: &instances, ..Default::default() };
    vec![
        refusal("create_buffer", ctx.create_buffer(&input)),
        refusal("create_blas", ctx.create_blas(&blas)),
        refusal("create_blas without geometries", ctx.create_blas(&BlasDesc::default())),
        refusal("create_blas_batch", ctx.create_blas_batch(&[blas, blas])),
        refusal("create_blas_batch_on", ctx.create_blas_batch_on(Queue::Compute, &[blas])),
        // SAFETY: there are no bytes that the driver would read.
        refusal("load_blas", unsafe { ctx.load_blas(&blas, &[]) }),
        // SAFETY: as before.
        refusal("load_or_create_blas", unsafe { ctx.load_or_create_blas(&blas, None) }.map(drop)),
        refusal("blas_sizes", ctx.blas_sizes(&blas)),
        refusal("create_tlas", ctx.create_tlas(&TlasDesc::default())),
        refusal("create_tlas with room", ctx.create_tlas(&TlasDesc { capacity: 9, ..Default::default() })),
        refusal("create_tlas with instances", ctx.create_tlas(&full)),
    ]
}

fn shaders(ctx: &Context) -> Vec<String> {
    use ShaderStage::{AnyHit, Callable, ClosestHit, Compute, Fragment, Intersection, Miss, RayGen, Vertex};
    let tracing =
        [RayGen, Miss, ClosestHit, AnyHit, Intersection, Callable].map(|stage| (stage, "void main() {}"));
    let asking = [Vertex, Fragment, Compute].map(|stage| (stage, QUERY));
    let all = tracing.into_iter().chain(asking);
    all.map(|(stage, text)| refusal(&format!("{stage:?}"), shader(ctx, stage, text))).collect()
}

fn pipelines(ctx: &Context) -> Vec<String> {
    let source = ShaderSource::Glsl("layout(local_size_x = 1) in; void main() {}");
    let compute = ShaderModuleDesc { stage: ShaderStage::Compute, source, ..Default::default() };
    let compute = ctx.create_shader_module(&compute).unwrap();
    let modules: [&[ShaderModuleHandle]; 2] = [&[], &[*compute]];
    let hit = [HitGroup { closest_hit: Some(*compute), ..Default::default() }];
    let mut found = Vec::new();
    for ray_gen in modules {
        let desc = RayTracingPipelineDesc { ray_gen, hit_groups: &hit, ..Default::default() };
        found.push(refusal("create_ray_tracing_pipeline", ctx.create_ray_tracing_pipeline(&desc)));
        let desc = RayTracingLibraryDesc { ray_gen, hit_groups: &hit, ..Default::default() };
        found.push(refusal("create_ray_tracing_library", ctx.create_ray_tracing_library(&desc)));
    }
    found
}

/// Commands need objects that cannot be had, so any error will do.
fn commands(ctx: &Context) {
    let buffer = words_buffer(ctx, &[0; 64]);
    let none = Dependencies::default();
    let structure: AccelStructHandle = nothing();
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    assert!(cmd.bind_ray_tracing_pipeline(nothing::<RayTracingPipelineHandle>()).is_err());
    assert!(cmd.trace_rays([1, 1, 1], &none).is_err());
    assert!(cmd.trace_rays_with(3, [1, 1, 1], &none).is_err());
    refusal("trace_rays_indirect", cmd.trace_rays_indirect(0, *buffer, 0, &none));
    assert!(cmd.build_blas(&[structure], BuildMode::Rebuild).is_err());
    assert!(cmd.update_tlas(structure, &[], BuildMode::Rebuild).is_err());
    let instances = DeviceInstances { buffer: *buffer, offset: 0, count: 1, blas: &[] };
    assert!(cmd.update_tlas_from_buffer(structure, &instances, BuildMode::Rebuild).is_err());
    refusal("build_blas", cmd.build_blas(&[], BuildMode::Rebuild));
    ctx.submit(cmd).unwrap();
    assert!(ctx.compact(&[structure]).is_err() && ctx.accel_struct_info(structure).is_err());
    assert_eq!(ctx.build_progress(&[]).unwrap().total, 0);
    assert_eq!((ctx.accel_memory().structures, ctx.accel_memory().structure_bytes), (Vec::new(), 0));
    ctx.wait_idle().unwrap();
}

#[test]
fn a_driver_without_ray_tracing_refuses_clearly() {
    on_swiftshader(a_driver_without_ray_tracing_refuses_clearly, || {
        let Some(ctx) = without_software(|_| ()) else { return };
        let name = ctx.capabilities().device_name.clone();
        for text in creations(&ctx).into_iter().chain(shaders(&ctx)).chain(pipelines(&ctx)) {
            assert!(text.contains("not supported") && text.contains(&name), "{text}");
            assert!(!text.contains("profile"), "{text}");
        }
        commands(&ctx);
    });
}

#[test]
fn a_profile_without_ray_tracing_refuses_clearly() {
    let profile = DeviceProfile::no_ray_tracing();
    let Some(ctx) = without_software(|desc| desc.profile = Some(&profile)) else { return };
    for text in creations(&ctx).into_iter().chain(shaders(&ctx)).chain(pipelines(&ctx)) {
        assert!(text.contains("not supported") && text.contains("profile 'no-ray-tracing'"), "{text}");
    }
    commands(&ctx);
}
