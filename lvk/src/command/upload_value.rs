//! Values that shaders read by address, in memory of the command buffer.

use bytemuck::NoUninit;

use super::CommandBuffer;
use super::render::pass::RenderPass;
use crate::error::{Error, Result};
use crate::resource::Buffer;

impl CommandBuffer {
    /// Copies a value to memory of the command buffer, and returns its address in shaders.
    ///
    /// Every command of this command buffer can read the value: draws, dispatches and traces, on any queue. Shaders take
    /// the address from push constants, or from other uploaded data, as a `buffer_reference`. The address is a multiple
    /// of 16 and of `T`'s alignment. No [`Dependencies`](crate::Dependencies) are necessary, as the host writes the value
    /// before the submission. Shaders must not write to it.
    ///
    /// The memory is mapped, and device-local where the device has such memory. It is reused once the GPU is done with
    /// the command buffer, or the command buffer is dropped: the address must not be used in other command buffers. The
    /// context keeps [`staging_bytes`](crate::ContextDesc::staging_bytes) of it, so a frame loop allocates no memory.
    ///
    /// # Errors
    /// [`UploadTooLarge`](Error::UploadTooLarge) if the value is larger than
    /// [`staging_bytes`](crate::ContextDesc::staging_bytes), and [`OutOfDeviceMemory`](Error::OutOfDeviceMemory). The
    /// command buffer stays usable.
    #[inline]
    pub fn upload<T: NoUninit>(&mut self, value: &T) -> Result<u64> {
        self.upload_bytes(bytemuck::bytes_of(value), align_of::<T>() as u64)
    }

    /// Copies values to adjacent memory like [`upload`](Self::upload), and returns the address of the first. The address
    /// of no values is valid too, but shaders must not read from it.
    ///
    /// # Errors
    /// As [`upload`](Self::upload).
    #[inline]
    pub fn upload_slice<T: NoUninit>(&mut self, values: &[T]) -> Result<u64> {
        self.upload_bytes(bytemuck::cast_slice(values), align_of::<T>() as u64)
    }

    /// Copies bytes to memory of the command buffer at an address with this alignment, a power of two. Returns the
    /// address.
    #[inline]
    pub(super) fn upload_bytes(&mut self, bytes: &[u8], align: u64) -> Result<u64> {
        let staging = &self.shared.staging;
        let (size, limit) = (bytes.len() as u64, staging.kept_bytes());
        if size > limit {
            return Err(Error::UploadTooLarge { bytes: size, limit });
        }
        let align = align.max(Buffer::ALIGNMENT);
        let (chunk, sequence) = (&mut self.uploaded, self.recording.staging_key());
        let fill = |out: &mut [u8]| out[..bytes.len()].copy_from_slice(bytes);
        let (address, ()) = staging.write_in(chunk, size.max(1), align, sequence, fill)?;
        Ok(address)
    }
}

impl RenderPass<'_> {
    /// Copies a value to memory of the command buffer, and returns its address; see [`CommandBuffer::upload`].
    ///
    /// # Errors
    /// As [`CommandBuffer::upload`].
    #[inline]
    pub fn upload<T: NoUninit>(&mut self, value: &T) -> Result<u64> {
        self.cmd.upload(value)
    }

    /// Copies values to adjacent memory, and returns the address of the first; see [`CommandBuffer::upload_slice`].
    ///
    /// # Errors
    /// As [`CommandBuffer::upload`].
    #[inline]
    pub fn upload_slice<T: NoUninit>(&mut self, values: &[T]) -> Result<u64> {
        self.cmd.upload_slice(values)
    }
}
