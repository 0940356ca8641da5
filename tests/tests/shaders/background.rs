//! Pipelines that are compiled in the background: placeholders, errors, drops, and the end of a context.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::mem::discriminant;

use bytemuck::NoUninit;
use lvk::{
    BlockLayout, ColorTarget, ComputePipelineDesc, ComputePipelineHandle, Context, Dependencies, Destroy,
    DeviceProfile, Error, Format, HitGroup, Holder, PendingPipeline, RayTracingPipelineDesc,
    RayTracingPipelineHandle, RenderPipelineDesc, Result, ShaderModuleHandle, ShaderRecord, ShaderStage,
    SpecializationConstant, SpecializationValue, shader_struct,
};
use lvk_tests::compute::{compute_pipeline, module, read_words, run_on_words, words_buffer};
use lvk_tests::warnings::{capture_warnings, take_warnings};
use lvk_tests::{device, device_with};

/// Writes the specialisation constant 0.
const WRITE: &str = "
    layout(local_size_x = 1) in;
    layout(constant_id = 0) const uint value = 1;
    layout(buffer_reference, scalar) writeonly buffer Words { uint at[]; };
    layout(push_constant, scalar) uniform Push { Words words; };
    void main() { words.at[0] = value; }";

const PLACEHOLDER: u32 = 99;

fn placeholder(ctx: &Context) -> Holder<ComputePipelineHandle> {
    compute_pipeline(ctx, &WRITE.replace("value = 1", &format!("value = {PLACEHOLDER}")))
}

fn start(ctx: &Context, module: ShaderModuleHandle, value: u32) -> PendingPipeline<ComputePipelineHandle> {
    let name = format!("writes {value}");
    let desc = ComputePipelineDesc {
        module: Some(module),
        specialization: &[SpecializationConstant { id: 0, value: SpecializationValue::U32(value) }],
        debug_name: &name,
        ..Default::default()
    };
    ctx.create_compute_pipeline_in_background(&desc).unwrap()
}

/// Starts a pipeline whose workgroup is larger than the device takes.
fn start_wrong(ctx: &Context, debug_name: &str) -> PendingPipeline<ComputePipelineHandle> {
    let module = module(ctx, ShaderStage::Compute, "layout(local_size_x_id = 0) in; void main() {}");
    let desc = ComputePipelineDesc {
        module: Some(*module),
        specialization: &[SpecializationConstant { id: 0, value: SpecializationValue::U32(1 << 30) }],
        debug_name,
        ..Default::default()
    };
    ctx.create_compute_pipeline_in_background(&desc).unwrap()
}

fn written(ctx: &Context, pipeline: ComputePipelineHandle) -> u32 {
    run_on_words(ctx, pipeline, &[0])[0]
}

#[test]
fn placeholders_serve_until_pipelines_are_ready() {
    let Some(ctx) = device() else { return };
    let grey = placeholder(&ctx);
    let module = module(&ctx, ShaderStage::Compute, WRITE);
    let mut pending: Vec<_> = (0..48).map(|value| start(&ctx, *module, value)).collect();
    drop(module);
    let last = pending.last_mut().unwrap();
    assert_eq!((last.name(), last.handle()), ("writes 47", None));
    assert_eq!(written(&ctx, last.handle_or(*grey).unwrap()), PLACEHOLDER, "47 pipelines come first");
    for (value, pipeline) in (0..).zip(&mut pending) {
        while !pipeline.poll().unwrap() {
            assert_eq!(pipeline.handle_or(*grey).unwrap_or(*grey) == *grey, pipeline.handle().is_none());
            std::thread::yield_now();
        }
        assert_eq!(written(&ctx, pipeline.handle_or(*grey).unwrap()), value);
    }
    for (value, pipeline) in (0..).zip(pending) {
        let holder = pipeline.wait().unwrap();
        assert_eq!(written(&ctx, *holder), value, "a ready pipeline is handed over");
    }
}

#[test]
fn errors_are_returned_once_with_the_name() {
    let Some(ctx) = device() else { return };
    let grey = placeholder(&ctx);
    let mut huge = start_wrong(&ctx, "huge");
    let error = loop {
        match huge.handle_or(*grey) {
            Ok(handle) => assert_eq!(handle, *grey),
            Err(error) => break error,
        }
    };
    assert!(matches!(&error, Error::LimitExceeded { object, .. } if object == "huge"), "{error}");
    assert_eq!((huge.handle_or(*grey).unwrap(), huge.poll().unwrap(), huge.handle()), (*grey, false, None));
    let again = huge.wait().unwrap_err();
    assert!(matches!(&again, Error::InvalidUsage { object, .. } if object == "huge"), "{again}");
    assert!(again.to_string().contains("returned before"), "{again}");
    let waited = start_wrong(&ctx, "huge").wait().unwrap_err();
    assert!(matches!(&waited, Error::LimitExceeded { object, .. } if object == "huge"), "{waited}");
}

#[test]
fn an_error_that_was_never_returned_is_logged() {
    capture_warnings();
    let Some(ctx) = device() else { return };
    let (first, second) = (start_wrong(&ctx, "forgotten"), start_wrong(&ctx, "waited for"));
    assert!(second.wait().is_err());
    // The first job may still be on another thread.
    std::thread::sleep(std::time::Duration::from_millis(300));
    drop(first);
    assert_eq!(take_warnings("forgotten").len(), 1);
    assert!(take_warnings("waited for").is_empty(), "its error was returned");
}

#[test]
fn wrong_handles_are_refused_at_once() {
    let Some(ctx) = device() else { return };
    let gone = module(&ctx, ShaderStage::Compute, WRITE);
    let stale = *gone;
    drop(gone);
    let compute = ComputePipelineDesc { module: Some(stale), ..Default::default() };
    let render = RenderPipelineDesc { vertex: Some(stale), ..Default::default() };
    let rays = RayTracingPipelineDesc { ray_gen: &[stale], ..Default::default() };
    for error in [
        ctx.create_compute_pipeline_in_background(&compute).map(|_| ()),
        ctx.create_render_pipeline_in_background(&render).map(|_| ()),
        ctx.create_ray_tracing_pipeline_in_background(&rays).map(|_| ()),
    ] {
        assert!(matches!(error, Err(Error::StaleHandle { .. })), "{error:?}");
    }
    let none = ComputePipelineDesc { debug_name: "empty", ..Default::default() };
    let error = ctx.create_compute_pipeline_in_background(&none).map(|_| ()).unwrap_err();
    assert!(error.to_string().contains("empty"), "{error}");
}

/// Returns the error of a creation in the background, which must be that of the creation at once.
#[track_caller]
fn same_error<H: Destroy>(now: Result<Holder<H>>, later: Result<PendingPipeline<H>>) -> Error {
    let (now, later) = (now.unwrap_err(), later.and_then(PendingPipeline::wait).unwrap_err());
    assert_eq!(now.to_string(), later.to_string());
    assert_eq!(discriminant(&now), discriminant(&later), "{now}");
    later
}

shader_struct! {
    #[derive(Clone, Copy, NoUninit)]
    #[repr(C)]
    /// Lacks the address that the shader reads.
    struct Unlike {
        number: u32,
    }
}

#[test]
fn compute_pipelines_in_the_background_have_the_errors_of_those_at_once() {
    let Some(ctx) = device() else { return };
    let compute = module(&ctx, ShaderStage::Compute, WRITE);
    let wide = module(&ctx, ShaderStage::Compute, "layout(local_size_x_id = 0) in; void main() {}");
    let vertex = module(&ctx, ShaderStage::Vertex, "void main() { gl_Position = vec4(0); }");
    let refuse = |desc: ComputePipelineDesc<'_>| {
        let desc = ComputePipelineDesc { debug_name: "odd one", ..desc };
        same_error(ctx.create_compute_pipeline(&desc), ctx.create_compute_pipeline_in_background(&desc))
    };
    let constant = |id, value| [SpecializationConstant { id, value: SpecializationValue::U32(value) }];
    let desc = ComputePipelineDesc { module: Some(*compute), ..Default::default() };
    for desc in [
        ComputePipelineDesc { module: None, ..desc },
        ComputePipelineDesc { module: Some(*vertex), ..desc },
        ComputePipelineDesc { specialization: &constant(4, 1), ..desc },
    ] {
        let error = refuse(desc);
        assert!(matches!(error, Error::InvalidUsage { .. }), "{error}");
    }
    let huge = ComputePipelineDesc { module: Some(*wide), specialization: &constant(0, 1 << 30), ..desc };
    let error = refuse(huge);
    assert!(matches!(error, Error::LimitExceeded { .. }), "{error}");
    let error = refuse(ComputePipelineDesc { layouts: &[BlockLayout::push_constants::<Unlike>()], ..desc });
    assert!(matches!(error, Error::LayoutMismatch { .. }), "{error}");
}

#[test]
fn render_pipelines_in_the_background_have_the_errors_of_those_at_once() {
    let Some(ctx) = device() else { return };
    let vertex = module(&ctx, ShaderStage::Vertex, "void main() { gl_Position = vec4(0); }");
    let fragment = module(&ctx, ShaderStage::Fragment, "void main() {}");
    let refuse = |desc: RenderPipelineDesc<'_>| {
        let desc = RenderPipelineDesc { debug_name: "odd one", ..desc };
        same_error(ctx.create_render_pipeline(&desc), ctx.create_render_pipeline_in_background(&desc))
    };
    let desc = RenderPipelineDesc { vertex: Some(*vertex), ..Default::default() };
    for desc in [
        RenderPipelineDesc { vertex: None, ..desc },
        RenderPipelineDesc { vertex: Some(*fragment), ..desc },
        RenderPipelineDesc { fragment: Some(*vertex), ..desc },
    ] {
        let error = refuse(desc);
        assert!(matches!(error, Error::InvalidUsage { .. }), "{error}");
    }
    let error = refuse(RenderPipelineDesc { color: &[Format::D32Float.into()], ..desc });
    assert!(matches!(error, Error::Unsupported { .. }), "{error}");
    let many = vec![ColorTarget::from(Format::Rgba8Unorm); 9];
    let error = refuse(RenderPipelineDesc { color: &many, ..desc });
    assert!(matches!(error, Error::LimitExceeded { .. }), "{error}");
}

#[test]
fn ray_tracing_pipelines_in_the_background_have_the_errors_of_those_at_once() {
    let Some(ctx) = device() else { return };
    if !has_rays(&ctx) {
        return;
    }
    let ray_gen = module(&ctx, ShaderStage::RayGen, "void main() {}");
    let text = "layout(shaderRecordEXT, scalar) buffer Record { uint value; } record;
        layout(location = 0) rayPayloadInEXT uint payload;
        void main() { payload = record.value; }";
    let miss = module(&ctx, ShaderStage::Miss, text);
    let refuse = |desc: RayTracingPipelineDesc<'_>| {
        let desc = RayTracingPipelineDesc { debug_name: "odd one", ..desc };
        let later = ctx.create_ray_tracing_pipeline_in_background(&desc);
        same_error(ctx.create_ray_tracing_pipeline(&desc), later)
    };
    let (ray_gens, misses) = ([*ray_gen], [*miss]);
    let desc = RayTracingPipelineDesc { ray_gen: &ray_gens, ..Default::default() };
    for desc in [
        RayTracingPipelineDesc { ray_gen: &[], ..desc },
        RayTracingPipelineDesc { ray_gen: &misses, ..desc },
        RayTracingPipelineDesc { max_recursion: 0, ..desc },
    ] {
        let error = refuse(desc);
        assert!(matches!(error, Error::InvalidUsage { .. }), "{error}");
    }
    let error = refuse(RayTracingPipelineDesc { max_recursion: u32::MAX, ..desc });
    assert!(matches!(error, Error::LimitExceeded { .. }), "{error}");
    let error = refuse(RayTracingPipelineDesc { miss: &misses, ..desc });
    assert!(matches!(error, Error::ShaderRecord { .. }), "{error}");
}

#[test]
fn without_ray_tracing_pipelines_those_in_the_background_are_unsupported() {
    let profile = DeviceProfile::no_ray_tracing();
    let Some(ctx) = device_with(|desc| desc.profile = Some(&profile)) else { return };
    let desc = RayTracingPipelineDesc { debug_name: "no rays", ..Default::default() };
    let later = ctx.create_ray_tracing_pipeline_in_background(&desc);
    let error = same_error(ctx.create_ray_tracing_pipeline(&desc), later);
    assert!(matches!(error, Error::Unsupported { .. }), "{error}");
}

/// The scaffold checks that the context ends in silence, and the report of leaks would be a warning.
#[test]
fn the_end_of_a_context_joins_what_runs_and_drops_what_waits() {
    capture_warnings();
    let Some(ctx) = device() else { return };
    let module = module(&ctx, ShaderStage::Compute, WRITE);
    let mut pending: Vec<_> = (0..64).map(|value| start(&ctx, *module, value)).collect();
    let kept = pending.pop().unwrap().wait().unwrap();
    pending.extend((100..164).map(|value| start(&ctx, *module, value)));
    assert_eq!(written(&ctx, *kept), 63);
    drop((pending, module, kept));
    drop(ctx);
    let warnings = take_warnings("writes 1");
    assert!(warnings.is_empty(), "{warnings:?}");
}

#[test]
fn a_dropped_pipeline_is_no_live_object() {
    let Some(ctx) = device() else { return };
    let module = module(&ctx, ShaderStage::Compute, WRITE);
    let mut ready = start(&ctx, *module, 5);
    while !ready.poll().unwrap() {
        std::thread::yield_now();
    }
    let handle = ready.handle().unwrap();
    let lives = || ctx.live_objects().iter().any(|object| object.name == "writes 5");
    assert!(lives());
    drop(ready);
    assert!(!lives());
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    assert!(matches!(cmd.bind_compute_pipeline(handle), Err(Error::StaleHandle { .. })));
    for value in 10..20 {
        drop(start(&ctx, *module, value));
    }
    assert_eq!(written(&ctx, *start(&ctx, *module, 7).wait().unwrap()), 7);
    assert!(!ctx.live_objects().iter().any(|object| object.name.starts_with("writes")));
}

#[test]
fn graphics_pipelines_are_compiled_in_the_background() {
    let Some(ctx) = device() else { return };
    let vertex = module(&ctx, ShaderStage::Vertex, "void main() { gl_Position = vec4(0.0, 0.0, 0.0, 1.0); }");
    let text = "layout(location = 0) out vec4 color; void main() { color = vec4(1.0); }";
    let fragment = module(&ctx, ShaderStage::Fragment, text);
    let color = [ColorTarget::new(Format::Rgba8Unorm)];
    let desc = RenderPipelineDesc {
        vertex: Some(*vertex),
        fragment: Some(*fragment),
        color: &color,
        debug_name: "white",
        ..Default::default()
    };
    let pending = ctx.create_render_pipeline_in_background(&desc).unwrap();
    drop((vertex, fragment));
    let pipeline = pending.wait().unwrap();
    assert!(ctx.live_objects().iter().any(|object| object.name == "white"));
    drop(pipeline);
    let wrong = RenderPipelineDesc { fragment: None, vertex: None, debug_name: "no stages", ..desc };
    let error = ctx.create_render_pipeline_in_background(&wrong).unwrap().wait().unwrap_err();
    assert!(error.to_string().contains("no stages"), "{error}");
}

const RECORD: u32 = 0x1234_5678;

/// Starts ray tracing pipelines that write their shader record.
fn start_rays(ctx: &Context, count: usize) -> Vec<PendingPipeline<RayTracingPipelineHandle>> {
    let text = "layout(buffer_reference, scalar) writeonly buffer Words { uint at[]; };
        layout(push_constant, scalar) uniform Push { Words words; };
        layout(shaderRecordEXT, scalar) buffer Record { uint value; } record;
        void main() { words.at[0] = record.value; }";
    let ray_gen = module(ctx, ShaderStage::RayGen, text);
    let hit = module(ctx, ShaderStage::ClosestHit, "void main() {}");
    let start = |_| {
        let bytes = RECORD.to_ne_bytes();
        let record = ShaderRecord::from_bytes(&bytes);
        let desc = RayTracingPipelineDesc {
            ray_gen: &[*ray_gen],
            ray_gen_records: &[record],
            hit_groups: &[HitGroup { closest_hit: Some(*hit), record, ..Default::default() }],
            debug_name: "rays",
            ..Default::default()
        };
        ctx.create_ray_tracing_pipeline_in_background(&desc).unwrap()
    };
    (0..count).map(start).collect()
}

/// True if the device has ray tracing pipelines. Prints a line if not.
fn has_rays(ctx: &Context) -> bool {
    let has = ctx.capabilities().ray_tracing_pipeline;
    if !has {
        eprintln!("NOT TESTED, {} has no ray tracing pipelines", ctx.capabilities().device_name);
    }
    has
}

/// Shaders read their record, so the shader binding table was uploaded.
#[test]
fn ray_tracing_pipelines_are_compiled_in_the_background() {
    let Some(ctx) = device() else { return };
    if !has_rays(&ctx) {
        return;
    }
    for pipeline in start_rays(&ctx, 4) {
        let pipeline = pipeline.wait().unwrap();
        let words = words_buffer(&ctx, &[0]);
        let mut cmd = ctx.acquire_command_buffer().unwrap();
        cmd.bind_ray_tracing_pipeline(*pipeline).unwrap();
        cmd.push_constants(&words.address().unwrap()).unwrap();
        let buffers = &[*words];
        cmd.trace_rays([1, 1, 1], &Dependencies { buffers, ..Default::default() }).unwrap();
        ctx.submit(cmd).unwrap();
        assert_eq!(read_words(&ctx, *words, 1), [RECORD]);
    }
}

/// NVIDIA's driver deadlocks if both happen at once, so the library locks them.
#[test]
fn devices_come_and_go_while_ray_tracing_pipelines_are_compiled() {
    let Some(ctx) = device() else { return };
    if !has_rays(&ctx) {
        return;
    }
    let pending = start_rays(&ctx, 12);
    for _ in 0..2 {
        let Some(other) = device() else { return };
        drop(start_rays(&other, 3));
    }
    for pipeline in pending {
        assert!(pipeline.wait().is_ok());
    }
}
