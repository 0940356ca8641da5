//! Draws that read a texture each, from one array of descriptors.

use gpu_allocator::MemoryLocation;
use lvk::ash::vk;

use super::commands::{Commands, layout_barrier};
use super::device::Device;
use super::draws::begin_rendering;
use super::memory::{Buffer, Image};
use super::pipelines::{Layout, Pipeline};
use crate::peers::glsl::{TEXTURES_FRAGMENT, TEXTURES_VERTEX};
use crate::peers::peer::{Failure, RowRun, Sample};
use crate::peers::workload::{Workload, texel};

/// Draws that read a texture each.
pub(super) struct Textured {
    device: Device,
    commands: Commands,
    target: Image,
    pipeline: Pipeline,
    count: u32,
    side: u32,
    _textures: Vec<Image>,
}

impl Textured {
    pub(super) fn new(device: Device, work: &Workload) -> Result<Self, Failure> {
        let (count, side) = (work.textures, work.textured_side());
        let layout = Layout::new(&device, 8, &[(vk::DescriptorType::SAMPLED_IMAGE, count)])?;
        let topology = vk::PrimitiveTopology::TRIANGLE_STRIP;
        let pipeline = Pipeline::graphics(&device, layout, [TEXTURES_VERTEX, TEXTURES_FRAGMENT], topology)?;
        let mut commands = Commands::new(&device)?;
        let textures = (0..count)
            .map(|number| texture(&device, &mut commands, number))
            .collect::<Result<Vec<_>, _>>()?;
        write_textures(&device, pipeline.set.ok_or("no descriptor set")?, &textures);
        let usage = vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::TRANSFER_SRC;
        let target = Image::new(&device, side, usage)?;
        Ok(Self { device, commands, target, pipeline, count, side, _textures: textures })
    }
}

impl RowRun for Textured {
    fn sample(&mut self) -> Result<Sample, Failure> {
        let (device, commands) = (&self.device, &mut self.commands);
        let submit = || {
            let list = commands.begin(device)?;
            begin_rendering(device, list, &self.target, self.side);
            self.pipeline.bind(device, list, vk::PipelineBindPoint::GRAPHICS, &[]);
            let (layout, stages) = (self.pipeline.layout, vk::ShaderStageFlags::ALL);
            for number in 0..self.count {
                let push = [number, self.side];
                // SAFETY: a render pass is being recorded, and the layout has 8 bytes of push constants.
                unsafe {
                    device.raw.cmd_push_constants(list, layout, stages, 0, bytemuck::bytes_of(&push));
                    device.raw.cmd_draw(list, 4, 1, 0, 0);
                }
            }
            // SAFETY: the pass was begun above.
            unsafe { device.raw.cmd_end_rendering(list) };
            commands.submit(device)?;
            Ok(commands)
        };
        Sample::take(submit, |commands| commands.wait(device))
    }

    fn result(&mut self) -> Result<Option<f64>, Failure> {
        let (device, commands) = (&self.device, &mut self.commands);
        let bytes = 4 * self.side as usize * self.side as usize;
        let usage = vk::BufferUsageFlags::TRANSFER_DST;
        let mut copy = Buffer::new(device, bytes as u64, usage, MemoryLocation::GpuToCpu)?;
        let list = commands.begin(device)?;
        let [from, to] = [vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL, vk::ImageLayout::TRANSFER_SRC_OPTIMAL];
        layout_barrier(device, list, self.target.raw, from, to);
        let region = [copy_region(self.side)];
        // SAFETY: the buffer holds all texels, and the image is in the layout.
        unsafe { device.raw.cmd_copy_image_to_buffer(list, self.target.raw, to, copy.raw, &region) };
        commands.submit(device)?;
        commands.wait(device)?;
        Ok(Some(copy.mapped()?[..bytes].iter().map(|byte| f64::from(*byte)).sum()))
    }
}

/// Creates a texture with its texels.
fn texture(device: &Device, commands: &mut Commands, number: u32) -> Result<Image, Failure> {
    let image = Image::new(device, 4, vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_DST)?;
    let texels = [texel(number); 16];
    let staging = Buffer::with_bytes(device, texels.as_flattened(), vk::BufferUsageFlags::TRANSFER_SRC)?;
    let list = commands.begin(device)?;
    let [none, write, read] = [
        vk::ImageLayout::UNDEFINED,
        vk::ImageLayout::TRANSFER_DST_OPTIMAL,
        vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL,
    ];
    layout_barrier(device, list, image.raw, none, write);
    // SAFETY: the buffer holds all texels, and the image is in the layout.
    unsafe { device.raw.cmd_copy_buffer_to_image(list, staging.raw, image.raw, write, &[copy_region(4)]) };
    layout_barrier(device, list, image.raw, write, read);
    commands.submit(device)?;
    commands.wait(device)?;
    staging.destroy(device)?;
    Ok(image)
}

fn copy_region(side: u32) -> vk::BufferImageCopy {
    let layers = vk::ImageSubresourceLayers {
        aspect_mask: vk::ImageAspectFlags::COLOR,
        layer_count: 1,
        ..vk::ImageSubresourceLayers::default()
    };
    let extent = vk::Extent3D { width: side, height: side, depth: 1 };
    vk::BufferImageCopy::default().image_subresource(layers).image_extent(extent)
}

fn write_textures(device: &Device, set: vk::DescriptorSet, textures: &[Image]) {
    let layout = vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL;
    let info = |image: &Image| vk::DescriptorImageInfo::default().image_view(image.view).image_layout(layout);
    let infos: Vec<_> = textures.iter().map(info).collect();
    let write = [vk::WriteDescriptorSet::default()
        .dst_set(set)
        .descriptor_type(vk::DescriptorType::SAMPLED_IMAGE)
        .image_info(&infos)];
    // SAFETY: the set has as many descriptors, and no command uses it yet.
    unsafe { device.raw.update_descriptor_sets(&write, &[]) };
}
