//! Draws that read a texture each, from one array of descriptors.

use std::sync::Arc;

use vk_graph::Graph;
use vk_graph::cmd::{LoadOp, StoreOp};
use vk_graph::driver::ash::vk;
use vk_graph::driver::descriptor_set::{DescriptorSet, DescriptorSetInfo, DescriptorSetUpdateInfo};
use vk_graph::driver::graphics::{GraphicsPipeline, GraphicsPipelineInfo};
use vk_graph::driver::image::Image;
use vk_graph::driver::sync::AccessType;

use lvk_bench::peers::{
    Failure, GlslStage, RowRun, Sample, TEXTURES_FRAGMENT, TEXTURES_VERTEX, Workload, texel,
};

use super::device::{Gpu, shader, wait};

/// Draws that read a texture each. The graph is told of every texture, as it tracks them.
pub(super) struct Textured {
    gpu: Gpu,
    target: Arc<Image>,
    pipeline: GraphicsPipeline,
    set: DescriptorSet,
    textures: Vec<Arc<Image>>,
    side: u32,
}

impl Textured {
    pub(super) fn new(mut gpu: Gpu, work: &Workload) -> Result<Self, Failure> {
        let shaders =
            [shader(GlslStage::Vertex, TEXTURES_VERTEX)?, shader(GlslStage::Fragment, TEXTURES_FRAGMENT)?];
        let info = GraphicsPipelineInfo {
            cull_mode: vk::CullModeFlags::NONE,
            topology: vk::PrimitiveTopology::TRIANGLE_STRIP,
            bindless_descriptor_count: work.textures,
            ..Default::default()
        };
        let pipeline = GraphicsPipeline::create(&gpu.device, info, shaders)?;
        let textures = textures(&mut gpu, work.textures)?;
        let update = |(number, image)| DescriptorSetUpdateInfo::image((0, [number]), image);
        let updates = (0_u32..).zip(&textures).map(update);
        let set =
            DescriptorSet::alloc_and_update(&pipeline, DescriptorSetInfo::builder().set(0).build(), updates)?;
        let side = work.textured_side();
        let usage = vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::TRANSFER_SRC;
        Ok(Self { target: gpu.image(side, usage)?, pipeline, set, textures, side, gpu })
    }
}

impl RowRun for Textured {
    fn sample(&mut self) -> Result<Sample, Failure> {
        let submit = || {
            let mut graph = Graph::default();
            let target = graph.bind_resource(&self.target);
            let mut cmd = graph.begin_cmd().bind_pipeline(&self.pipeline).bind_descriptor_set(&self.set);
            for texture in &self.textures {
                let node = cmd.bind_resource(texture);
                let access = AccessType::FragmentShaderReadSampledImageOrUniformTexelBuffer;
                cmd.set_resource_access(node, access);
            }
            let (count, side) = (self.textures.len() as u32, self.side);
            cmd.color_attachment_image(0, target, LoadOp::CLEAR_BLACK_ALPHA_ZERO, StoreOp::Store).record_cmd(
                move |cmd| {
                    for number in 0..count {
                        cmd.push_constants(0, bytemuck::bytes_of(&[number, side])).draw(4, 1, 0, 0);
                    }
                },
            );
            self.gpu.submit(graph)
        };
        Sample::take(submit, wait)
    }

    fn result(&mut self) -> Result<Option<f64>, Failure> {
        let bytes = 4 * self.side as usize * self.side as usize;
        let copy = self.gpu.buffer_with(&vec![0; bytes], vk::BufferUsageFlags::TRANSFER_DST)?;
        let mut graph = Graph::default();
        let (from, to) = (graph.bind_resource(&self.target), graph.bind_resource(&copy));
        graph.copy_image_to_buffer(from, to);
        self.gpu.run(graph)?;
        Ok(Some(copy.mapped_slice()[..bytes].iter().map(|byte| f64::from(*byte)).sum()))
    }
}

/// Creates all textures with their texels.
fn textures(gpu: &mut Gpu, count: u32) -> Result<Vec<Arc<Image>>, Failure> {
    let mut graph = Graph::default();
    let mut made = Vec::new();
    for number in 0..count {
        let image = gpu.image(4, vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_DST)?;
        let texels = [texel(number); 16];
        let staging = gpu.buffer_with(texels.as_flattened(), vk::BufferUsageFlags::TRANSFER_SRC)?;
        let (from, to) = (graph.bind_resource(staging), graph.bind_resource(&image));
        graph.copy_buffer_to_image(from, to);
        made.push(image);
    }
    gpu.run(graph)?;
    Ok(made)
}
