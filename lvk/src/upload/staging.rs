//! Staging memory: bytes from the host for commands, in pages that are reused.

use std::sync::Arc;

use ash::vk;

use super::staging_pool::StagingPool;
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::gpu::memory::allocator::{Mapping, MemoryKind};
use crate::resource::Buffer;
use crate::resource::buffer::{BufferDesc, BufferUsage, InternalUsage};

/// Name of the buffers, for errors and tools.
pub(crate) const STAGING: &str = "staging";

/// Bytes that the host has written for commands.
#[derive(Debug, Clone, Copy)]
pub(crate) struct StagingRegion {
    pub(crate) buffer: vk::Buffer,
    pub(crate) offset: u64,
    pub(crate) address: u64,
    /// The page that contains the bytes.
    pub(crate) page: usize,
}

/// A range of a page for small regions of one command buffer, allocated without the lock. No other region overlaps it.
pub(crate) struct StagingChunk {
    memory: ChunkMemory,
    /// Keeps the mapping alive.
    _page: Option<Arc<Buffer>>,
    /// Host mapping of the page, and the device address of its first byte.
    mapping: Option<(Mapping, u64)>,
    /// Address of the next region, and address of the end of the chunk.
    next: u64,
    end: u64,
}

/// Memory that a [`StagingChunk`] is allocated from.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum ChunkMemory {
    /// Cached by the host, for data that the GPU reads once. Small writes to uncached memory cost far more than their
    /// bytes: the next lock operation waits until they have crossed the bus.
    Cached,
    /// Nearest to the GPU, for data that many invocations read.
    NearGpu,
}

impl StagingChunk {
    const BYTES: u64 = 4 << 10;
    /// Larger regions are allocated from pages.
    pub(crate) const MAX_BYTES: u64 = Self::BYTES / 4;

    /// Creates a full chunk, which holds no memory.
    pub(crate) fn new(memory: ChunkMemory) -> Self {
        Self { memory, _page: None, mapping: None, next: 0, end: 0 }
    }

    /// Replaces the memory by a range that begins at this offset of a page.
    fn renew(&mut self, page: Arc<Buffer>, offset: u64) {
        self.next = page.address + offset;
        self.end = self.next + Self::BYTES;
        self.mapping = page.mapping().map(|mapping| (mapping, page.address));
        self._page = Some(page);
    }

    /// Allocates a region at an address with this alignment, a power of two. Returns its device address and its bytes
    /// on the host, or `None` if the chunk is full.
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

/// Pages of host-visible memory. A region lives until its command buffer is done.
pub(crate) struct Staging {
    /// Pages in the host-visible memory nearest to the GPU.
    pages: StagingPool<Buffer>,
    /// Cached pages, for chunks of [`ChunkMemory::Cached`].
    cached: StagingPool<Buffer>,
    kept_bytes: u64,
    gpu: Arc<Gpu>,
}

impl Staging {
    /// Largest size of a page. A larger region gets a page of its own.
    const PAGE_BYTES: u64 = 4 << 20;
    const MIN_PAGE_BYTES: u64 = 64 << 10;
    /// Bytes of cached memory that are kept.
    const KEPT_CACHED_BYTES: u64 = 1 << 20;

    /// Creates staging memory that keeps `bytes` of pages.
    pub(crate) fn new(gpu: &Arc<Gpu>, bytes: u64) -> Self {
        let kept_bytes = bytes.max(Self::MIN_PAGE_BYTES);
        // Several pages, so that one is filled while the GPU still reads the others.
        let page_bytes = (kept_bytes / 4).clamp(Self::MIN_PAGE_BYTES, Self::PAGE_BYTES);
        let pages = StagingPool::new(page_bytes, kept_bytes);
        let cached = StagingPool::new(Self::MIN_PAGE_BYTES, Self::KEPT_CACHED_BYTES);
        Self { pages, cached, kept_bytes, gpu: Arc::clone(gpu) }
    }

    /// Returns the bytes of pages that are kept for reuse.
    pub(crate) fn kept_bytes(&self) -> u64 {
        self.kept_bytes
    }

    /// Returns half of the kept bytes: one half may be pending while the other is copied.
    pub(crate) fn half_bytes(&self) -> u64 {
        self.kept_bytes / 2
    }

    /// Copies `data` to memory that the command buffer `sequence` can read, at an address with this alignment (a power
    /// of two).
    pub(crate) fn write(&self, data: &[u8], align: u64, sequence: u64) -> Result<StagingRegion> {
        let (region, ()) =
            self.write_with(data.len() as u64, align, sequence, |region| region.copy_from_slice(data))?;
        Ok(region)
    }

    /// Allocates like [`write`](Self::write), and lets `fill` write the bytes in place. Returns the result of `fill`.
    pub(crate) fn write_with<R>(
        &self,
        bytes: u64,
        align: u64,
        sequence: u64,
        fill: impl FnOnce(&mut [u8]) -> R,
    ) -> Result<(StagingRegion, R)> {
        self.fill(bytes, align, Some(sequence), fill)
    }

    /// Allocates like [`write_with`](Self::write_with), but small regions from a chunk of the same command buffer.
    /// Returns the address.
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

    /// Replaces a full chunk by a new one.
    #[inline(never)]
    fn renew_chunk(&self, chunk: &mut StagingChunk, sequence: u64) -> Result<()> {
        let (pages, memory) = match chunk.memory {
            ChunkMemory::Cached => (&self.cached, MemoryKind::Readback),
            ChunkMemory::NearGpu => (&self.pages, MemoryKind::HostVisible),
        };
        let make = |size| new_page(&self.gpu, size, memory);
        let (place, buffer) = pages.allocate(StagingChunk::BYTES, Buffer::ALIGNMENT, Some(sequence), make)?;
        chunk.renew(buffer, place.offset);
        Ok(())
    }

    /// Copies `data` to memory for a command buffer that is chosen later with [`mark_used`](Self::mark_used).
    pub(crate) fn keep_region(&self, data: &[u8], align: u64) -> Result<StagingRegion> {
        let (region, ()) =
            self.fill(data.len() as u64, align, None, |region| region.copy_from_slice(data))?;
        Ok(region)
    }

    /// Records that the command buffer `sequence` reads `count` [kept](Self::keep_region) regions of a page.
    pub(crate) fn mark_used(&self, page: usize, count: u32, sequence: u64) {
        self.pages.mark_used(page, count, sequence);
    }

    /// Frees the regions of a finished command buffer.
    pub(crate) fn release(&self, sequence: u64) {
        drop(self.pages.release(sequence));
        drop(self.cached.release(sequence));
    }

    /// Returns the bytes of all pages.
    #[cfg(any(test, feature = "test-hooks"))]
    pub(crate) fn total_bytes(&self) -> u64 {
        self.pages.total_bytes() + self.cached.total_bytes()
    }

    /// Allocates a region and writes its bytes without holding the lock.
    fn fill<R>(
        &self,
        bytes: u64,
        align: u64,
        sequence: Option<u64>,
        fill: impl FnOnce(&mut [u8]) -> R,
    ) -> Result<(StagingRegion, R)> {
        // The alignment of pages may be less than `align`.
        let room = bytes + align.saturating_sub(Buffer::ALIGNMENT);
        let make = |size| new_page(&self.gpu, size, MemoryKind::HostVisible);
        let (place, buffer) = self.pages.allocate(room, align.min(Buffer::ALIGNMENT), sequence, make)?;
        let address = (buffer.address + place.offset).next_multiple_of(align.max(1));
        let offset = address - buffer.address;
        let region = StagingRegion { buffer: buffer.raw, offset, address, page: place.page };
        // SAFETY: `offset + bytes <= place.offset + room` lies inside the mapping, and no other region overlaps this
        // one.
        let answer = unsafe { fill_region(offset, bytes, &buffer, fill) }?;
        Ok((region, answer))
    }
}

/// Writes `bytes` of a page from `offset` on with `fill`. Returns the result of `fill`.
///
/// # Safety
/// The bytes lie inside the mapping of the page, `buffer`, and no other code uses them.
#[inline]
unsafe fn fill_region<R>(
    offset: u64,
    bytes: u64,
    buffer: &Buffer,
    fill: impl FnOnce(&mut [u8]) -> R,
) -> Result<R> {
    let mapped = buffer.mapped().ok_or_else(|| Error::usage(STAGING, "the memory is not mapped"))?;
    // SAFETY: the caller's promise.
    Ok(fill(unsafe { std::slice::from_raw_parts_mut(mapped.as_ptr().add(offset as usize), bytes as usize) }))
}

#[cold]
fn out_of_memory_error() -> Error {
    Error::usage(STAGING, "a new chunk has no room")
}

fn new_page(gpu: &Arc<Gpu>, bytes: u64, memory: MemoryKind) -> Result<Buffer> {
    let inputs = if gpu.accel.is_some() { BufferUsage::ACCEL_INPUT } else { BufferUsage::empty() };
    let desc = BufferDesc {
        size_bytes: bytes,
        usage: BufferUsage::STORAGE | inputs,
        memory,
        data: None,
        debug_name: STAGING,
    };
    Buffer::new(gpu, &desc, InternalUsage::NONE)
}
