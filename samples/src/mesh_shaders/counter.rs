//! The number of meshlets that a frame drew, read without waiting.

use lvk::{BufferDesc, BufferHandle, BufferUsage, CommandBuffer, Context, Holder, Readback};

/// A number that shaders count up (`Counter` in `shaders/mesh_shaders/frame.glsl`).
pub(super) struct Counter {
    pub(super) buffer: Holder<BufferHandle>,
    latest: Option<u32>,
    /// The pending readback.
    coming: Option<Readback>,
}

impl Counter {
    const BYTES: u64 = size_of::<u32>() as u64;

    pub(super) fn new(ctx: &Context) -> lvk::Result<Self> {
        let buffer = ctx.create_buffer(&BufferDesc {
            data: Some(&[0; Self::BYTES as usize]),
            usage: BufferUsage::STORAGE,
            debug_name: "drawn meshlets",
            ..BufferDesc::default()
        })?;
        Ok(Self { buffer, latest: None, coming: None })
    }

    /// The latest number that is known.
    pub(super) fn latest(&self) -> Option<u32> {
        self.latest
    }

    /// Asks for the number of the frame before, and records that this one begins at 0.
    pub(super) fn begin(&mut self, ctx: &Context, cmd: &mut CommandBuffer) -> lvk::Result<()> {
        if let Some(coming) = &self.coming
            && coming.is_ready()?
        {
            self.wait()?;
        }
        if self.coming.is_none() {
            self.request_count(ctx)?;
        }
        cmd.fill_buffer(*self.buffer, 0, Self::BYTES, 0)
    }

    /// Reads the number of the last frame, which the GPU has finished.
    pub(super) fn read(&mut self, ctx: &Context) -> lvk::Result<()> {
        self.request_count(ctx)?;
        self.wait()
    }

    fn request_count(&mut self, ctx: &Context) -> lvk::Result<()> {
        self.coming = Some(ctx.read_buffer_later(*self.buffer, 0..Self::BYTES)?);
        Ok(())
    }

    fn wait(&mut self) -> lvk::Result<()> {
        let Some(coming) = self.coming.take() else { return Ok(()) };
        self.latest = coming.wait()?.try_into().ok().map(u32::from_le_bytes);
        Ok(())
    }
}
