//! Copies, fills and updates of buffers.

use std::sync::Arc;

use ash::vk;

use crate::barrier::Use;
use crate::command::CommandBuffer;
use crate::command::pending_visibility::PendingVisibility;
use crate::error::{Error, Result};
use crate::handle::BufferHandle;
use crate::resource::Buffer;

/// Most bytes that one `vkCmdUpdateBuffer` takes.
const INLINE_BYTES: usize = 65_536;

/// A range of bytes to copy from one buffer to another.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct BufferCopy {
    /// Offset in the source, in bytes.
    pub source_offset: u64,
    /// Offset in the target, in bytes.
    pub target_offset: u64,
    /// Number of bytes.
    pub size: u64,
}

impl BufferCopy {
    fn raw(&self) -> vk::BufferCopy {
        vk::BufferCopy { src_offset: self.source_offset, dst_offset: self.target_offset, size: self.size }
    }
}

impl CommandBuffer {
    /// Copies `size` bytes between buffers (`vkCmdCopyBuffer`).
    pub fn copy_buffer(
        &mut self,
        source: BufferHandle,
        source_offset: u64,
        target: BufferHandle,
        target_offset: u64,
        size: u64,
    ) -> Result<()> {
        self.copy_buffer_regions(source, target, &[BufferCopy { source_offset, target_offset, size }])
    }

    /// Copies several ranges of bytes with one command (`vkCmdCopyBuffer`).
    ///
    /// # Errors
    /// [`InvalidUsage`](Error::InvalidUsage) for ranges outside of the buffers, for targets that overlap each other,
    /// and, within one buffer, for any target that overlaps any source. Then none of the ranges is copied.
    pub fn copy_buffer_regions(
        &mut self,
        source: BufferHandle,
        target: BufferHandle,
        regions: &[BufferCopy],
    ) -> Result<()> {
        let source = self.shared.store.buffers.get(source)?;
        let target = self.shared.store.buffers.get(target)?;
        self.copy_buffer_objects(&source, &target, regions)
    }

    /// As [`copy_buffer_regions`](Self::copy_buffer_regions), by object.
    pub(crate) fn copy_buffer_objects(
        &mut self,
        source: &Arc<Buffer>,
        target: &Arc<Buffer>,
        regions: &[BufferCopy],
    ) -> Result<()> {
        check_copies(source, target, regions)?;
        let raw: Vec<_> = regions.iter().filter(|region| region.size > 0).map(BufferCopy::raw).collect();
        if raw.is_empty() {
            return Ok(());
        }
        self.use_buffer(source, Use::transfer_read());
        self.use_buffer(target, Use::transfer_write());
        self.flush_barriers();
        self.state.pending_visibility.push(PendingVisibility::Buffer(Arc::clone(target)));
        // SAFETY: all ranges lie inside their buffers, and no target overlaps another or a source.
        unsafe { self.shared.gpu.device.cmd_copy_buffer(self.raw(), source.raw, target.raw, &raw) };
        Ok(())
    }

    /// Fills bytes with a repeated 32-bit value; offset and size are multiples of 4 (`vkCmdFillBuffer`).
    pub fn fill_buffer(&mut self, buffer: BufferHandle, offset: u64, size: u64, value: u32) -> Result<()> {
        let buffer = self.shared.store.buffers.get(buffer)?;
        buffer.check_range(offset, size)?;
        if !offset.is_multiple_of(4) || !size.is_multiple_of(4) {
            return Err(Error::usage(&buffer.name, "offset and size of a fill are multiples of 4"));
        }
        if size == 0 {
            return Ok(());
        }
        self.use_buffer(&buffer, Use::transfer_write());
        self.flush_barriers();
        // SAFETY: the range lies inside the buffer and is aligned.
        unsafe { self.shared.gpu.device.cmd_fill_buffer(self.raw(), buffer.raw, offset, size, value) };
        self.state.pending_visibility.push(PendingVisibility::Buffer(buffer));
        Ok(())
    }

    /// Writes bytes, any number at any offset; the call copies them. Up to 65,536 bytes are part of the command if
    /// offset and number are multiples of 4 (`vkCmdUpdateBuffer`). Others go through staging memory
    /// (`vkCmdCopyBuffer`).
    pub fn update_buffer(&mut self, buffer: BufferHandle, offset: u64, bytes: &[u8]) -> Result<()> {
        let buffer = self.shared.store.buffers.get(buffer)?;
        let aligned = offset.is_multiple_of(4) && bytes.len().is_multiple_of(4);
        if !aligned || bytes.len() > INLINE_BYTES {
            return self.upload_buffer(&buffer, offset, bytes);
        }
        buffer.check_range(offset, bytes.len() as u64)?;
        if bytes.is_empty() {
            return Ok(());
        }
        self.use_buffer(&buffer, Use::transfer_write());
        self.flush_barriers();
        // SAFETY: the range lies inside the buffer, is aligned, and not too large.
        unsafe { self.shared.gpu.device.cmd_update_buffer(self.raw(), buffer.raw, offset, bytes) };
        self.state.pending_visibility.push(PendingVisibility::Buffer(buffer));
        Ok(())
    }

    /// Copies host bytes into a buffer through staging memory.
    fn upload_buffer(&mut self, target: &Arc<Buffer>, offset: u64, bytes: &[u8]) -> Result<()> {
        target.check_range(offset, bytes.len() as u64)?;
        if bytes.is_empty() {
            return Ok(());
        }
        let region = self.shared.staging.write(bytes, 16, self.recording.staging_key())?;
        self.use_buffer(target, Use::transfer_write());
        self.flush_barriers();
        let copy = vk::BufferCopy { src_offset: region.offset, dst_offset: offset, size: bytes.len() as u64 };
        // SAFETY: both ranges lie inside their buffers.
        unsafe { self.shared.gpu.device.cmd_copy_buffer(self.raw(), region.buffer, target.raw, &[copy]) };
        self.state.pending_visibility.push(PendingVisibility::Buffer(Arc::clone(target)));
        Ok(())
    }
}

/// Fails unless all ranges lie in their buffers, and no byte is written twice or both read and written.
fn check_copies(source: &Buffer, target: &Buffer, regions: &[BufferCopy]) -> Result<()> {
    for region in regions {
        source.check_range(region.source_offset, region.size)?;
        target.check_range(region.target_offset, region.size)?;
    }
    let mut written: Vec<_> = non_empty_ranges(regions, |region| region.target_offset).collect();
    written.sort_unstable();
    if written.windows(2).any(|pair| pair[0].1 > pair[1].0) {
        return Err(Error::usage(&target.name, "two targets of the copy overlap"));
    }
    let overlaps = |read: (u64, u64)| written.iter().any(|(start, end)| *start < read.1 && read.0 < *end);
    if source.id == target.id && non_empty_ranges(regions, |region| region.source_offset).any(overlaps) {
        return Err(Error::usage(&source.name, "source and target of the copy overlap"));
    }
    Ok(())
}

/// Returns the first byte of each range that is not empty, and the byte after its last.
fn non_empty_ranges(
    regions: &[BufferCopy],
    start: impl Fn(&BufferCopy) -> u64,
) -> impl Iterator<Item = (u64, u64)> {
    let full = regions.iter().filter(|region| region.size > 0);
    full.map(move |region| (start(region), start(region) + region.size))
}
