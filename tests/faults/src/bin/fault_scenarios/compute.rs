//! Compute steps that scenarios share: each reads one buffer of words and writes another.

use lvk::{
    BufferDesc, BufferHandle, CommandBuffer, ComputePipelineDesc, ComputePipelineHandle, Context,
    Dependencies, Holder, Result, ShaderModuleDesc, ShaderSource, ShaderStage,
};

/// Words of a buffer.
pub(crate) const WORDS: usize = 64;

const STEP: &str = "
    layout(local_size_x = 64) in;
    layout(buffer_reference, scalar) buffer Words { uint at[]; };
    layout(push_constant, scalar) uniform Push { Words from; Words to; uint number; };
    void main() {
        uint i = gl_GlobalInvocationID.x;
        to.at[i] = 3 * from.at[(i + 1) % 64] + number;
    }";

#[repr(C)]
#[derive(Clone, Copy, bytemuck::NoUninit)]
struct Push {
    addresses: [u64; 2],
    number: u32,
    tail: u32,
}

/// Creates the pipeline of a step.
pub(crate) fn step_pipeline(ctx: &Context) -> Result<Holder<ComputePipelineHandle>> {
    let (stage, source) = (ShaderStage::Compute, ShaderSource::Glsl(STEP));
    let module = ctx.create_shader_module(&ShaderModuleDesc {
        stage,
        source,
        debug_name: "step.comp",
        ..Default::default()
    })?;
    let module = Some(*module);
    ctx.create_compute_pipeline(&ComputePipelineDesc { module, debug_name: "step", ..Default::default() })
}

/// Creates a buffer of words, `first` and the numbers after it.
pub(crate) fn words_buffer(ctx: &Context, first: u32) -> Result<Holder<BufferHandle>> {
    let words: Vec<u32> = (first..first + WORDS as u32).collect();
    let data = Some(bytemuck::cast_slice(&words));
    ctx.create_buffer(&BufferDesc { data, debug_name: "words", ..Default::default() })
}

/// Records `to[i] = 3 * from[i + 1] + number`.
pub(crate) fn record_step(
    ctx: &Context,
    cmd: &mut CommandBuffer,
    pipeline: ComputePipelineHandle,
    [from, to]: [BufferHandle; 2],
    number: u32,
) -> Result<()> {
    let addresses = [ctx.buffer_address(from)?, ctx.buffer_address(to)?];
    cmd.bind_compute_pipeline(pipeline)?;
    cmd.push_constants(&Push { addresses, number, tail: 0 })?;
    cmd.dispatch([1, 1, 1], &Dependencies { buffers: &[to], read_buffers: &[from], ..Default::default() })
}

/// Returns the bytes of a buffer of words, after all submissions.
pub(crate) fn read_words(ctx: &Context, buffer: BufferHandle) -> Result<Vec<u8>> {
    let mut bytes = vec![0; 4 * WORDS];
    ctx.download_buffer(buffer, 0, &mut bytes)?;
    Ok(bytes)
}
