//! Draws a triangle with `lvk` and writes `triangle.ppm`.
use lvk::*;

const VERTEX: &str = r"
    layout(location = 0) out vec3 shade;
    void main() {
        const vec2 corners[3] = { vec2(0.0, -0.8), vec2(0.8, 0.8), vec2(-0.8, 0.8) };
        gl_Position = vec4(corners[gl_VertexIndex], 0, 1);
        shade = vec3(equal(ivec3(gl_VertexIndex), ivec3(0, 1, 2)));
    }";
const FRAGMENT: &str = r"
    layout(location = 0) in vec3 shade;
    layout(location = 0) out vec4 color;
    void main() { color = vec4(shade, 1); }";
const SIDE: u32 = 256;

/// Returns the pixels, four bytes each.
pub(crate) fn draw() -> std::result::Result<Vec<u8>, Box<dyn std::error::Error>> {
    let ctx = Context::new(&ContextDesc::default())?;
    let module = |stage, text| {
        let source = ShaderSource::Glsl(text);
        ctx.create_shader_module(&ShaderModuleDesc { stage, source, ..Default::default() })
    };
    let vertex = module(ShaderStage::Vertex, VERTEX)?;
    let fragment = module(ShaderStage::Fragment, FRAGMENT)?;
    let pipeline = ctx.create_render_pipeline(&RenderPipelineDesc {
        vertex: Some(*vertex),
        fragment: Some(*fragment),
        color: &[Format::Rgba8Unorm.into()],
        ..Default::default()
    })?;
    let (extent, usage) = ([SIDE; 2], TextureUsage::TARGET);
    let target = ctx.create_texture(&TextureDesc { extent, usage, ..Default::default() })?;
    let mut cmd = ctx.acquire_command_buffer()?;
    let mut pass = cmd.begin_rendering(&RenderPassDesc {
        color: &[ColorAttachment::clear(*target, [0.0, 0.0, 0.0, 1.0])],
        ..Default::default()
    })?;
    pass.bind_render_pipeline(*pipeline)?;
    pass.draw(0..3, 0..1)?;
    drop(pass);
    ctx.submit(cmd)?;
    Ok(ctx.download_texture(*target, &TextureRegion::default())?)
}

pub(crate) fn main() -> std::result::Result<(), Box<dyn std::error::Error>> {
    let rgb: Vec<_> = draw()?.chunks(4).flat_map(|texel| &texel[..3]).copied().collect();
    let header = format!("P6 {SIDE} {SIDE} 255\n");
    Ok(std::fs::write("triangle.ppm", [header.as_bytes(), &rgb].concat())?)
}
