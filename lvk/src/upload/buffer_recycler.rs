//! Recycling of mapped buffers.

use std::sync::Arc;

use crate::error::Result;
use crate::gpu::Gpu;
use crate::gpu::memory::allocator::MemoryKind;
use crate::lock_order::{Mutex, Rank};
use crate::resource::Buffer;
use crate::resource::buffer::{BufferDesc, BufferUsage, InternalUsage};

/// A few mapped buffers that are not in use.
pub(crate) struct BufferRecycler {
    usage: BufferUsage,
    buffers: Mutex<Vec<Arc<Buffer>>>,
}

impl BufferRecycler {
    /// Maximum number of kept buffers: an instance list for each frame in flight, for two TLAS.
    const MAX_SPARE: usize = 6;
    /// A buffer more than this many times too large is not reused.
    const MAX_SIZE_RATIO: u64 = 4;

    /// Creates an empty store of buffers with this usage.
    pub(crate) fn new(usage: BufferUsage) -> Self {
        Self { usage, buffers: Mutex::new(Rank::SpareBuffers, Vec::new()) }
    }

    /// Returns a mapped buffer of at least `bytes`.
    pub(crate) fn acquire(&self, gpu: &Arc<Gpu>, name: &str, bytes: u64) -> Result<Arc<Buffer>> {
        if let Some(spare) = self.find_spare(bytes) {
            return Ok(spare);
        }
        let (size_bytes, memory) = (bytes.max(1), MemoryKind::HostVisible);
        let desc = BufferDesc { size_bytes, usage: self.usage, memory, data: None, debug_name: name };
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

    /// Takes back a buffer that neither the GPU nor other code uses any more.
    pub(crate) fn recycle(&self, buffer: Arc<Buffer>) {
        let mut buffers = self.buffers.lock();
        if buffer.mapped().is_some() && Arc::strong_count(&buffer) == 1 && buffers.len() < Self::MAX_SPARE {
            buffers.push(buffer);
        }
    }
}
