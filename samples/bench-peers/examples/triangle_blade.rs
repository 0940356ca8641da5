//! Draws a triangle with `blade-graphics` and writes `triangle.ppm`.
use blade_graphics as gpu;

const SHADER: &str = "
    struct Corner { @builtin(position) place: vec4f, @location(0) shade: vec3f };
    @vertex fn corner(@builtin(vertex_index) index: u32) -> Corner {
        var corners = array(vec2f(0.0, 0.8), vec2f(0.8, -0.8), vec2f(-0.8, -0.8));
        let shade = vec3f(vec3u(index) == vec3u(0u, 1u, 2u));
        return Corner(vec4f(corners[index], 0.0, 1.0), shade);
    }
    @fragment fn fill(corner: Corner) -> @location(0) vec4f { return vec4f(corner.shade, 1.0); }";
const SIDE: u32 = 256;
const FORMAT: gpu::TextureFormat = gpu::TextureFormat::Rgba8Unorm;

type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

fn create_pipeline(context: &gpu::Context) -> Result<gpu::RenderPipeline> {
    let shader = context.try_create_shader(gpu::ShaderDesc { source: SHADER, naga_module: None })?;
    Ok(context.create_render_pipeline(gpu::RenderPipelineDesc {
        name: "triangle",
        data_layouts: &[],
        vertex: shader.at("corner"),
        vertex_fetches: &[],
        primitive: Default::default(),
        depth_stencil: None,
        fragment: Some(shader.at("fill")),
        color_targets: &[FORMAT.into()],
        multisample_state: Default::default(),
    }))
}

/// Returns the pixels, four bytes each.
pub(crate) fn draw() -> Result<Vec<u8>> {
    // SAFETY: no other code uses the context's device.
    let context = unsafe { gpu::Context::init(Default::default()) }?;
    let mut pipeline = create_pipeline(&context)?;
    let size = gpu::Extent { width: SIDE, height: SIDE, depth: 1 };
    let target = context.create_texture(gpu::TextureDesc {
        name: "target",
        format: FORMAT,
        size,
        array_layer_count: 1,
        mip_level_count: 1,
        sample_count: 1,
        dimension: gpu::TextureDimension::D2,
        usage: gpu::TextureUsage::TARGET | gpu::TextureUsage::COPY,
        external: None,
    });
    let view_desc = gpu::TextureViewDesc {
        name: "target",
        format: FORMAT,
        dimension: gpu::ViewDimension::D2,
        subresources: &Default::default(),
    };
    let view = context.create_texture_view(target, view_desc);
    let bytes = 4 * SIDE as usize * SIDE as usize;
    let buffer_desc = gpu::BufferDesc { name: "readback", size: bytes as u64, memory: gpu::Memory::Shared };
    let readback = context.create_buffer(buffer_desc);

    let encoder_desc = gpu::CommandEncoderDesc { name: "main", buffer_count: 1, manual_barriers: false };
    let mut encoder = context.create_command_encoder(encoder_desc);
    encoder.start();
    encoder.init_texture(target);
    let color = gpu::RenderTarget {
        view,
        init_op: gpu::InitOp::Clear(gpu::TextureColor::OpaqueBlack),
        finish_op: gpu::FinishOp::Store,
    };
    let targets = gpu::RenderTargetSet { colors: &[color], depth_stencil: None };
    let mut pass = encoder.render("triangle", targets);
    pass.with(&pipeline).draw(0, 3, 0, 1);
    drop(pass);
    encoder.transfer("readback").copy_texture_to_buffer(target.into(), readback.into(), 4 * SIDE, size);
    let point = context.submit(&mut encoder);
    context.wait_for(&point, !0)?;
    // SAFETY: the buffer is mapped and has as many bytes, and the GPU is done.
    let pixels = unsafe { std::slice::from_raw_parts(readback.data(), bytes) }.to_vec();
    context.destroy_command_encoder(&mut encoder);
    context.destroy_buffer(readback);
    context.destroy_texture_view(view);
    context.destroy_texture(target);
    context.destroy_render_pipeline(&mut pipeline);
    Ok(pixels)
}

pub(crate) fn main() -> Result<()> {
    let rgb: Vec<_> = draw()?.chunks(4).flat_map(|texel| &texel[..3]).copied().collect();
    let header = format!("P6 {SIDE} {SIDE} 255\n");
    Ok(std::fs::write("triangle.ppm", [header.as_bytes(), &rgb].concat())?)
}
