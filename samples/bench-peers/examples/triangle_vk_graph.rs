//! Draws a triangle with `vk-graph` and writes `triangle.ppm`.
use vk_graph::Graph;
use vk_graph::cmd::{LoadOp, StoreOp};
use vk_graph::driver::ash::{util::read_spv, vk};
use vk_graph::driver::buffer::Buffer;
use vk_graph::driver::device::{Device, DeviceInfo};
use vk_graph::driver::graphics::{GraphicsPipeline, GraphicsPipelineInfo};
use vk_graph::driver::image::{Image, ImageInfo};
use vk_graph::driver::shader::Shader;
use vk_graph::pool::hash::HashPool;

const SIDE: u32 = 256;

type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

fn create_pipeline(device: &Device) -> Result<GraphicsPipeline> {
    let words = |bytes: &'static [u8]| read_spv(&mut std::io::Cursor::new(bytes));
    let shaders = [
        Shader::new_vertex(words(include_bytes!("triangle.vert.spv"))?.as_slice()),
        Shader::new_fragment(words(include_bytes!("triangle.frag.spv"))?.as_slice()),
    ];
    let info = GraphicsPipelineInfo { cull_mode: vk::CullModeFlags::NONE, ..Default::default() };
    Ok(GraphicsPipeline::create(device, info, shaders)?)
}

/// Returns the pixels, four bytes each.
pub(crate) fn draw() -> Result<Vec<u8>> {
    let device = Device::create(DeviceInfo::default())?;
    let pipeline = create_pipeline(&device)?;
    let usage = vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::TRANSFER_SRC;
    let info = ImageInfo::image_2d(SIDE, SIDE, vk::Format::R8G8B8A8_UNORM, usage);
    let zeros = vec![0; 4 * SIDE as usize * SIDE as usize];
    let usage = vk::BufferUsageFlags::TRANSFER_DST;
    let mut graph = Graph::default();
    let target = graph.bind_resource(Image::create(&device, info)?);
    let readback = graph.bind_resource(Buffer::create_from_slice(&device, usage, &zeros)?);
    graph
        .begin_cmd()
        .bind_pipeline(&pipeline)
        .color_attachment_image(0, target, LoadOp::CLEAR_BLACK_ALPHA_ONE, StoreOp::Store)
        .record_cmd(|cmd| {
            cmd.draw(3, 1, 0, 0);
        });
    graph.copy_image_to_buffer(target, readback);
    let readback = graph.resource(readback).clone();
    graph.finalize().queue_submit(&mut HashPool::new(&device), 0, 0)?.wait()?;
    Ok(readback.mapped_slice().to_vec())
}

pub(crate) fn main() -> Result<()> {
    let rgb: Vec<_> = draw()?.chunks(4).flat_map(|texel| &texel[..3]).copied().collect();
    let header = format!("P6 {SIDE} {SIDE} 255\n");
    Ok(std::fs::write("triangle.ppm", [header.as_bytes(), &rgb].concat())?)
}
