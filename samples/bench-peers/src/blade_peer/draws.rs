//! Draws with constants.

use blade_graphics as gpu;
use lvk_bench::peers::{Failure, RowRun, Sample};

use super::bindings::Constants;
use super::device::Gpu;
use crate::wgsl;

const INPUTS: &str = "struct Push { words: array<vec4u, 4> }; var<uniform> push: Push;";

/// Draws with 64 bytes of constants each.
pub(super) struct Draws {
    gpu: Gpu,
    target: gpu::TextureView,
    pipeline: gpu::RenderPipeline,
    count: u32,
}

impl Draws {
    pub(super) fn new(mut gpu: Gpu, count: u32) -> Result<Self, Failure> {
        let layout = <Constants as gpu::ShaderData>::layout();
        let text = [INPUTS, wgsl::PUSH].concat();
        let pipeline = render_pipeline(&gpu, &layout, &text, gpu::PrimitiveTopology::TriangleList)?;
        let (texture, target) = gpu.texture(16, gpu::TextureUsage::TARGET);
        gpu.encoder.start();
        gpu.encoder.init_texture(texture);
        let point = gpu.submit();
        gpu.wait(&point)?;
        Ok(Self { gpu, target, pipeline, count })
    }
}

impl RowRun for Draws {
    fn sample(&mut self) -> Result<Sample, Failure> {
        let gpu = &mut self.gpu;
        let submit = || {
            gpu.encoder.start();
            let colors = [clear(self.target)];
            let targets = gpu::RenderTargetSet { colors: &colors, depth_stencil: None };
            let mut pass = gpu.encoder.render("draws", targets);
            let mut pipeline = pass.with(&self.pipeline);
            let mut push = [1_u32; 16];
            for number in 0..self.count {
                push[0] = number;
                pipeline.bind(0, &Constants { push });
                pipeline.draw(0, 3, 0, 1);
            }
            drop(pass);
            let point = gpu.submit();
            Ok((gpu, point))
        };
        Sample::take(submit, |(gpu, point)| gpu.wait(&point))
    }
}

/// Returns a target that is cleared.
pub(super) fn clear(view: gpu::TextureView) -> gpu::RenderTarget {
    gpu::RenderTarget {
        view,
        init_op: gpu::InitOp::Clear(gpu::TextureColor::TransparentBlack),
        finish_op: gpu::FinishOp::Store,
    }
}

/// Creates a pipeline from the entry points `corner` and `shade`.
pub(super) fn render_pipeline(
    gpu: &Gpu,
    layout: &gpu::ShaderDataLayout,
    text: &str,
    topology: gpu::PrimitiveTopology,
) -> Result<gpu::RenderPipeline, Failure> {
    let shader = gpu.shader(text)?;
    Ok(gpu.context.create_render_pipeline(gpu::RenderPipelineDesc {
        name: "peer",
        data_layouts: &[layout],
        vertex: shader.at("corner"),
        vertex_fetches: &[],
        primitive: gpu::PrimitiveState { topology, ..Default::default() },
        depth_stencil: None,
        fragment: Some(shader.at("shade")),
        color_targets: &[gpu::TextureFormat::Rgba8Unorm.into()],
        multisample_state: Default::default(),
    }))
}
