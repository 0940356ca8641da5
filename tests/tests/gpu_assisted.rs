//! GPU-assisted validation: it reports an access out of bounds, so that its silence in other tests means something.
//! It also prints what shaders print.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::ffi::OsStr;

use lvk::{
    ComputePipelineHandle, Context, Dependencies, HitGroup, RayTracingPipelineDesc, RayTracingPipelinePath,
    Result, ShaderStage, ValidationMode,
};
use lvk_tests::compute::{compute_pipeline, words_buffer};
use lvk_tests::device_with;
use lvk_tests::pipeline_paths::pipeline_devices;
use lvk_tests::ray_tracer::shader;
use lvk_tests::shader_groups::{Counts, GroupScene};
use lvk_tests::subprocess::output_of_subprocess;

/// Writes the word of one buffer at a place to another.
const COPY: &str = r#"
    layout(local_size_x = 1) in;
    layout(buffer_reference, scalar) buffer Words { uint at[]; };
    layout(push_constant, scalar) uniform Push { Words from; Words to; uint place; };
    void main() { to.at[0] = from.at[place]; }"#;

#[repr(C)]
#[derive(Clone, Copy, bytemuck::NoUninit)]
struct Push {
    from: u64,
    to: u64,
    place: u32,
    unused: u32,
}

#[test]
fn a_read_beyond_a_buffer_is_a_message() -> Result<()> {
    let Some(ctx) = device_with(|desc| desc.validation = ValidationMode::GpuAssisted) else { return Ok(()) };
    let (from, to) = (words_buffer(&ctx, &[7; 16]), words_buffer(&ctx, &[0; 16]));
    let pipeline = compute_pipeline(&ctx, COPY);
    for (place, messages) in [(15, false), (16, true), (1000, true)] {
        let (from, target) = (ctx.buffer_address(*from)?, ctx.buffer_address(*to)?);
        let mut cmd = ctx.acquire_command_buffer()?;
        cmd.bind_compute_pipeline(*pipeline)?;
        cmd.push_constants(&Push { from, to: target, place, unused: 0 })?;
        cmd.dispatch([1, 1, 1], &Dependencies { buffers: &[*to], ..Default::default() })?;
        ctx.submit(cmd)?;
        ctx.wait_idle()?;
        let found = ctx.take_messages();
        assert_eq!(!found.is_empty(), messages, "{found:?}");
    }
    Ok(())
}

/// Printed once for each invocation.
const PRINT: &str = r#"
    layout(local_size_x = 3) in;
    void main() { debugPrintfEXT("sheep %u of %u", gl_LocalInvocationID.x + 1u, gl_WorkGroupSize.x); }"#;

#[test]
fn the_layer_prints_what_shaders_print() {
    let on = Some(OsStr::new("1"));
    let variables = [("VK_LAYER_PRINTF_ENABLE", on), ("VK_LAYER_PRINTF_TO_STDOUT", on)];
    let said = output_of_subprocess(the_layer_prints_what_shaders_print, &variables, || {
        let Some(ctx) = device_with(|desc| desc.validation = ValidationMode::Standard) else { return };
        let pipeline = compute_pipeline(&ctx, PRINT);
        dispatch_once(&ctx, *pipeline).unwrap();
        println!("dispatched");
    });
    let Some(said) = said.filter(|said| said.contains("dispatched")) else { return };
    for number in 1..=3 {
        assert!(said.contains(&format!("sheep {number} of 3")), "{said}");
    }
}

/// Each shader of a ray prints the path, and the index of the ray.
fn print_in_each_shader(path: RayTracingPipelinePath, ctx: &Context) -> Result<()> {
    let text = |variable: &str, name: &str, code: &str| {
        format!(
            "layout(buffer_reference, scalar) buffer Words {{ uint at[]; }};
             layout(push_constant, scalar) uniform Push {{ Words results; uint tlas; uint hits; uint misses; }};
             layout(location = 0) {variable} uint value;
             void main() {{ {code} debugPrintfEXT(\"{path:?} {name} %u\", gl_LaunchIDEXT.x + value); }}"
        )
    };
    let trace = "value = 0;
        traceRayEXT(kTLAS[tlas], 0, 0xff, 0, 0, 0, vec3(0.25, 0.25, -1), 0.0, vec3(0, 0, gl_LaunchIDEXT.x == 0 ? 1 : -1), 9.0, 0);";
    let ray_gen = shader(ctx, ShaderStage::RayGen, &text("rayPayloadEXT", "behind", trace))?;
    let hit = shader(ctx, ShaderStage::ClosestHit, &text("rayPayloadInEXT", "hit", "value += 10;"))?;
    let miss = shader(ctx, ShaderStage::Miss, &text("rayPayloadInEXT", "miss", "value += 20;"))?;
    let pipeline = ctx.create_ray_tracing_pipeline(&RayTracingPipelineDesc {
        ray_gen: &[*ray_gen],
        miss: &[*miss],
        hit_groups: &[HitGroup { closest_hit: Some(*hit), ..Default::default() }],
        ..Default::default()
    })?;
    let counts = Counts { hits: 1, misses: 1, callables: 0 };
    GroupScene::new(ctx)?.run(*pipeline, 0, counts).map(drop)
}

#[test]
fn the_layer_prints_what_ray_tracing_shaders_print_on_every_path() {
    let on = Some(OsStr::new("1"));
    let variables = [("VK_LAYER_PRINTF_ENABLE", on), ("VK_LAYER_PRINTF_TO_STDOUT", on)];
    let test = the_layer_prints_what_ray_tracing_shaders_print_on_every_path;
    let said = output_of_subprocess(test, &variables, || {
        for (path, ctx) in pipeline_devices() {
            print_in_each_shader(path, &ctx).unwrap();
            println!("traced by {path:?}");
        }
    });
    let Some(said) = said else { return };
    for path in ["Hardware", "Query", "Software"] {
        if !said.contains(&format!("traced by {path}")) {
            continue;
        }
        for line in ["hit 10", "miss 21", "behind 10", "behind 21"] {
            assert!(said.contains(&format!("{path} {line}")), "{path} {line}: {said}");
        }
    }
}

fn dispatch_once(ctx: &Context, pipeline: ComputePipelineHandle) -> Result<()> {
    let mut cmd = ctx.acquire_command_buffer()?;
    cmd.bind_compute_pipeline(pipeline)?;
    cmd.dispatch([1, 1, 1], &Dependencies::default())?;
    ctx.submit(cmd)?;
    ctx.wait_idle()
}
