//! Pipelines that are lowered to compute shaders, on devices whose own pipelines are hidden.

use lvk::{
    BufferDesc, BufferUsage, Context, Dependencies, DeviceProfile, Error, Holder, RayQueryRequest,
    RayTracingLibraryDesc, RayTracingPipelineDesc, RayTracingPipelineHandle, RayTracingPipelinePath,
    RayTracingPipelineRequest, Result, ShaderStage, SpecializationConstant, SpecializationValue,
};
use lvk_tests::compute::{compute_pipeline, read_words, words_buffer};
use lvk_tests::shader_groups::{Counts, GroupScene, answering, ray_gen};
use lvk_tests::{TestDevice, device_with};

/// Returns a context for each lowered path that the device has, with the path.
fn lowered_devices() -> Vec<(RayTracingPipelinePath, TestDevice)> {
    let no_pipelines = DeviceProfile::no_rt_pipeline();
    let open = |ray_query, ray_tracing_pipeline| {
        device_with(|desc| {
            (desc.ray_query, desc.ray_tracing_pipeline) = (ray_query, ray_tracing_pipeline);
            desc.profile = Some(&no_pipelines);
        })
    };
    let mut devices = Vec::new();
    let software = open(RayQueryRequest::Off, RayTracingPipelineRequest::Software);
    devices.extend(software.map(|ctx| (RayTracingPipelinePath::Software, ctx)));
    let query = open(RayQueryRequest::Off, RayTracingPipelineRequest::Auto);
    let query = query.filter(|ctx| {
        let path = ctx.capabilities().ray_tracing_pipeline_path;
        let is_query = path == RayTracingPipelinePath::Query;
        if !is_query {
            eprintln!("NOT TESTED, {} has no ray queries", ctx.capabilities().device_name);
        }
        is_query
    });
    devices.extend(query.map(|ctx| (RayTracingPipelinePath::Query, ctx)));
    devices
}

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
fn a_lowered_pipeline_is_created_or_names_its_shader() {
    for (path, ctx) in lowered_devices() {
        match pipeline(&ctx) {
            Ok(_) => {}
            Err(Error::Lowering { pipeline, shader, why }) => {
                assert_eq!(pipeline, "two answers");
                assert!(!shader.is_empty() && !why.is_empty());
            }
            Err(other) => unreachable!("{path:?}: {other}"),
        }
    }
}

#[test]
fn a_lowered_pipeline_traces_without_pipelines_of_the_device() -> Result<()> {
    for (path, ctx) in lowered_devices() {
        let scene = GroupScene::new(&ctx)?;
        let pipeline = match pipeline(&ctx) {
            Err(Error::Lowering { why, .. }) => {
                eprintln!("NOT TESTED, {path:?}: {why}");
                continue;
            }
            made => made?,
        };
        let counts = Counts { hits: 0, misses: 1, callables: 0 };
        assert_eq!(scene.run(*pipeline, 0, counts)?, [1]);
        assert_eq!(scene.run(*pipeline, 1, counts)?, [501]);
        assert_eq!(ctx.ray_tracing_stack_bytes(*pipeline)?, 0);
        let raw = ctx.raw_ray_tracing_pipeline(*pipeline);
        assert!(matches!(raw, Err(Error::Unsupported { .. })), "{raw:?}");
        compute_state_outlives_traces(&ctx, &scene, *pipeline)?;
    }
    Ok(())
}

/// A direct and an indirect trace run between two dispatches of one compute pipeline, which is bound and gets its push
/// constants once.
fn compute_state_outlives_traces(
    ctx: &Context,
    scene: &GroupScene,
    pipeline: RayTracingPipelineHandle,
) -> Result<()> {
    let count = compute_pipeline(
        ctx,
        "layout(local_size_x = 1) in;
        layout(buffer_reference, scalar) buffer Words { uint at[]; };
        layout(push_constant, scalar) uniform Push { Words words; uint unused[4]; };
        void main() { words.at[0] += 1; }",
    );
    let results = words_buffer(ctx, &[7]);
    let usage = BufferUsage::INDIRECT;
    let data = Some(bytemuck::bytes_of(&[1_u32; 3]));
    let arguments = ctx.create_buffer(&BufferDesc { usage, data, ..Default::default() })?;
    let writes = Dependencies { buffers: &[*results], ..Default::default() };
    let counts = Counts { hits: 0, misses: 1, callables: 0 };
    let mut cmd = ctx.acquire_command_buffer()?;
    cmd.bind_compute_pipeline(*count)?;
    // Both blocks begin with the address of the results.
    scene.bind(&mut cmd, pipeline, counts, *results)?;
    cmd.dispatch([1, 1, 1], &writes)?;
    cmd.trace_rays([1, 1, 1], &writes)?;
    cmd.dispatch([1, 1, 1], &writes)?;
    cmd.trace_rays_indirect(1, *arguments, 0, &writes)?;
    cmd.dispatch([1, 1, 1], &writes)?;
    ctx.submit(cmd)?;
    assert_eq!(read_words(ctx, *results, 1), [502]);
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
