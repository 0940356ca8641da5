//! Draws with constants.

use lvk_bench::peers::{Failure, RowRun, Sample};

use super::device::{FORMAT, Gpu};
use crate::wgsl;

const INPUTS: &str = "struct Push { words: array<vec4u, 4> }; var<immediate> push: Push;";

/// Draws with 64 bytes of constants each.
pub(super) struct Draws {
    gpu: Gpu,
    target: wgpu::TextureView,
    pipeline: wgpu::RenderPipeline,
    count: u32,
}

impl Draws {
    pub(super) fn new(gpu: Gpu, count: u32) -> Self {
        let shader = gpu.shader(&[INPUTS, wgsl::PUSH].concat());
        let layout = gpu.layout(&[], 64);
        let pipeline = render_pipeline(&gpu, &layout, &shader, wgpu::PrimitiveTopology::TriangleList);
        let target = gpu.texture(16, wgpu::TextureUsages::RENDER_ATTACHMENT);
        Self { target: target.create_view(&Default::default()), pipeline, count, gpu }
    }
}

impl RowRun for Draws {
    fn sample(&mut self) -> Result<Sample, Failure> {
        let submit = || {
            let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
            let mut pass = begin_pass(&mut encoder, &self.target);
            pass.set_pipeline(&self.pipeline);
            let mut push = [1_u32; 16];
            for number in 0..self.count {
                push[0] = number;
                pass.set_immediates(0, bytemuck::bytes_of(&push));
                pass.draw(0..3, 0..1);
            }
            drop(pass);
            Ok(self.gpu.queue.submit([encoder.finish()]))
        };
        Sample::take(submit, |submission| self.gpu.wait(submission))
    }
}

/// Begins a render pass that clears the target.
pub(super) fn begin_pass<'a>(
    encoder: &'a mut wgpu::CommandEncoder,
    target: &wgpu::TextureView,
) -> wgpu::RenderPass<'a> {
    let load = wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT);
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: target,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations { load, store: wgpu::StoreOp::Store },
        })],
        ..Default::default()
    })
}

/// Creates a pipeline from the entry points `corner` and `shade`.
pub(super) fn render_pipeline(
    gpu: &Gpu,
    layout: &wgpu::PipelineLayout,
    shader: &wgpu::ShaderModule,
    topology: wgpu::PrimitiveTopology,
) -> wgpu::RenderPipeline {
    gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: None,
        layout: Some(layout),
        vertex: wgpu::VertexState {
            module: shader,
            entry_point: Some("corner"),
            compilation_options: Default::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState { topology, ..Default::default() },
        depth_stencil: None,
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState {
            module: shader,
            entry_point: Some("shade"),
            compilation_options: Default::default(),
            targets: &[Some(FORMAT.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}
