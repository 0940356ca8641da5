//! Data transfer between host and GPU.

use std::ptr::NonNull;
use std::sync::Arc;

use super::Context;
use super::readback::READBACK;
use crate::command::transfer::BufferCopy;
use crate::error::{Error, Result};
use crate::handle::{BufferHandle, TextureHandle};
use crate::resource::Buffer;
use crate::resource::region::TextureRegion;

impl Context {
    /// Returns the address of a buffer in shaders (`vkGetBufferDeviceAddress`).
    pub fn buffer_address(&self, buffer: BufferHandle) -> Result<u64> {
        Ok(self.device_state().store.buffers.get(buffer)?.address)
    }

    /// Returns the address of a byte of a buffer.
    ///
    /// # Errors
    /// [`InvalidUsage`](crate::Error::InvalidUsage) for an offset beyond the end of the buffer.
    pub fn buffer_address_at(&self, buffer: BufferHandle, offset: u64) -> Result<u64> {
        let buffer = self.device_state().store.buffers.get(buffer)?;
        buffer.check_range(offset, 1)?;
        Ok(buffer.address + offset)
    }

    /// Returns the mapped bytes of a buffer in [`HostVisible`](crate::MemoryKind::HostVisible) or
    /// [`Readback`](crate::MemoryKind::Readback) memory, for access in place.
    ///
    /// The pointer is valid until the buffer's handle is destroyed. The memory is coherent, so no flush or invalidation
    /// is needed. Host writes are visible to every command submitted afterwards. Writes of commands are visible once
    /// the caller has [waited](Self::wait) for their submission, if the commands named the buffer. The GPU may use the
    /// bytes at any time: the caller must synchronise the accesses, and must not hold a reference to the bytes while
    /// the GPU may write them.
    ///
    /// # Errors
    /// [`InvalidUsage`](crate::Error::InvalidUsage) for buffers in device memory.
    pub fn map_buffer(&self, buffer: BufferHandle) -> Result<NonNull<[u8]>> {
        let buffer = self.device_state().store.buffers.get(buffer)?;
        let message =
            "device memory is not mapped; create the buffer with MemoryKind::HostVisible or Readback";
        let start = buffer.mapped().ok_or_else(|| Error::usage(&buffer.name, message))?;
        Ok(NonNull::slice_from_raw_parts(start, buffer.size_bytes as usize))
    }

    /// Writes bytes into a buffer.
    ///
    /// Mapped memory is written at once. The caller must ensure that the GPU does not use these bytes meanwhile, for
    /// instance with one buffer for each frame in flight. Device memory is written before the next submission, after
    /// everything submitted so far.
    pub fn upload_buffer(&self, buffer: BufferHandle, offset: u64, bytes: &[u8]) -> Result<()> {
        let buffers = &self.device_state().store.buffers;
        let target = buffers.get(buffer)?;
        target.check_range(offset, bytes.len() as u64)?;
        if target.write(offset, bytes) {
            return Ok(());
        }
        self.upload_to_buffer(&target, offset, bytes)
    }

    /// Reads bytes of a buffer in any memory, after everything submitted so far. Waits for the GPU.
    pub fn download_buffer(&self, buffer: BufferHandle, offset: u64, bytes: &mut [u8]) -> Result<()> {
        let find = || self.device_state().store.buffers.get(buffer);
        let found = find()?;
        found.check_range(offset, bytes.len() as u64)?;
        if found.mapped().is_some() {
            self.flush()?;
            self.wait_submitted()?;
            found.read(offset, bytes);
            return Ok(());
        }
        let size = bytes.len() as u64;
        let copy = BufferCopy { source_offset: offset, target_offset: 0, size };
        self.read_back(size, bytes, |cmd, target| cmd.copy_buffer_objects(&find()?, target, &[copy]))
            .map_err(|error| error.with_owner(READBACK, &found.name))
    }

    /// Writes texels, tightly packed, row by row and layer by layer, before the next submission.
    pub fn upload_texture(&self, texture: TextureHandle, region: &TextureRegion, bytes: &[u8]) -> Result<()> {
        let texture = self.device_state().store.textures.get(texture)?;
        if texture.lent {
            let message = "images of windows cannot be uploaded to; copy into them with a command buffer";
            return Err(Error::usage(&texture.name, message));
        }
        self.upload_texture_object(&texture, region, bytes)
    }

    /// Reads texels, tightly packed, row by row and layer by layer, after everything submitted so far. Waits for the
    /// GPU.
    pub fn download_texture(&self, texture: TextureHandle, region: &TextureRegion) -> Result<Vec<u8>> {
        self.read_texture_later(texture, region)?.wait()
    }

    /// Records a copy into a readback buffer, waits, and reads the bytes. `record` must meet the conditions of
    /// [`read_later`](Self::read_later).
    pub(crate) fn read_back(
        &self,
        size: u64,
        bytes: &mut [u8],
        record: impl FnOnce(&mut crate::CommandBuffer, &Arc<Buffer>) -> Result<()>,
    ) -> Result<()> {
        self.read_later(size, record)?.wait_into(bytes)
    }
}
