//! Devices of other engines that have what `Context::requirements` says and nothing else.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk::ash::{ext, khr, vk};
use lvk::{
    BlasDesc, BlasGeometry, BufferDesc, BufferUsage, BuildFlags, Context, ContextDesc, Dependencies, Error,
    FeatureSet, OptionalFeature, QueueRequest, RawContext, RayQueryPath, RayQueryRequest,
    RayTracingPipelineRequest, TlasDesc, TlasInstance, Triangles,
};
use lvk_tests::compute::{compute_pipeline, read_words, words_buffer};
use lvk_tests::device_with;
use lvk_tests::guest_engine::{GuestEngine, GuestInstance};

/// Each of four invocations sends a ray through a point of the plane z = 0, and writes 1 for a hit.
const HITS: &str = "
    #include <lvk/ray_query.glsl>
    layout(local_size_x = 4) in;
    layout(buffer_reference, scalar) buffer Words { uint at[]; };
    layout(push_constant, scalar) uniform Push { Words words; uint tlas; };
    void main() {
        uint i = gl_LocalInvocationIndex;
        LvkRayQuery rq;
        vec3 from = vec3(i, i, -1.0) * vec3(0.25, 0.25, 1.0);
        lvkRayQueryInitialize(rq, tlas, LVK_RAY_FLAG_OPAQUE, 0xFF, from, 0.0, vec3(0, 0, 1), 5.0);
        while (lvkRayQueryProceed(rq)) {}
        bool hit = lvkRayQueryType(rq, LVK_COMMITTED) == LVK_COMMITTED_TRIANGLE;
    #ifdef FETCH
        vec3 corners[3];
        if (hit) lvkRayQueryTriangleVertexPositions(rq, LVK_COMMITTED, corners);
        words.at[i] = hit ? uint(corners[1].x * 100.0 + 0.5) : 0;
    #else
        words.at[i] = hit ? 1 : 0;
    #endif
    }";

/// Traces rays at a triangle that covers the plane where x + y < 1.
fn trace(ctx: &Context) -> Vec<u32> {
    trace_with(ctx, HITS, BuildFlags::FAST_TRACE)
}

fn trace_with(ctx: &Context, shader: &str, flags: BuildFlags) -> Vec<u32> {
    let positions =
        [[0.0_f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]].map(|at| at.map(|part| part - 0.01));
    let (usage, data) = (BufferUsage::ACCEL_INPUT, Some(bytemuck::bytes_of(&positions)));
    let vertices = ctx.create_buffer(&BufferDesc { usage, data, ..Default::default() }).unwrap();
    let geometries = &[BlasGeometry::Triangles(Triangles::packed(*vertices, 3))];
    let blas = ctx.create_blas(&BlasDesc { geometries, flags, ..Default::default() }).unwrap();
    let instances = &[TlasInstance::new(*blas)];
    let tlas = ctx.create_tlas(&TlasDesc { instances, ..Default::default() }).unwrap();
    let (pipeline, words) = (compute_pipeline(ctx, shader), words_buffer(ctx, &[7; 4]));
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.bind_compute_pipeline(*pipeline).unwrap();
    let address = ctx.buffer_address(*words).unwrap();
    cmd.push_constants(&[address as u32, (address >> 32) as u32, tlas.index()]).unwrap();
    cmd.dispatch([1, 1, 1], &Dependencies { buffers: &[*words], ..Default::default() }).unwrap();
    ctx.submit(cmd).unwrap();
    read_words(ctx, *words, 4)
}

/// What the library enables on its own device is what it asks of others.
fn assert_same_as_own(ctx: &Context, adjust: impl FnOnce(&mut ContextDesc<'_>)) {
    let Some(own) = device_with(adjust) else { return };
    let (guest, own) = (ctx.capabilities(), own.capabilities());
    assert_eq!(guest.optional, own.optional);
    assert_eq!(guest.ray_query_path, own.ray_query_path);
    assert_eq!(guest.ray_tracing_pipeline, own.ray_tracing_pipeline);
    assert_eq!(guest.trace_rays_indirect, own.trace_rays_indirect);
    assert_eq!(guest.pipeline_libraries, own.pipeline_libraries);
    assert_eq!(guest.position_fetch, own.position_fetch);
    assert_eq!(guest.mesh_shader, own.mesh_shader);
}

#[test]
fn a_device_of_exactly_the_requirements_answers_ray_queries() {
    for (ray_query, ray_tracing_pipeline) in [
        (RayQueryRequest::HardwareIfPresent, RayTracingPipelineRequest::HardwareIfPresent),
        (RayQueryRequest::HardwareIfPresent, RayTracingPipelineRequest::Off),
        (RayQueryRequest::Software, RayTracingPipelineRequest::Off),
    ] {
        let desc = ContextDesc { ray_query, ray_tracing_pipeline, ..Default::default() };
        let Some(engine) = GuestEngine::new(&desc) else { return };
        let ctx = engine.context(&desc);
        if ctx.capabilities().ray_query_path == RayQueryPath::None {
            eprintln!("NOT TESTED, {} has no ray queries", ctx.capabilities().device_name);
            continue;
        }
        assert_eq!(trace(&ctx), [1, 1, 0, 0], "{ray_query:?}");
        assert_same_as_own(&ctx, |own| {
            (own.ray_query, own.ray_tracing_pipeline) = (ray_query, ray_tracing_pipeline);
        });
        let named = engine.requirements.extensions().contains(&khr::ray_query::NAME);
        assert_eq!(named, ctx.capabilities().ray_query_path == RayQueryPath::Hardware);
    }
}

#[test]
fn positions_are_fetched_on_another_engines_device() {
    let ray_query = RayQueryRequest::HardwareIfPresent;
    let desc = ContextDesc { ray_query, ..Default::default() };
    let Some(engine) = GuestEngine::new(&desc) else { return };
    let (fetch, flags) = (format!("#define FETCH\n{HITS}"), BuildFlags::POSITION_FETCH);
    let ctx = engine.context(&desc);
    if !ctx.capabilities().position_fetch || ctx.capabilities().ray_query_path != RayQueryPath::Hardware {
        return eprintln!("NOT TESTED, {} fetches no positions", ctx.capabilities().device_name);
    }
    assert_eq!(trace_with(&ctx, &fetch, flags), [99, 99, 0, 0]);
    let raw = RawContext { position_fetch: false, ..engine.raw() };
    // SAFETY: the device has more on than the description says, and outlives the context.
    let unsaid = unsafe { Context::from_raw(raw, &desc) }.unwrap();
    assert!(!unsaid.capabilities().position_fetch, "nobody said that it is on");
}

#[test]
fn optional_features_can_be_left_out() {
    let desc = ContextDesc {
        ray_query: RayQueryRequest::Software,
        queues: QueueRequest::Shared,
        ..Default::default()
    };
    let Some(instance) = GuestInstance::new(&desc) else { return };
    let requirements = instance.requirements(&desc).unwrap().without(FeatureSet::ALL);
    assert_eq!(requirements.optional_features(), FeatureSet::NONE);
    assert!(!requirements.extensions().contains(&ext::custom_border_color::NAME));
    assert_eq!(requirements.queue_locations()[1], requirements.queue_locations()[0]);
    let engine = GuestEngine::with_requirements(instance, requirements, vk::DeviceCreateInfo::default());
    let ctx = engine.context(&desc);
    assert!(!ctx.capabilities().has(OptionalFeature::Int64));
    assert_eq!(trace(&ctx), [1, 1, 0, 0]);
}

/// As of wgpu, which lists promoted extensions one by one.
#[test]
fn requirements_are_merged_into_the_structures_of_promoted_extensions() {
    let desc = ContextDesc { ray_query: RayQueryRequest::HardwareIfPresent, ..Default::default() };
    let Some(instance) = GuestInstance::new(&desc) else { return };
    let requirements = instance.requirements(&desc).unwrap();
    let core = vk::PhysicalDeviceFeatures::default().independent_blend(true);
    let mut views = vk::PhysicalDeviceMultiviewFeatures::default().multiview(true);
    let mut timelines = vk::PhysicalDeviceTimelineSemaphoreFeatures::default();
    let mut indexing = vk::PhysicalDeviceDescriptorIndexingFeatures::default();
    let mut sizes = vk::PhysicalDeviceSubgroupSizeControlFeatures::default();
    let info = vk::DeviceCreateInfo::default()
        .enabled_features(&core)
        .push_next(&mut views)
        .push_next(&mut timelines)
        .push_next(&mut indexing)
        .push_next(&mut sizes);
    let engine = GuestEngine::with_requirements(instance, requirements, info);
    assert_eq!([timelines.timeline_semaphore, indexing.runtime_descriptor_array], [vk::TRUE; 2]);
    let ctx = engine.context(&desc);
    if ctx.capabilities().ray_query_path != RayQueryPath::None {
        assert_eq!(trace(&ctx), [1, 1, 0, 0]);
    }
}

#[test]
fn a_device_that_cannot_meet_the_requirements_is_refused() {
    let desc = ContextDesc::default();
    let Some(instance) = GuestInstance::new(&desc) else { return };
    let has = instance.requirements(&desc).unwrap().optional_features();
    let lacking = OptionalFeature::all().find(|feature| !has.contains(*feature)).unwrap();
    let required = ContextDesc { required_features: &[lacking], ..Default::default() };
    match instance.requirements(&required) {
        Err(Error::NoDevice { candidates, .. }) => {
            assert_eq!(candidates[0].missing, [lacking.vulkan_name()]);
        }
        other => unreachable!("{other:?}"),
    }
    // SAFETY: the instance is valid, and the device is refused before its use.
    let null = unsafe {
        let device = vk::PhysicalDevice::null();
        Context::requirements(&instance.entry, &instance.raw, instance.extensions, device, &desc)
    };
    assert!(
        matches!(&null, Err(Error::InvalidUsage { object, .. }) if object == "physical_device"),
        "{null:?}"
    );
}

#[test]
fn the_instance_needs_extensions_for_windows_and_names_only() {
    let Some(instance) = GuestInstance::new(&ContextDesc::default()) else { return };
    let needs = |desc: &ContextDesc<'_>| Context::instance_requirements(&instance.entry, desc).unwrap();
    assert!(needs(&ContextDesc::default()).is_empty());
    let named = ContextDesc { debug_names: Some(true), ..Default::default() };
    assert_eq!(needs(&named), [ext::debug_utils::NAME]);
}
