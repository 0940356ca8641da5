//! Staging memory: what the host hands to commands, in pages that are used again.

use std::sync::Arc;

use ash::vk;

use super::staging_pool::StagingPool;
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::gpu::memory::allocator::{Mapping, MemoryKind};
use crate::resource::Buffer;
use crate::resource::buffer::{BufferDesc, BufferUsage, InternalUsage};

/// Bytes that the host has written for commands.
#[derive(Debug, Clone, Copy)]
pub(crate) struct StagingRegion {
    pub(crate) buffer: vk::Buffer,
    pub(crate) offset: u64,
    pub(crate) address: u64,
    /// Which page they lie in.
    pub(crate) page: usize,
}

/// A piece of a page that one command buffer cuts small regions from, without the lock. No other region overlaps it.
#[derive(Default)]
pub(crate) struct StagingChunk {
    /// Keeps the mapping.
    _page: Option<Arc<Buffer>>,
    /// Where the host sees the first byte of the page, and the address of that.
    mapping: Option<(Mapping, u64)>,
    /// Addresses where the next region may begin, and where the chunk ends.
    next: u64,
    end: u64,
}

impl StagingChunk {
    const BYTES: u64 = 4 << 10;
    /// Larger regions are taken from pages.
    pub(crate) const MAX_BYTES: u64 = Self::BYTES / 4;

    /// A chunk that begins at this place of a page.
    fn new(page: Arc<Buffer>, offset: u64) -> Self {
        let next = page.address + offset;
        let mapping = page.mapping().map(|mapping| (mapping, page.address));
        Self { _page: Some(page), mapping, next, end: next + Self::BYTES }
    }

    /// A region at an address of this alignment, a power of two, as the GPU and the host see it, if the chunk has room for it.
    #[inline(always)]
    fn sub_allocate(&mut self, bytes: u64, align: u64) -> Option<(u64, &mut [u8])> {
        let (mapping, start) = self.mapping?;
        let address = self.next.checked_add(align - 1)? & !(align - 1);
        let end = address.checked_add(bytes).filter(|end| *end <= self.end)?;
        self.next = end;
        // SAFETY: the page lives as long as the chunk, which lies in its mapping; no other region overlaps this one.
        let out = unsafe {
            std::slice::from_raw_parts_mut(mapping.0.as_ptr().add((address - start) as usize), bytes as usize)
        };
        Some((address, out))
    }
}

/// Pages of host-visible memory. A region lives until the command buffer it was taken for is done.
pub(crate) struct Staging {
    /// As near to the GPU as the host can write.
    pages: StagingPool<Buffer>,
    /// Chunks are cut from these. Small writes beyond the host's caches cost far more than their bytes: the next lock that is
    /// taken waits until they have gone across the bus.
    cached: StagingPool<Buffer>,
    kept_bytes: u64,
    gpu: Arc<Gpu>,
}

impl Staging {
    /// Larger pieces get a page of their own.
    const PAGE_BYTES: u64 = 4 << 20;
    const MIN_PAGE_BYTES: u64 = 64 << 10;
    /// Of cached memory.
    const KEPT_CACHED_BYTES: u64 = 1 << 20;

    /// Keeps pages of `bytes` altogether.
    pub(crate) fn new(gpu: &Arc<Gpu>, bytes: u64) -> Self {
        let kept_bytes = bytes.max(Self::MIN_PAGE_BYTES);
        let pages = StagingPool::new(kept_bytes.min(Self::PAGE_BYTES), kept_bytes);
        let cached = StagingPool::new(Self::MIN_PAGE_BYTES, Self::KEPT_CACHED_BYTES);
        Self { pages, cached, kept_bytes, gpu: Arc::clone(gpu) }
    }

    /// Half of what is kept: so much may wait while as much is copied.
    pub(crate) fn half_bytes(&self) -> u64 {
        self.kept_bytes / 2
    }

    /// Copies `data` to where the command buffer `sequence` can read it, at an address of this alignment (a power of
    /// two).
    pub(crate) fn write(&self, data: &[u8], align: u64, sequence: u64) -> Result<StagingRegion> {
        let (region, ()) =
            self.write_with(data.len() as u64, align, sequence, |region| region.copy_from_slice(data))?;
        Ok(region)
    }

    /// As [`write`](Self::write), but `fill` writes the bytes in place. Answers what it does.
    pub(crate) fn write_with<R>(
        &self,
        bytes: u64,
        align: u64,
        sequence: u64,
        fill: impl FnOnce(&mut [u8]) -> R,
    ) -> Result<(StagingRegion, R)> {
        self.fill(bytes, align, Some(sequence), fill)
    }

    /// As [`write_with`](Self::write_with), small regions from a chunk that belongs to the same command buffer. Answers the
    /// address.
    #[inline(always)]
    pub(crate) fn write_in<R>(
        &self,
        chunk: &mut StagingChunk,
        bytes: u64,
        align: u64,
        sequence: u64,
        fill: impl FnOnce(&mut [u8]) -> R,
    ) -> Result<(u64, R)> {
        if bytes > StagingChunk::MAX_BYTES || align > StagingChunk::MAX_BYTES {
            let (region, answer) = self.write_with(bytes, align, sequence, fill)?;
            return Ok((region.address, answer));
        }
        if let Some((address, out)) = chunk.sub_allocate(bytes, align) {
            return Ok((address, fill(out)));
        }
        self.renew_chunk(chunk, sequence)?;
        let (address, out) = chunk.sub_allocate(bytes, align).ok_or_else(out_of_memory_error)?;
        Ok((address, fill(out)))
    }

    /// Takes a new chunk in place of a full one.
    #[inline(never)]
    fn renew_chunk(&self, chunk: &mut StagingChunk, sequence: u64) -> Result<()> {
        let make = |size| new_page(&self.gpu, size, MemoryKind::Readback);
        let (place, buffer) =
            self.cached.allocate(StagingChunk::BYTES, Buffer::ALIGNMENT, Some(sequence), make)?;
        *chunk = StagingChunk::new(buffer, place.offset);
        Ok(())
    }

    /// Copies `data` to where some command buffer will read it; see [`mark_used`](Self::mark_used).
    pub(crate) fn keep_region(&self, data: &[u8], align: u64) -> Result<StagingRegion> {
        let (region, ()) =
            self.fill(data.len() as u64, align, None, |region| region.copy_from_slice(data))?;
        Ok(region)
    }

    /// `count` regions of a page that were [kept](Self::keep_region) are read by the command buffer `sequence`.
    pub(crate) fn mark_used(&self, page: usize, count: u32, sequence: u64) {
        self.pages.mark_used(page, count, sequence);
    }

    /// The command buffer is done with its regions.
    pub(crate) fn release(&self, sequence: u64) {
        drop(self.pages.release(sequence));
        drop(self.cached.release(sequence));
    }

    /// Bytes of all pages.
    #[cfg(any(test, feature = "test-hooks"))]
    pub(crate) fn total_bytes(&self) -> u64 {
        self.pages.total_bytes() + self.cached.total_bytes()
    }

    /// The bytes are written without the lock.
    fn fill<R>(
        &self,
        bytes: u64,
        align: u64,
        sequence: Option<u64>,
        fill: impl FnOnce(&mut [u8]) -> R,
    ) -> Result<(StagingRegion, R)> {
        // Pages begin at addresses that are multiples of less than some alignments.
        let room = bytes + align.saturating_sub(Buffer::ALIGNMENT);
        let make = |size| new_page(&self.gpu, size, MemoryKind::HostVisible);
        let (place, buffer) = self.pages.allocate(room, align.min(Buffer::ALIGNMENT), sequence, make)?;
        let address = (buffer.address + place.offset).next_multiple_of(align.max(1));
        let offset = address - buffer.address;
        let region = StagingRegion { buffer: buffer.raw, offset, address, page: place.page };
        // SAFETY: `offset + bytes <= place.offset + room` lies inside the mapping, and no other region overlaps this one.
        let answer = unsafe { fill_region(offset, bytes, &buffer, fill) }?;
        Ok((region, answer))
    }
}

/// Has `bytes` of a page written from `offset` on. Answers what `fill` does.
///
/// # Safety
/// They lie inside the mapping of the page, `buffer`, and nobody else has them.
#[inline]
unsafe fn fill_region<R>(
    offset: u64,
    bytes: u64,
    buffer: &Buffer,
    fill: impl FnOnce(&mut [u8]) -> R,
) -> Result<R> {
    let mapped = buffer.mapped().ok_or_else(|| Error::usage("staging", "the memory is not mapped"))?;
    // SAFETY: the caller's promise.
    Ok(fill(unsafe { std::slice::from_raw_parts_mut(mapped.as_ptr().add(offset as usize), bytes as usize) }))
}

#[cold]
fn out_of_memory_error() -> Error {
    Error::usage("staging", "a new chunk has no room")
}

fn new_page(gpu: &Arc<Gpu>, bytes: u64, memory: MemoryKind) -> Result<Buffer> {
    let inputs = if gpu.accel.is_some() { BufferUsage::ACCEL_INPUT } else { BufferUsage::empty() };
    let desc = BufferDesc {
        size_bytes: bytes,
        usage: BufferUsage::STORAGE | inputs,
        memory,
        data: None,
        debug_name: "staging",
    };
    Buffer::new(gpu, &desc, InternalUsage::NONE)
}
