//! Creation and destruction of buffers and textures.

use blade_graphics as gpu;
use lvk_bench::peers::{Failure, RowRun, Sample};

use super::device::Gpu;

pub(super) struct Buffers {
    pub(super) gpu: Gpu,
    pub(super) count: u32,
}

impl RowRun for Buffers {
    fn sample(&mut self) -> Result<Sample, Failure> {
        let submit = || {
            let create = |_| self.gpu.buffer(256, gpu::Memory::Device);
            let made: Vec<_> = (0..self.count).map(create).collect();
            made.into_iter().for_each(|buffer| self.gpu.context.destroy_buffer(buffer));
            Ok(())
        };
        Sample::take(submit, |()| Ok(()))
    }
}

pub(super) struct Textures {
    pub(super) gpu: Gpu,
    pub(super) count: u32,
}

impl RowRun for Textures {
    fn sample(&mut self) -> Result<Sample, Failure> {
        let submit = || {
            let usage = gpu::TextureUsage::COPY | gpu::TextureUsage::RESOURCE;
            let made: Vec<_> = (0..self.count).map(|_| self.gpu.texture(4, usage)).collect();
            for (texture, view) in made {
                self.gpu.context.destroy_texture_view(view);
                self.gpu.context.destroy_texture(texture);
            }
            Ok(())
        };
        Sample::take(submit, |()| Ok(()))
    }
}
