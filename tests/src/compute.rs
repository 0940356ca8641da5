//! Small compute shaders: compiles them, runs them and reads their results.
#![expect(clippy::expect_used, reason = "a test whose set-up fails has failed")]

use lvk::{
    BufferDesc, BufferHandle, CommandBuffer, ComputePipelineDesc, ComputePipelineHandle, Context,
    Dependencies, Holder, ShaderModuleDesc, ShaderModuleHandle, ShaderSource, ShaderStage,
};

/// Creates a module of GLSL text that must compile.
pub fn module(ctx: &Context, stage: ShaderStage, text: &str) -> Holder<ShaderModuleHandle> {
    let source = ShaderSource::Glsl(text);
    let desc = ShaderModuleDesc { stage, source, debug_name: "test shader", ..Default::default() };
    ctx.create_shader_module(&desc).expect("the shader of a test compiles")
}

/// Creates a compute pipeline of GLSL text.
pub fn compute_pipeline(ctx: &Context, text: &str) -> Holder<ComputePipelineHandle> {
    let module = module(ctx, ShaderStage::Compute, text);
    let desc = ComputePipelineDesc { module: Some(*module), ..Default::default() };
    ctx.create_compute_pipeline(&desc).expect("the pipeline of a test can be made")
}

/// Creates a pipeline that keeps the GPU busy: each invocation iterates a random number generator, and runs the GLSL
/// statement `store` with the result, `sum`, and the words at the address in its push constants, `words.at`.
pub fn busy_pipeline(ctx: &Context, iterations: u32, store: &str) -> Holder<ComputePipelineHandle> {
    let text = format!(
        "layout(local_size_x = 64) in;
         layout(buffer_reference, scalar) buffer Words {{ uint at[]; }};
         layout(push_constant, scalar) uniform Push {{ Words words; }};
         void main() {{
             uint sum = gl_GlobalInvocationID.x;
             for (uint i = 0; i < {iterations}; ++i) sum = sum * 1664525 + 1013904223;
             {store}
         }}"
    );
    compute_pipeline(ctx, &text)
}

/// Creates a buffer in device memory that holds `words`.
pub fn words_buffer(ctx: &Context, words: &[u32]) -> Holder<BufferHandle> {
    let desc =
        BufferDesc { data: Some(bytemuck::cast_slice(words)), debug_name: "words", ..Default::default() };
    ctx.create_buffer(&desc).expect("a small buffer can be made")
}

/// Returns the first `count` words of a buffer, after all earlier submissions.
pub fn read_words(ctx: &Context, buffer: BufferHandle, count: usize) -> Vec<u32> {
    let mut words = vec![0_u32; count];
    ctx.download_buffer(buffer, 0, bytemuck::cast_slice_mut(&mut words)).expect("the buffer can be read");
    words
}

/// Runs one workgroup of a pipeline whose push constants are the address of `words`, and returns the words.
pub fn run_on_words(ctx: &Context, pipeline: ComputePipelineHandle, words: &[u32]) -> Vec<u32> {
    let buffer = words_buffer(ctx, words);
    let mut cmd = ctx.acquire_command_buffer().expect("a command buffer can be had");
    let address = buffer.address().expect("the buffer is alive");
    cmd.bind_compute_pipeline(pipeline).expect("the pipeline is alive");
    cmd.push_constants(&address).expect("the push constants fit");
    let uses = Dependencies { buffers: &[*buffer], ..Default::default() };
    cmd.dispatch([1, 1, 1], &uses).expect("the dispatch is taken");
    ctx.submit(cmd).expect("the commands are taken");
    read_words(ctx, *buffer, words.len())
}

/// A pipeline that writes one `vec4` for each invocation `i` to the address in its push constants.
///
/// `expression` may use `i` and the words `a`, `b` and `c`.
pub struct Evaluator {
    pipeline: Holder<ComputePipelineHandle>,
}

/// Push constants of an [`Evaluator`].
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Push {
    result: u64,
    words: [u32; 3],
    pad: u32,
}

impl Evaluator {
    /// Compiles the expression.
    pub fn new(ctx: &Context, expression: &str) -> Self {
        let text = format!(
            "layout(local_size_x = 1) in;
             layout(buffer_reference, scalar) writeonly buffer Result {{ vec4 values[]; }};
             layout(push_constant, scalar) uniform Push {{ Result result; uint a; uint b; uint c; }};
             void main() {{
                 uint i = gl_GlobalInvocationID.x;
                 result.values[i] = {expression};
             }}"
        );
        Self { pipeline: compute_pipeline(ctx, &text) }
    }

    /// Records the evaluation for `count` invocations into `result`, 16 bytes each.
    pub fn record(
        &self,
        ctx: &Context,
        cmd: &mut CommandBuffer,
        words: [u32; 3],
        (result, count): (BufferHandle, u32),
        dependencies: &Dependencies<'_>,
    ) {
        let address = ctx.buffer_address(result).expect("the result buffer is alive");
        cmd.bind_compute_pipeline(*self.pipeline).expect("the pipeline is alive");
        cmd.push_constants(&Push { result: address, words, pad: 0 }).expect("the push constants fit");
        let mut buffers = dependencies.buffers.to_vec();
        buffers.push(result);
        let dependencies = Dependencies { buffers: &buffers, ..*dependencies };
        cmd.dispatch([count, 1, 1], &dependencies).expect("the dispatch is valid");
    }

    /// Runs `count` invocations in a submission of their own and returns their results.
    pub fn run(
        &self,
        ctx: &Context,
        words: [u32; 3],
        count: u32,
        dependencies: &Dependencies<'_>,
    ) -> Vec<[f32; 4]> {
        let result = vec4_buffer(ctx, count);
        let mut cmd = ctx.acquire_command_buffer().expect("a command buffer can be made");
        self.record(ctx, &mut cmd, words, (*result, count), dependencies);
        ctx.submit(cmd).expect("the submission succeeds");
        read_vec4(ctx, *result, count)
    }
}

/// Creates a buffer for the results of `count` invocations of an [`Evaluator`].
pub fn vec4_buffer(ctx: &Context, count: u32) -> Holder<BufferHandle> {
    let desc = BufferDesc { size_bytes: 16 * u64::from(count), debug_name: "result", ..Default::default() };
    ctx.create_buffer(&desc).expect("a small buffer can be made")
}

/// Returns the results of an [`Evaluator`].
pub fn read_vec4(ctx: &Context, result: BufferHandle, count: u32) -> Vec<[f32; 4]> {
    let mut values = vec![[0.0; 4]; count as usize];
    ctx.download_buffer(result, 0, bytemuck::cast_slice_mut(&mut values)).expect("the result can be read");
    values
}
