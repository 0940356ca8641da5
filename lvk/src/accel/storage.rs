//! Memory of acceleration structures: small ones share buffers, large ones have their own.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use super::range_allocator::RangeAllocator;
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::lock_order::{Mutex, Rank};
use crate::resource::Buffer;
use crate::resource::buffer::{BufferDesc, BufferUsage, InternalUsage};

/// Bytes of a shared buffer.
const SHARED_BLOCK_BYTES: u64 = 4 << 20;
/// Acceleration structures larger than this get their own buffer, which is freed together with them.
const MAX_SHARED_BYTES: u64 = SHARED_BLOCK_BYTES / 8;
/// Vulkan's alignment of acceleration structures inside their buffer.
const ALIGNMENT: u64 = 256;

/// Allocates memory for acceleration structures.
pub(crate) struct AccelStorage {
    pool: Arc<SharedBlocks>,
    budget_bytes: u64,
}

struct SharedBlocks {
    blocks: Mutex<Vec<SharedBlock>>,
    used_bytes: AtomicU64,
}

/// A buffer that several acceleration structures share.
struct SharedBlock {
    buffer: Arc<Buffer>,
    ranges: RangeAllocator,
}

/// The bytes of one acceleration structure, freed on drop.
pub(crate) struct StorageRange {
    pub(crate) buffer: Arc<Buffer>,
    /// A multiple of 256.
    pub(crate) offset: u64,
    pub(crate) bytes: u64,
    shared: bool,
    pool: Arc<SharedBlocks>,
}

impl AccelStorage {
    /// Creates a storage that never holds more than `budget_bytes`.
    pub(crate) fn new(budget_bytes: u64) -> Self {
        let blocks = Mutex::new(Rank::AccelBlocks, Vec::new());
        Self { pool: Arc::new(SharedBlocks { blocks, used_bytes: AtomicU64::new(0) }), budget_bytes }
    }

    /// Allocates memory for the acceleration structure `name`.
    pub(crate) fn alloc(&self, gpu: &Arc<Gpu>, name: &str, bytes: u64) -> Result<StorageRange> {
        let bytes = bytes.max(1).checked_next_multiple_of(ALIGNMENT).unwrap_or(u64::MAX);
        self.reserve(name, bytes)?;
        // Validation in shaders knows the end of a buffer, but not the end of an acceleration structure inside it.
        let alone = bytes > MAX_SHARED_BYTES || gpu.instance.gpu_assisted;
        let alone_in_buffer = || new_buffer(gpu, name, bytes).map(|buffer| (Arc::new(buffer), 0, false));
        let made = if alone {
            alone_in_buffer()
        } else {
            match self.alloc_shared(gpu, bytes) {
                // Less may be free than a shared buffer has.
                Err(Error::OutOfDeviceMemory { .. }) => alone_in_buffer(),
                made => made.map(|(buffer, offset)| (buffer, offset, true)),
            }
        };
        let (buffer, offset, shared) = made.inspect_err(|_| self.pool.unreserve(bytes))?;
        Ok(StorageRange { buffer, offset, bytes, shared, pool: Arc::clone(&self.pool) })
    }

    /// Bytes of all live acceleration structures.
    pub(crate) fn used_bytes(&self) -> u64 {
        self.pool.used_bytes.load(Ordering::Relaxed)
    }

    /// Bytes of shared buffers that no acceleration structure uses.
    pub(crate) fn free_bytes(&self) -> u64 {
        let blocks = self.pool.blocks.lock();
        blocks.iter().map(|block| SHARED_BLOCK_BYTES - block.ranges.used_bytes()).sum()
    }

    fn reserve(&self, name: &str, bytes: u64) -> Result<()> {
        let add = |used: u64| used.checked_add(bytes).filter(|sum| *sum <= self.budget_bytes);
        let used = &self.pool.used_bytes;
        let over =
            |used| Error::OverBudget { object: name.to_owned(), bytes, used, budget: self.budget_bytes };
        used.fetch_update(Ordering::Relaxed, Ordering::Relaxed, add).map(drop).map_err(over)
    }

    fn alloc_shared(&self, gpu: &Arc<Gpu>, bytes: u64) -> Result<(Arc<Buffer>, u64)> {
        let mut blocks = self.pool.blocks.lock();
        for block in blocks.iter_mut() {
            if let Some(offset) = block.ranges.alloc(bytes) {
                return Ok((Arc::clone(&block.buffer), offset));
            }
        }
        let buffer = Arc::new(new_buffer(gpu, "small acceleration structures", SHARED_BLOCK_BYTES)?);
        let mut block =
            SharedBlock { buffer: Arc::clone(&buffer), ranges: RangeAllocator::new(SHARED_BLOCK_BYTES) };
        let offset = block.ranges.alloc(bytes).unwrap_or(0);
        blocks.push(block);
        Ok((buffer, offset))
    }
}

impl SharedBlocks {
    fn unreserve(&self, bytes: u64) {
        self.used_bytes.fetch_sub(bytes, Ordering::Relaxed);
    }

    /// Frees a range of a shared buffer. The buffer is freed with its last acceleration structure.
    fn free_shared(&self, range: &StorageRange) {
        let mut blocks = self.blocks.lock();
        let Some(index) = blocks.iter().position(|block| block.buffer.id == range.buffer.id) else { return };
        blocks[index].ranges.free(range.offset, range.bytes);
        if blocks[index].ranges.is_empty() {
            blocks.swap_remove(index);
        }
    }
}

impl Drop for StorageRange {
    fn drop(&mut self) {
        self.pool.unreserve(self.bytes);
        if self.shared {
            self.pool.free_shared(self);
        }
    }
}

fn new_buffer(gpu: &Arc<Gpu>, name: &str, bytes: u64) -> Result<Buffer> {
    let desc =
        BufferDesc { size_bytes: bytes, usage: BufferUsage::STORAGE, debug_name: name, ..Default::default() };
    // Software acceleration structures are read as ordinary buffers.
    let usage =
        if gpu.accel.is_some() { InternalUsage::ACCEL_STORAGE } else { InternalUsage::SOFTWARE_STRUCTURES };
    Buffer::new(gpu, &desc, usage)
}
