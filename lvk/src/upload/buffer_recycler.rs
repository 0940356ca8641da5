//! Mapped buffers that are used again instead of made anew.

use std::sync::Arc;

use crate::error::Result;
use crate::gpu::Gpu;
use crate::gpu::memory::allocator::MemoryKind;
use crate::lock_order::{Mutex, Rank};
use crate::resource::Buffer;
use crate::resource::buffer::{BufferDesc, InternalUsage};

/// A few mapped buffers that nobody uses at the moment.
pub(crate) struct BufferRecycler {
    buffers: Mutex<Vec<Arc<Buffer>>>,
}

impl BufferRecycler {
    /// More than this are let go: a list for each frame in flight, of two structures.
    const MAX_SPARE: usize = 6;
    /// A buffer this many times too large is not worth its memory.
    const MAX_SIZE_RATIO: u64 = 4;

    pub(crate) fn new() -> Self {
        Self { buffers: Mutex::new(Rank::SpareBuffers, Vec::new()) }
    }

    /// A mapped buffer of at least `bytes`.
    pub(crate) fn acquire(&self, gpu: &Arc<Gpu>, name: &str, bytes: u64) -> Result<Arc<Buffer>> {
        if let Some(spare) = self.find_spare(bytes) {
            return Ok(spare);
        }
        let memory = MemoryKind::HostVisible;
        let desc = BufferDesc { size_bytes: bytes.max(1), memory, debug_name: name, ..Default::default() };
        Ok(Arc::new(Buffer::new(gpu, &desc, InternalUsage::NONE)?))
    }

    fn find_spare(&self, bytes: u64) -> Option<Arc<Buffer>> {
        let mut buffers = self.buffers.lock();
        let fits = |buffer: &Arc<Buffer>| {
            buffer.size_bytes >= bytes && buffer.size_bytes <= bytes.saturating_mul(Self::MAX_SIZE_RATIO)
        };
        let place = buffers.iter().position(fits)?;
        Some(buffers.swap_remove(place))
    }

    /// Takes a buffer back that neither the GPU nor anybody else uses any more.
    pub(crate) fn recycle(&self, buffer: Arc<Buffer>) {
        let mut buffers = self.buffers.lock();
        if buffer.mapped().is_some() && Arc::strong_count(&buffer) == 1 && buffers.len() < Self::MAX_SPARE {
            buffers.push(buffer);
        }
    }
}
