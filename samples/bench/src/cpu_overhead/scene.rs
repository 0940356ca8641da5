//! A small render target with a render pipeline, and a storage image with a compute pipeline.

use lvk::{
    ColorAttachment, CommandBuffer, ComputePipelineDesc, ComputePipelineHandle, Context, Format, Holder,
    RenderPass, RenderPassDesc, RenderPipelineDesc, RenderPipelineHandle, ShaderModuleDesc,
    ShaderModuleHandle, ShaderSource, ShaderStage, TextureDesc, TextureHandle, TextureUsage,
};

/// Push constants of draws and dispatches.
pub(crate) type Push = [u32; 16];

const VERTEX: &str = "
    layout(push_constant) uniform Push { uint words[16]; };
    void main() { gl_Position = vec4(words[gl_VertexIndex]); }";
const FRAGMENT: &str = "
    layout(push_constant) uniform Push { uint words[16]; };
    layout(location = 0) out vec4 color;
    void main() { color = vec4(words[0]); }";
const COMPUTE: &str = "
    layout(local_size_x = 8, local_size_y = 8) in;
    layout(push_constant) uniform Push { uint words[16]; };
    void main() { imageStore(kImages2D[words[0]], ivec2(gl_LocalInvocationID.xy), vec4(1.0)); }";

/// The objects that draws and dispatches use.
pub(crate) struct Scene {
    pub(crate) target: Holder<TextureHandle>,
    pub(crate) image: Holder<TextureHandle>,
    pub(crate) draw: Holder<RenderPipelineHandle>,
    pub(crate) compute: Holder<ComputePipelineHandle>,
}

impl Scene {
    pub(crate) const SIDE: u32 = 16;

    pub(crate) fn new(ctx: &Context) -> lvk::Result<Self> {
        let texture = |usage| {
            let desc = TextureDesc {
                format: Format::Rgba8Unorm,
                extent: [Self::SIDE; 2],
                usage,
                debug_name: "core",
                ..TextureDesc::default()
            };
            ctx.create_texture(&desc)
        };
        let (vertex, fragment) =
            (module(ctx, ShaderStage::Vertex, VERTEX)?, module(ctx, ShaderStage::Fragment, FRAGMENT)?);
        let compute = module(ctx, ShaderStage::Compute, COMPUTE)?;
        let scene = Self {
            target: texture(TextureUsage::TARGET | TextureUsage::SAMPLED)?,
            image: texture(TextureUsage::STORAGE | TextureUsage::SAMPLED)?,
            draw: ctx.create_render_pipeline(&RenderPipelineDesc {
                vertex: Some(*vertex),
                fragment: Some(*fragment),
                color: &[Format::Rgba8Unorm.into()],
                ..RenderPipelineDesc::default()
            })?,
            compute: ctx.create_compute_pipeline(&ComputePipelineDesc {
                module: Some(*compute),
                ..ComputePipelineDesc::default()
            })?,
        };
        ctx.wait(ctx.flush()?)?;
        Ok(scene)
    }

    /// Begins a render pass on the target and binds the pipeline.
    pub(crate) fn pass<'a>(&self, cmd: &'a mut CommandBuffer) -> lvk::Result<RenderPass<'a>> {
        let color = [ColorAttachment::clear(*self.target, [0.0; 4])];
        let mut pass = cmd.begin_rendering(&RenderPassDesc { color: &color, ..RenderPassDesc::default() })?;
        pass.bind_render_pipeline(*self.draw)?;
        Ok(pass)
    }
}

fn module(ctx: &Context, stage: ShaderStage, text: &str) -> lvk::Result<Holder<ShaderModuleHandle>> {
    let source = ShaderSource::Glsl(text);
    ctx.create_shader_module(&ShaderModuleDesc { stage, source, ..ShaderModuleDesc::default() })
}
