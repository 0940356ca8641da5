//! Pipelines of each kind that another thread creates, and a library of ray tracing shaders.

use lvk::{
    BufferDesc, ColorAttachment, ComputePipelineDesc, Context, ContextDesc, Dependencies, Format, Holder,
    RayTracingLibraryDesc, RayTracingPipelineDesc, RayTracingPipelineRequest, RenderPassDesc,
    RenderPipelineDesc, ShaderModuleDesc, ShaderModuleHandle, ShaderSource, ShaderStage, TextureDesc,
    TextureRegion, TextureUsage,
};

use crate::{Failure, context};

const WRITE: &str = "
    layout(local_size_x = 1) in;
    layout(buffer_reference, scalar) writeonly buffer Words { uint at[]; };
    layout(push_constant, scalar) uniform Push { Words words; };
    void main() { words.at[0] = 3; }";

const VERTEX: &str = "void main() {
    gl_Position = vec4(4.0 * (gl_VertexIndex & 1) - 1.0, 2.0 * (gl_VertexIndex & 2) - 1.0, 0.0, 1.0);
}";

const FRAGMENT: &str = "
    layout(location = 0) out vec4 color;
    void main() { color = vec4(1.0, 0.0, 0.0, 1.0); }";

const RAY_GEN: &str = "
    layout(buffer_reference, scalar) writeonly buffer Words { uint at[]; };
    layout(push_constant, scalar) uniform Push { Words words; };
    layout(location = 0) callableDataEXT uint value;
    void main() {
        value = 5;
        executeCallableEXT(0, 0);
        words.at[1] = value;
    }";

const CALLABLE: &str = "
    layout(location = 0) callableDataInEXT uint value;
    void main() { value = 7 * value; }";

/// Creates a pipeline of each kind in the background and uses it. Returns what their shaders write.
pub(crate) fn in_background() -> Result<Vec<u8>, Failure> {
    let ray_tracing_pipeline = RayTracingPipelineRequest::HardwareIfPresent;
    let ctx = context(ContextDesc { ray_tracing_pipeline, ..Default::default() })?;
    let words =
        ctx.create_buffer(&BufferDesc { size_bytes: 8, debug_name: "words", ..Default::default() })?;
    let writes = Dependencies { buffers: &[*words], ..Default::default() };
    let module = module(&ctx, ShaderStage::Compute, WRITE, "write.comp")?;
    let (module, debug_name) = (Some(*module), "write");
    let compute = ctx.create_compute_pipeline_in_background(&ComputePipelineDesc {
        module,
        debug_name,
        ..Default::default()
    })?;
    let compute = compute.wait()?;
    let mut cmd = ctx.acquire_command_buffer()?;
    cmd.bind_compute_pipeline(*compute)?;
    cmd.push_constants(&words.address()?)?;
    cmd.dispatch([1, 1, 1], &writes)?;
    ctx.submit(cmd)?;
    let mut bytes = drawn(&ctx)?;
    trace(&ctx, words.address()?, &writes)?;
    let mut written = vec![0; 8];
    ctx.download_buffer(*words, 0, &mut written)?;
    bytes.extend(written);
    ctx.wait_idle()?;
    Ok(bytes)
}

/// Draws a triangle over a texture. Returns its texels.
fn drawn(ctx: &Context) -> lvk::Result<Vec<u8>> {
    let vertex = module(ctx, ShaderStage::Vertex, VERTEX, "cover.vert")?;
    let fragment = module(ctx, ShaderStage::Fragment, FRAGMENT, "cover.frag")?;
    let pending = ctx.create_render_pipeline_in_background(&RenderPipelineDesc {
        vertex: Some(*vertex),
        fragment: Some(*fragment),
        color: &[Format::Rgba8Unorm.into()],
        fast_link: true,
        debug_name: "cover",
        ..Default::default()
    })?;
    let render = pending.wait()?;
    let texture = ctx.create_texture(&TextureDesc {
        format: Format::Rgba8Unorm,
        extent: [4, 4],
        usage: TextureUsage::TARGET,
        debug_name: "target",
        ..Default::default()
    })?;
    let mut cmd = ctx.acquire_command_buffer()?;
    let target = [ColorAttachment::clear(*texture, [0.0; 4])];
    let mut pass = cmd.begin_rendering(&RenderPassDesc { color: &target, ..Default::default() })?;
    pass.bind_render_pipeline(*render)?;
    pass.draw(0..3, 0..1)?;
    drop(pass);
    ctx.submit(cmd)?;
    ctx.download_texture(*texture, &TextureRegion::default())
}

/// Calls a shader of a library from a ray generation shader, which writes the second word.
fn trace(ctx: &Context, words: u64, writes: &Dependencies<'_>) -> lvk::Result<()> {
    let ray_gen = module(ctx, ShaderStage::RayGen, RAY_GEN, "call.rgen")?;
    let callable = module(ctx, ShaderStage::Callable, CALLABLE, "seven.rcall")?;
    let library = ctx.create_ray_tracing_library(&RayTracingLibraryDesc {
        callable: &[*callable],
        debug_name: "callables",
        ..Default::default()
    })?;
    let pending = ctx.create_ray_tracing_pipeline_in_background(&RayTracingPipelineDesc {
        ray_gen: &[*ray_gen],
        libraries: &[*library],
        debug_name: "call",
        ..Default::default()
    })?;
    let pipeline = pending.wait()?;
    let mut cmd = ctx.acquire_command_buffer()?;
    cmd.bind_ray_tracing_pipeline(*pipeline)?;
    cmd.push_constants(&words)?;
    cmd.trace_rays([1, 1, 1], writes)?;
    ctx.submit(cmd)?;
    Ok(())
}

fn module(
    ctx: &Context,
    stage: ShaderStage,
    text: &str,
    debug_name: &str,
) -> lvk::Result<Holder<ShaderModuleHandle>> {
    let source = ShaderSource::Glsl(text);
    ctx.create_shader_module(&ShaderModuleDesc { stage, source, debug_name, ..Default::default() })
}
