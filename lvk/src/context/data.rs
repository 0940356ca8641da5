//! Moves data between host and GPU.

use std::sync::Arc;

use super::Context;
use crate::command::transfer::BufferCopy;
use crate::error::Result;
use crate::gpu::memory::MemoryKind;
use crate::handle::{BufferHandle, TextureHandle};
use crate::resource::Buffer;
use crate::resource::buffer::{BufferDesc, BufferUsage, InternalUsage};
use crate::resource::region::TextureRegion;
use crate::shared::Garbage;

impl Context {
    /// The address by which shaders reach a buffer (`vkGetBufferDeviceAddress`).
    pub fn buffer_address(&self, buffer: BufferHandle) -> Result<u64> {
        Ok(self.shared().store.buffers.get(buffer)?.address)
    }

    /// Writes bytes into a buffer.
    ///
    /// Mapped memory is written at once: the caller sees to it that the GPU does not use these bytes meanwhile, for
    /// instance with one buffer for each frame in flight. Device memory is written before the next submission, after
    /// everything submitted so far.
    pub fn upload_buffer(&self, buffer: BufferHandle, offset: u64, bytes: &[u8]) -> Result<()> {
        let buffers = &self.shared().store.buffers;
        let target = buffers.get(buffer)?;
        target.check_range(offset, bytes.len() as u64)?;
        if target.write(offset, bytes) {
            return Ok(());
        }
        // Looked up again while a command buffer is open, which keeps what another thread destroys.
        self.before_next_submission(|cmd| cmd.upload_buffer(&buffers.get(buffer)?, offset, bytes))
    }

    /// Reads bytes of a buffer in any memory, after everything submitted so far. Waits for the GPU.
    pub fn download_buffer(&self, buffer: BufferHandle, offset: u64, bytes: &mut [u8]) -> Result<()> {
        let buffer = self.shared().store.buffers.get(buffer)?;
        buffer.check_range(offset, bytes.len() as u64)?;
        if buffer.mapped().is_some() {
            self.flush()?;
            self.wait_submitted()?;
            buffer.read(offset, bytes);
            return Ok(());
        }
        let size = bytes.len() as u64;
        self.read_back(size, bytes, |cmd, target| {
            cmd.copy_buffer_objects(
                &buffer,
                target,
                &[BufferCopy { source_offset: offset, target_offset: 0, size }],
            )
        })
    }

    /// Writes texels, tightly packed, row by row and layer by layer, before the next submission.
    pub fn upload_texture(&self, texture: TextureHandle, region: &TextureRegion, bytes: &[u8]) -> Result<()> {
        let textures = &self.shared().store.textures;
        self.before_next_submission(|cmd| cmd.upload_texture(&textures.get(texture)?, region, bytes))
    }

    /// Reads texels, tightly packed, row by row and layer by layer, after everything submitted so far. Waits for the GPU.
    pub fn download_texture(&self, texture: TextureHandle, region: &TextureRegion) -> Result<Vec<u8>> {
        let texture = self.shared().store.textures.get(texture)?;
        let size = texture.resolve_region(region)?.bytes();
        let mut bytes = vec![0; size as usize];
        self.read_back(size, &mut bytes, |cmd, target| {
            cmd.copy_texture_objects_to_buffer(&texture, region, target, 0)
        })?;
        Ok(bytes)
    }

    /// Runs a copy into a readback buffer, waits, and reads it.
    pub(super) fn read_back(
        &self,
        size: u64,
        bytes: &mut [u8],
        record: impl FnOnce(&mut crate::CommandBuffer, &Arc<Buffer>) -> Result<()>,
    ) -> Result<()> {
        if size == 0 {
            return Ok(());
        }
        let desc = BufferDesc {
            size_bytes: size,
            usage: BufferUsage::empty(),
            memory: MemoryKind::Readback,
            data: None,
            debug_name: "readback",
        };
        let target = Arc::new(Buffer::new(&self.shared().gpu, &desc, InternalUsage::NONE)?);
        let mut cmd = self.acquire_command_buffer()?;
        record(&mut cmd, &target)?;
        // Before the submission: should that fail half-way, the GPU may yet write the buffer.
        self.shared().retire(Garbage::Buffer(Arc::clone(&target)));
        self.wait(self.submit(cmd)?)?;
        target.read(0, bytes);
        Ok(())
    }
}
