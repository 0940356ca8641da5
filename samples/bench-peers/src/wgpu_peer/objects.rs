//! Creation and destruction of buffers and textures.

use lvk_bench::peers::{Failure, RowRun, Sample};

use super::device::Gpu;

pub(super) struct Buffers {
    pub(super) gpu: Gpu,
    pub(super) count: u32,
}

impl RowRun for Buffers {
    fn sample(&mut self) -> Result<Sample, Failure> {
        create_and_destroy(&self.gpu, self.count, || self.gpu.storage(256))
    }
}

pub(super) struct Textures {
    pub(super) gpu: Gpu,
    pub(super) count: u32,
}

impl RowRun for Textures {
    fn sample(&mut self) -> Result<Sample, Failure> {
        use wgpu::TextureUsages as Usage;
        let usage = Usage::TEXTURE_BINDING | Usage::COPY_SRC | Usage::COPY_DST;
        create_and_destroy(&self.gpu, self.count, || {
            let texture = self.gpu.texture(4, usage);
            let view = texture.create_view(&Default::default());
            (texture, view)
        })
    }
}

/// Creates all objects, drops them, and waits for their destruction.
fn create_and_destroy<T>(gpu: &Gpu, count: u32, create: impl Fn() -> T) -> Result<Sample, Failure> {
    let submit = || {
        drop((0..count).map(|_| create()).collect::<Vec<_>>());
        Ok(())
    };
    let wait = |()| {
        gpu.device.poll(wgpu::PollType::wait_indefinitely())?;
        Ok(())
    };
    Sample::take(submit, wait)
}
