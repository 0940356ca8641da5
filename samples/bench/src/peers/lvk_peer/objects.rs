//! Creation and destruction of buffers and textures.

use lvk::{BufferDesc, Context, Format, TextureDesc, TextureUsage};

use crate::peers::peer::{Failure, RowRun, Sample};

pub(super) struct Buffers {
    pub(super) ctx: Context,
    pub(super) count: u32,
}

impl RowRun for Buffers {
    fn sample(&mut self) -> Result<Sample, Failure> {
        let desc = BufferDesc { size_bytes: 256, ..BufferDesc::default() };
        create_and_destroy(&self.ctx, self.count, || self.ctx.create_buffer(&desc))
    }
}

pub(super) struct Textures {
    pub(super) ctx: Context,
    pub(super) count: u32,
}

impl RowRun for Textures {
    fn sample(&mut self) -> Result<Sample, Failure> {
        let (format, usage) = (Format::Rgba8Unorm, TextureUsage::SAMPLED);
        let desc = TextureDesc { format, extent: [4, 4], usage, ..TextureDesc::default() };
        create_and_destroy(&self.ctx, self.count, || self.ctx.create_texture(&desc))
    }
}

/// Creates all objects, destroys them, and waits for the deferred destruction.
fn create_and_destroy<T>(
    ctx: &Context,
    count: u32,
    create: impl Fn() -> lvk::Result<T>,
) -> Result<Sample, Failure> {
    let submit = || {
        let objects: lvk::Result<Vec<T>> = (0..count).map(|_| create()).collect();
        drop(objects?);
        Ok(ctx.flush()?)
    };
    Sample::take(submit, |submission| Ok(ctx.wait(submission)?))
}
