//! Render passes: draws with constants, and draws that read a texture each.

use lvk::{
    ColorAttachment, Context, Format, Holder, RenderPassDesc, RenderPipelineDesc, RenderPipelineHandle,
    ShaderStage, TextureDesc, TextureHandle, TextureRegion, TextureUsage, Topology,
};

use super::module;
use crate::peers::peer::{Failure, RowRun, Sample};
use crate::peers::workload::{Workload, texel};

const VERTEX: &str = "
    layout(push_constant) uniform Push { uvec4 words[4]; };
    void main() { gl_Position = vec4(float(words[0].x) + 1.0); }";
const FRAGMENT: &str = "
    layout(push_constant) uniform Push { uvec4 words[4]; };
    layout(location = 0) out vec4 color;
    void main() { color = vec4(words[0]); }";

const CELL_VERTEX: &str = "
    layout(push_constant) uniform Push { uint number; uint side; uint texture; };
    void main() {
        uvec2 corner = uvec2(gl_VertexIndex & 1, gl_VertexIndex >> 1);
        uvec2 cell = uvec2(number % (side / 2), number / (side / 2));
        gl_Position = vec4(vec2(2 * (cell + corner)) / float(side) * 2.0 - 1.0, 0.0, 1.0);
    }";
const CELL_FRAGMENT: &str = "
    layout(push_constant) uniform Push { uint number; uint side; uint index; };
    layout(location = 0) out vec4 color;
    void main() { color = texelFetch(kTextures2D[index], ivec2(0), 0); }";

/// Draws with 64 bytes of constants each.
pub(super) struct Draws {
    ctx: Context,
    target: Holder<TextureHandle>,
    pipeline: Holder<RenderPipelineHandle>,
    count: u32,
}

impl Draws {
    pub(super) fn new(ctx: Context, count: u32) -> Result<Self, Failure> {
        let pipeline = pipeline(&ctx, VERTEX, FRAGMENT, Topology::Triangles)?;
        Ok(Self { target: target(&ctx, 16)?, pipeline, count, ctx })
    }
}

impl RowRun for Draws {
    fn sample(&mut self) -> Result<Sample, Failure> {
        let submit = || {
            let mut cmd = self.ctx.acquire_command_buffer()?;
            let color = [ColorAttachment::clear(*self.target, [0.0; 4])];
            let mut pass =
                cmd.begin_rendering(&RenderPassDesc { color: &color, ..RenderPassDesc::default() })?;
            pass.bind_render_pipeline(*self.pipeline)?;
            let mut push = [1_u32; 16];
            for number in 0..self.count {
                push[0] = number;
                pass.push_constants(&push)?;
                pass.draw(0..3, 0..1)?;
            }
            drop(pass);
            Ok(self.ctx.submit(cmd)?)
        };
        Sample::take(submit, |submission| Ok(self.ctx.wait(submission)?))
    }
}

/// Draws that read a texture each.
pub(super) struct Textured {
    ctx: Context,
    target: Holder<TextureHandle>,
    pipeline: Holder<RenderPipelineHandle>,
    textures: Vec<Holder<TextureHandle>>,
    side: u32,
}

impl Textured {
    pub(super) fn new(ctx: Context, work: &Workload) -> Result<Self, Failure> {
        let texture = |number| {
            let data = [texel(number); 16];
            ctx.create_texture(&TextureDesc {
                format: Format::Rgba8Unorm,
                extent: [4, 4],
                usage: TextureUsage::SAMPLED,
                data: Some(data.as_flattened()),
                ..TextureDesc::default()
            })
        };
        let textures = (0..work.textures).map(texture).collect::<lvk::Result<_>>()?;
        let pipeline = pipeline(&ctx, CELL_VERTEX, CELL_FRAGMENT, Topology::TriangleStrip)?;
        ctx.wait(ctx.flush()?)?;
        let side = work.textured_side();
        Ok(Self { target: target(&ctx, side)?, pipeline, textures, side, ctx })
    }
}

impl RowRun for Textured {
    fn sample(&mut self) -> Result<Sample, Failure> {
        let submit = || {
            let mut cmd = self.ctx.acquire_command_buffer()?;
            let color = [ColorAttachment::clear(*self.target, [0.0; 4])];
            let mut pass =
                cmd.begin_rendering(&RenderPassDesc { color: &color, ..RenderPassDesc::default() })?;
            pass.bind_render_pipeline(*self.pipeline)?;
            for (number, texture) in (0_u32..).zip(&self.textures) {
                pass.push_constants(&[number, self.side, texture.index()])?;
                pass.draw(0..4, 0..1)?;
            }
            drop(pass);
            Ok(self.ctx.submit(cmd)?)
        };
        Sample::take(submit, |submission| Ok(self.ctx.wait(submission)?))
    }

    fn result(&mut self) -> Result<Option<f64>, Failure> {
        let bytes = self.ctx.download_texture(*self.target, &TextureRegion::default())?;
        Ok(Some(bytes.iter().map(|byte| f64::from(*byte)).sum()))
    }
}

fn target(ctx: &Context, side: u32) -> lvk::Result<Holder<TextureHandle>> {
    let (format, usage) = (Format::Rgba8Unorm, TextureUsage::TARGET);
    ctx.create_texture(&TextureDesc { format, extent: [side; 2], usage, ..TextureDesc::default() })
}

fn pipeline(
    ctx: &Context,
    vertex: &str,
    fragment: &str,
    topology: Topology,
) -> lvk::Result<Holder<RenderPipelineHandle>> {
    let vertex = module(ctx, ShaderStage::Vertex, vertex)?;
    let fragment = module(ctx, ShaderStage::Fragment, fragment)?;
    ctx.create_render_pipeline(&RenderPipelineDesc {
        vertex: Some(*vertex),
        fragment: Some(*fragment),
        topology,
        color: &[Format::Rgba8Unorm.into()],
        ..RenderPipelineDesc::default()
    })
}
