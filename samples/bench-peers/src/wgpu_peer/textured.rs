//! Draws that read a texture each, by a bind group for each texture.

use lvk_bench::peers::{Failure, RowRun, Sample, Workload, texel};

use super::device::Gpu;
use super::draws::{begin_pass, render_pipeline};
use crate::wgsl;

const INPUTS: &str = "
    struct Push { number: u32, side: u32 };
    var<immediate> push: Push;
    @group(0) @binding(0) var picture: texture_2d<f32>;";

/// Draws that read a texture each.
pub(super) struct Textured {
    gpu: Gpu,
    target: wgpu::Texture,
    pipeline: wgpu::RenderPipeline,
    groups: Vec<wgpu::BindGroup>,
    side: u32,
}

impl Textured {
    pub(super) fn new(gpu: Gpu, work: &Workload) -> Result<Self, Failure> {
        let binding = wgpu::BindGroupLayoutEntry {
            binding: 0,
            visibility: wgpu::ShaderStages::FRAGMENT,
            ty: wgpu::BindingType::Texture {
                sample_type: wgpu::TextureSampleType::Float { filterable: false },
                view_dimension: wgpu::TextureViewDimension::D2,
                multisampled: false,
            },
            count: None,
        };
        let group_layout = gpu
            .device
            .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries: &[binding] });
        let layout = gpu.layout(&[Some(&group_layout)], 8);
        let shader = gpu.shader(&[INPUTS, wgsl::TEXTURED].concat());
        let pipeline = render_pipeline(&gpu, &layout, &shader, wgpu::PrimitiveTopology::TriangleStrip);
        let groups = (0..work.textures).map(|number| group(&gpu, &group_layout, number)).collect();
        let side = work.textured_side();
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC;
        let target = gpu.texture(side, usage);
        let submission = gpu.queue.submit([]);
        gpu.wait(submission)?;
        Ok(Self { gpu, target, pipeline, groups, side })
    }
}

impl RowRun for Textured {
    fn sample(&mut self) -> Result<Sample, Failure> {
        let submit = || {
            let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
            let view = self.target.create_view(&Default::default());
            let mut pass = begin_pass(&mut encoder, &view);
            pass.set_pipeline(&self.pipeline);
            for (number, group) in (0_u32..).zip(&self.groups) {
                pass.set_bind_group(0, group, &[]);
                pass.set_immediates(0, bytemuck::bytes_of(&[number, self.side]));
                pass.draw(0..4, 0..1);
            }
            drop(pass);
            Ok(self.gpu.queue.submit([encoder.finish()]))
        };
        Sample::take(submit, |submission| self.gpu.wait(submission))
    }

    fn result(&mut self) -> Result<Option<f64>, Failure> {
        // Rows of a copied texture begin at multiples of 256 bytes.
        let (row, used) = ((4 * self.side).next_multiple_of(256), 4 * self.side as usize);
        let bytes = self.gpu.read(u64::from(row * self.side), |encoder, buffer| {
            let layout = wgpu::TexelCopyBufferLayout { bytes_per_row: Some(row), ..Default::default() };
            let copy = wgpu::TexelCopyBufferInfo { buffer, layout };
            encoder.copy_texture_to_buffer(self.target.as_image_copy(), copy, self.target.size());
        })?;
        let texels = bytes.chunks(row as usize).flat_map(|row| &row[..used]);
        Ok(Some(texels.map(|byte| f64::from(*byte)).sum()))
    }
}

/// Creates the bind group of a texture with its texels.
fn group(gpu: &Gpu, layout: &wgpu::BindGroupLayout, number: u32) -> wgpu::BindGroup {
    let texture = gpu.texture(4, wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST);
    let texels = [texel(number); 16];
    let rows = wgpu::TexelCopyBufferLayout { bytes_per_row: Some(16), ..Default::default() };
    gpu.queue.write_texture(texture.as_image_copy(), texels.as_flattened(), rows, texture.size());
    let view = texture.create_view(&Default::default());
    gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout,
        entries: &[wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(&view) }],
    })
}
