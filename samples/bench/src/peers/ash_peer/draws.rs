//! Draws with constants.

use lvk::ash::vk;

use super::commands::{Commands, layout_barrier};
use super::device::Device;
use super::memory::Image;
use super::pipelines::{Layout, Pipeline};
use crate::peers::glsl::{PUSH_FRAGMENT, PUSH_VERTEX};
use crate::peers::peer::{Failure, RowRun, Sample};

const SIDE: u32 = 16;

/// Draws with 64 bytes of constants each.
pub(super) struct Draws {
    device: Device,
    commands: Commands,
    target: Image,
    pipeline: Pipeline,
    count: u32,
}

impl Draws {
    pub(super) fn new(device: Device, count: u32) -> Result<Self, Failure> {
        let layout = Layout::new(&device, 64, &[])?;
        let topology = vk::PrimitiveTopology::TRIANGLE_LIST;
        let pipeline = Pipeline::graphics(&device, layout, [PUSH_VERTEX, PUSH_FRAGMENT], topology)?;
        let target = Image::new(&device, SIDE, vk::ImageUsageFlags::COLOR_ATTACHMENT)?;
        Ok(Self { commands: Commands::new(&device)?, target, pipeline, count, device })
    }
}

impl RowRun for Draws {
    fn sample(&mut self) -> Result<Sample, Failure> {
        let (device, commands) = (&self.device, &mut self.commands);
        let submit = || {
            let list = commands.begin(device)?;
            begin_rendering(device, list, &self.target, SIDE);
            self.pipeline.bind(device, list, vk::PipelineBindPoint::GRAPHICS, &[]);
            let mut push = [1_u32; 16];
            let (layout, stages) = (self.pipeline.layout, vk::ShaderStageFlags::ALL);
            for number in 0..self.count {
                push[0] = number;
                // SAFETY: a render pass is being recorded, and the layout has 64 bytes of push constants.
                unsafe {
                    device.raw.cmd_push_constants(list, layout, stages, 0, bytemuck::bytes_of(&push));
                    device.raw.cmd_draw(list, 3, 1, 0, 0);
                }
            }
            // SAFETY: the pass was begun above.
            unsafe { device.raw.cmd_end_rendering(list) };
            commands.submit(device)?;
            Ok(commands)
        };
        Sample::take(submit, |commands| commands.wait(device))
    }
}

/// Records the begin of a render pass that clears the target, with viewport and scissor.
pub(super) fn begin_rendering(device: &Device, list: vk::CommandBuffer, target: &Image, side: u32) {
    let layout = vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL;
    layout_barrier(device, list, target.raw, vk::ImageLayout::UNDEFINED, layout);
    let color = [vk::RenderingAttachmentInfo::default()
        .image_view(target.view)
        .image_layout(layout)
        .load_op(vk::AttachmentLoadOp::CLEAR)
        .store_op(vk::AttachmentStoreOp::STORE)];
    let area = vk::Rect2D { extent: vk::Extent2D { width: side, height: side }, ..vk::Rect2D::default() };
    let pass = vk::RenderingInfo::default().render_area(area).layer_count(1).color_attachments(&color);
    let [width, height] = [side as f32; 2];
    let viewport = vk::Viewport { width, height, max_depth: 1.0, ..vk::Viewport::default() };
    // SAFETY: the target is alive and in the layout.
    unsafe {
        device.raw.cmd_begin_rendering(list, &pass);
        device.raw.cmd_set_viewport(list, 0, &[viewport]);
        device.raw.cmd_set_scissor(list, 0, &[area]);
    }
}
