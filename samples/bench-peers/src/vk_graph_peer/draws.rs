//! Draws with constants.

use std::sync::Arc;

use vk_graph::Graph;
use vk_graph::cmd::{LoadOp, StoreOp};
use vk_graph::driver::ash::vk;
use vk_graph::driver::graphics::{GraphicsPipeline, GraphicsPipelineInfo};
use vk_graph::driver::image::Image;

use lvk_bench::peers::{Failure, GlslStage, PUSH_FRAGMENT, PUSH_VERTEX, RowRun, Sample};

use super::device::{Gpu, shader, wait};

/// Draws with 64 bytes of constants each.
pub(super) struct Draws {
    gpu: Gpu,
    target: Arc<Image>,
    pipeline: GraphicsPipeline,
    count: u32,
}

impl Draws {
    pub(super) fn new(gpu: Gpu, count: u32) -> Result<Self, Failure> {
        let shaders = [shader(GlslStage::Vertex, PUSH_VERTEX)?, shader(GlslStage::Fragment, PUSH_FRAGMENT)?];
        let info = GraphicsPipelineInfo { cull_mode: vk::CullModeFlags::NONE, ..Default::default() };
        let pipeline = GraphicsPipeline::create(&gpu.device, info, shaders)?;
        Ok(Self { target: gpu.image(16, vk::ImageUsageFlags::COLOR_ATTACHMENT)?, pipeline, count, gpu })
    }
}

impl RowRun for Draws {
    fn sample(&mut self) -> Result<Sample, Failure> {
        let submit = || {
            let mut graph = Graph::default();
            let (target, count) = (graph.bind_resource(&self.target), self.count);
            graph
                .begin_cmd()
                .bind_pipeline(&self.pipeline)
                .color_attachment_image(0, target, LoadOp::CLEAR_BLACK_ALPHA_ZERO, StoreOp::Store)
                .record_cmd(move |cmd| {
                    let mut push = [1_u32; 16];
                    for number in 0..count {
                        push[0] = number;
                        cmd.push_constants(0, bytemuck::bytes_of(&push)).draw(3, 1, 0, 0);
                    }
                });
            self.gpu.submit(graph)
        };
        Sample::take(submit, wait)
    }
}
