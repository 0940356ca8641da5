//! Work of the GPU that takes long: it is still under way when its context ends, or when a frame is presented.

use std::time::{Duration, Instant};

use lvk::{
    BufferDesc, BufferHandle, CommandBuffer, ComputePipelineDesc, ComputePipelineHandle, Context,
    ContextDesc, Dependencies, Holder, ShaderModuleDesc, ShaderSource, ShaderStage,
};

use crate::{Failure, context};

/// More than the end of a context waits for a queue whose waits fail.
const LONG: Duration = Duration::from_secs(3);
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

/// A dispatch that takes a given time.
pub(crate) struct SlowWork {
    words: Holder<BufferHandle>,
    pipeline: Holder<ComputePipelineHandle>,
    rounds: u32,
}

impl SlowWork {
    /// Measures how many rounds take as long as `time`.
    pub(crate) fn new(ctx: &Context, time: Duration) -> Result<Self, Failure> {
        let words = ctx.create_buffer(&BufferDesc {
            size_bytes: 64 * 4,
            debug_name: "slow words",
            ..Default::default()
        })?;
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
        let mut work = Self { words, pipeline, rounds: 1 };
        // The first dispatch compiles the shader.
        work.run(ctx)?;
        work.rounds = MEASURED_ROUNDS;
        let start = Instant::now();
        work.run(ctx)?;
        let rounds = f64::from(MEASURED_ROUNDS) * time.as_secs_f64() / start.elapsed().as_secs_f64();
        Ok(Self { rounds: rounds as u32, ..work })
    }

    /// Records the dispatch.
    pub(crate) fn record(&self, cmd: &mut CommandBuffer) -> lvk::Result<()> {
        cmd.bind_compute_pipeline(*self.pipeline)?;
        cmd.push_constants(&Push { words: self.words.address()?, rounds: self.rounds, tail: 0 })?;
        cmd.dispatch([1, 1, 1], &Dependencies { buffers: &[*self.words], ..Default::default() })
    }

    fn run(&self, ctx: &Context) -> lvk::Result<()> {
        let mut cmd = ctx.acquire_command_buffer()?;
        self.record(&mut cmd)?;
        ctx.wait(ctx.submit(cmd)?)
    }
}

/// Submits a dispatch of three seconds, and ends the context without a wait.
pub(crate) fn outlives_its_context() -> Result<Vec<u8>, Failure> {
    let ctx = context(ContextDesc::default())?;
    let work = SlowWork::new(&ctx, LONG)?;
    let mut cmd = ctx.acquire_command_buffer()?;
    work.record(&mut cmd)?;
    ctx.submit(cmd)?;
    Ok(b"submitted".to_vec())
}
