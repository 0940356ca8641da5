//! Draws two triangles that cross each other, from vertices and indices with a depth test, and writes `draw.ppm`.
use lvk::*;

const VERTEX: &str = r"
    layout(location = 0) in vec3 position;
    layout(location = 1) in vec3 color;
    layout(location = 0) out vec3 shade;
    layout(push_constant) uniform Push { float scale; };
    void main() {
        gl_Position = vec4(position.xy * scale, position.z, 1);
        shade = color;
    }";
const FRAGMENT: &str = r"
    layout(location = 0) in vec3 shade;
    layout(location = 0) out vec4 color;
    void main() { color = vec4(shade, 1); }";
const SIZE: [u32; 2] = [512, 512];

/// A vertex as the pipeline reads it.
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct Vertex {
    position: [f32; 3],
    color: [f32; 3],
}

/// Red is nearer on the left side, green on the right one.
const VERTICES: [Vertex; 6] = {
    let (red, green) = ([1.0, 0.2, 0.1], [0.1, 0.9, 0.3]);
    [
        Vertex { position: [-0.9, -0.6, 0.1], color: red },
        Vertex { position: [-0.9, 0.6, 0.1], color: red },
        Vertex { position: [0.9, 0.0, 0.9], color: red },
        Vertex { position: [0.9, -0.6, 0.1], color: green },
        Vertex { position: [0.9, 0.6, 0.1], color: green },
        Vertex { position: [-0.9, 0.0, 0.9], color: green },
    ]
};
const INDICES: [u16; 6] = [0, 1, 2, 3, 4, 5];

fn create_pipeline(ctx: &Context) -> Result<Holder<RenderPipelineHandle>> {
    let module = |stage, text| {
        let source = ShaderSource::Glsl(text);
        ctx.create_shader_module(&ShaderModuleDesc {
            stage,
            source,
            debug_name: "draw",
            ..Default::default()
        })
    };
    let vertex = module(ShaderStage::Vertex, VERTEX)?;
    let fragment = module(ShaderStage::Fragment, FRAGMENT)?;
    let attribute =
        |location, offset| VertexAttribute { location, binding: 0, format: VertexFormat::F32x3, offset };
    ctx.create_render_pipeline(&RenderPipelineDesc {
        vertex: Some(*vertex),
        fragment: Some(*fragment),
        vertex_bindings: &[VertexBinding { stride: size_of::<Vertex>() as u32, per_instance: false }],
        vertex_attributes: &[attribute(0, 0), attribute(1, 12)],
        color: &[Format::Rgba8Unorm.into()],
        depth: Some(DepthTest { format: Format::D32Float, compare: CompareOp::Less, write: true }),
        debug_name: "draw",
        ..Default::default()
    })
}

pub(crate) fn main() -> Result<(), Box<dyn std::error::Error>> {
    let ctx = Context::new(&ContextDesc::default())?;
    let pipeline = create_pipeline(&ctx)?;
    let buffer = |usage, data, debug_name| {
        ctx.create_buffer(&BufferDesc { usage, data: Some(data), debug_name, ..Default::default() })
    };
    let vertices = buffer(BufferUsage::VERTEX, bytemuck::bytes_of(&VERTICES), "vertices")?;
    let indices = buffer(BufferUsage::INDEX, bytemuck::bytes_of(&INDICES), "indices")?;
    let target = |format, debug_name| {
        let (extent, usage) = (SIZE, TextureUsage::TARGET);
        ctx.create_texture(&TextureDesc { format, extent, usage, debug_name, ..Default::default() })
    };
    let color = target(Format::Rgba8Unorm, "color")?;
    let depth = target(Format::D32Float, "depth")?;

    let mut cmd = ctx.acquire_command_buffer()?;
    let mut pass = cmd.begin_rendering(&RenderPassDesc {
        color: &[ColorAttachment::clear(*color, [0.0, 0.0, 0.0, 1.0])],
        depth: Some(DepthAttachment::clear(*depth, 1.0)),
        ..Default::default()
    })?;
    pass.bind_render_pipeline(*pipeline)?;
    pass.bind_vertex_buffer(0, *vertices, 0)?;
    pass.bind_index_buffer(*indices, 0, IndexFormat::U16)?;
    pass.push_constants(&0.9_f32)?;
    pass.draw_indexed(0..6, 0, 0..1)?;
    drop(pass);
    ctx.submit(cmd)?;

    let rgba = ctx.download_texture(*color, &TextureRegion::default())?;
    let rgb: Vec<_> = rgba.chunks(4).flat_map(|texel| &texel[..3]).copied().collect();
    Ok(std::fs::write("draw.ppm", [b"P6 512 512 255\n", &rgb[..]].concat())?)
}
