//! Draws a triangle with `wgpu` and writes `triangle.ppm`.
use std::future::Future;
use std::task::{Context, Poll, Waker};

const SHADER: &str = "
    struct Corner { @builtin(position) place: vec4f, @location(0) shade: vec3f };
    @vertex fn corner(@builtin(vertex_index) index: u32) -> Corner {
        var corners = array(vec2f(0.0, 0.8), vec2f(0.8, -0.8), vec2f(-0.8, -0.8));
        let shade = vec3f(vec3u(index) == vec3u(0u, 1u, 2u));
        return Corner(vec4f(corners[index], 0.0, 1.0), shade);
    }
    @fragment fn fill(corner: Corner) -> @location(0) vec4f { return vec4f(corner.shade, 1.0); }";
const SIDE: u32 = 256;
const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

/// Returns the output of a future that is ready at once.
fn ready<T>(future: impl Future<Output = T>) -> Result<T> {
    match std::pin::pin!(future).poll(&mut Context::from_waker(Waker::noop())) {
        Poll::Ready(answer) => Ok(answer),
        Poll::Pending => Err("not ready".into()),
    }
}

fn create_pipeline(device: &wgpu::Device) -> wgpu::RenderPipeline {
    let source = wgpu::ShaderSource::Wgsl(SHADER.into());
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor { label: None, source });
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: None,
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("corner"),
            compilation_options: Default::default(),
            buffers: &[],
        },
        primitive: Default::default(),
        depth_stencil: None,
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("fill"),
            compilation_options: Default::default(),
            targets: &[Some(FORMAT.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}

/// Returns the pixels, four bytes each.
pub(crate) fn draw() -> Result<Vec<u8>> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
        backends: wgpu::Backends::VULKAN,
        ..wgpu::InstanceDescriptor::new_without_display_handle()
    });
    let adapter = ready(instance.request_adapter(&Default::default()))??;
    let (device, queue) = ready(adapter.request_device(&Default::default()))??;
    let pipeline = create_pipeline(&device);
    let target = device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width: SIDE, height: SIDE, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: FORMAT,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    let readback = device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: u64::from(SIDE * SIDE * 4),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let mut encoder = device.create_command_encoder(&Default::default());
    let view = target.create_view(&Default::default());
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: &view,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations {
                load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                store: wgpu::StoreOp::Store,
            },
        })],
        ..Default::default()
    });
    pass.set_pipeline(&pipeline);
    pass.draw(0..3, 0..1);
    drop(pass);
    let layout = wgpu::TexelCopyBufferLayout { bytes_per_row: Some(4 * SIDE), ..Default::default() };
    let copy = wgpu::TexelCopyBufferInfo { buffer: &readback, layout };
    encoder.copy_texture_to_buffer(target.as_image_copy(), copy, target.size());
    queue.submit([encoder.finish()]);
    readback.map_async(wgpu::MapMode::Read, .., |_| ());
    device.poll(wgpu::PollType::wait_indefinitely())?;
    Ok(readback.get_mapped_range(..)?.to_vec())
}

pub(crate) fn main() -> Result<()> {
    let rgb: Vec<_> = draw()?.chunks(4).flat_map(|texel| &texel[..3]).copied().collect();
    let header = format!("P6 {SIDE} {SIDE} 255\n");
    Ok(std::fs::write("triangle.ppm", [header.as_bytes(), &rgb].concat())?)
}
