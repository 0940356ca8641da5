//! Work that is still under way when its context ends.

use std::time::Instant;

use lvk::{
    BufferDesc, BufferHandle, ComputePipelineDesc, ComputePipelineHandle, Context, ContextDesc, Dependencies,
    ShaderModuleDesc, ShaderSource, ShaderStage, SubmitHandle,
};

use crate::{Failure, context};

/// Seconds that the work takes: more than the end of a context waits for a queue whose waits fail.
const SECONDS: f64 = 3.0;
/// Rounds of the measured dispatch.
const MEASURED_ROUNDS: u32 = 1 << 20;

const SLOW: &str = "
    layout(local_size_x = 64) in;
    layout(buffer_reference, scalar) buffer Words { uint at[]; };
    layout(push_constant, scalar) uniform Push { Words words; uint rounds; };
    void main() {
        uint i = gl_GlobalInvocationID.x;
        for (uint round = 0; round < rounds; ++round)
            words.at[i] = 1664525 * words.at[i] + round;
    }";

#[repr(C)]
#[derive(Clone, Copy, bytemuck::NoUninit)]
struct Push {
    words: u64,
    rounds: u32,
    tail: u32,
}

/// Submits a dispatch of three seconds, and ends the context without a wait.
pub(crate) fn outlives_its_context() -> Result<Vec<u8>, Failure> {
    let ctx = context(ContextDesc::default())?;
    let words =
        ctx.create_buffer(&BufferDesc { size_bytes: 64 * 4, debug_name: "words", ..Default::default() })?;
    let module = ctx.create_shader_module(&ShaderModuleDesc {
        stage: ShaderStage::Compute,
        source: ShaderSource::Glsl(SLOW),
        debug_name: "slow.comp",
        ..Default::default()
    })?;
    let pipeline = ctx.create_compute_pipeline(&ComputePipelineDesc {
        module: Some(*module),
        debug_name: "slow",
        ..Default::default()
    })?;
    // The first dispatch compiles the shader.
    ctx.wait(submit(&ctx, *pipeline, *words, 1)?)?;
    let start = Instant::now();
    ctx.wait(submit(&ctx, *pipeline, *words, MEASURED_ROUNDS)?)?;
    let rounds = f64::from(MEASURED_ROUNDS) * SECONDS / start.elapsed().as_secs_f64();
    submit(&ctx, *pipeline, *words, rounds as u32)?;
    Ok(b"submitted".to_vec())
}

fn submit(
    ctx: &Context,
    pipeline: ComputePipelineHandle,
    buffer: BufferHandle,
    rounds: u32,
) -> Result<SubmitHandle, Failure> {
    let mut cmd = ctx.acquire_command_buffer()?;
    cmd.bind_compute_pipeline(pipeline)?;
    cmd.push_constants(&Push { words: ctx.buffer_address(buffer)?, rounds, tail: 0 })?;
    cmd.dispatch([1, 1, 1], &Dependencies { buffers: &[buffer], ..Default::default() })?;
    Ok(ctx.submit(cmd)?)
}
