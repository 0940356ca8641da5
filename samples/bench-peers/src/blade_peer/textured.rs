//! Draws that read a texture each.

use blade_graphics as gpu;
use lvk_bench::peers::{Failure, RowRun, Sample, Workload, texel};

use super::bindings::Cell;
use super::device::Gpu;
use super::draws::{clear, render_pipeline};
use crate::wgsl;

const INPUTS: &str = "
    struct Push { number: u32, side: u32 };
    var<uniform> push: Push;
    var picture: texture_2d<f32>;";

/// Draws that read a texture each.
pub(super) struct Textured {
    gpu: Gpu,
    target: (gpu::Texture, gpu::TextureView),
    pipeline: gpu::RenderPipeline,
    textures: Vec<gpu::TextureView>,
    side: u32,
}

impl Textured {
    pub(super) fn new(mut gpu: Gpu, work: &Workload) -> Result<Self, Failure> {
        let layout = <Cell as gpu::ShaderData>::layout();
        let text = [INPUTS, wgsl::TEXTURED].concat();
        let pipeline = render_pipeline(&gpu, &layout, &text, gpu::PrimitiveTopology::TriangleStrip)?;
        let side = work.textured_side();
        let usage = gpu::TextureUsage::RESOURCE | gpu::TextureUsage::COPY;
        let textures: Vec<_> = (0..work.textures).map(|_| gpu.texture(4, usage)).collect();
        let target = gpu.texture(side, gpu::TextureUsage::TARGET | gpu::TextureUsage::COPY);
        let texels: Vec<u8> = (0..work.textures).flat_map(|number| [texel(number); 16]).flatten().collect();
        let staging = gpu.buffer_with(&texels, gpu::Memory::Upload)?;
        gpu.encoder.start();
        gpu.encoder.init_texture(target.0);
        textures.iter().for_each(|(texture, _)| gpu.encoder.init_texture(*texture));
        let mut pass = gpu.encoder.transfer("textures");
        for (number, (texture, _)) in (0_u64..).zip(&textures) {
            let size = gpu::Extent { width: 4, height: 4, depth: 1 };
            pass.copy_buffer_to_texture(staging.at(64 * number), 16, (*texture).into(), size);
        }
        drop(pass);
        let point = gpu.submit();
        gpu.wait(&point)?;
        let textures = textures.into_iter().map(|(_, view)| view).collect();
        Ok(Self { gpu, target, pipeline, textures, side })
    }
}

impl RowRun for Textured {
    fn sample(&mut self) -> Result<Sample, Failure> {
        let gpu = &mut self.gpu;
        let submit = || {
            gpu.encoder.start();
            let colors = [clear(self.target.1)];
            let targets = gpu::RenderTargetSet { colors: &colors, depth_stencil: None };
            let mut pass = gpu.encoder.render("textures", targets);
            let mut pipeline = pass.with(&self.pipeline);
            for (number, picture) in (0_u32..).zip(&self.textures) {
                pipeline.bind(0, &Cell { push: [number, self.side], picture: *picture });
                pipeline.draw(0, 4, 0, 1);
            }
            drop(pass);
            let point = gpu.submit();
            Ok((gpu, point))
        };
        Sample::take(submit, |(gpu, point)| gpu.wait(&point))
    }

    fn result(&mut self) -> Result<Option<f64>, Failure> {
        let bytes = 4 * u64::from(self.side) * u64::from(self.side);
        let copy = self.gpu.buffer(bytes, gpu::Memory::Shared);
        self.gpu.encoder.start();
        let size = gpu::Extent { width: self.side, height: self.side, depth: 1 };
        let mut pass = self.gpu.encoder.transfer("read");
        pass.copy_texture_to_buffer(self.target.0.into(), copy.into(), 4 * self.side, size);
        drop(pass);
        let point = self.gpu.submit();
        self.gpu.wait(&point)?;
        Ok(Some(self.gpu.read_shared(copy, bytes)?.iter().map(|byte| f64::from(*byte)).sum()))
    }
}
