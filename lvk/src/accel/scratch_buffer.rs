//! The scratch memory of builds: one buffer for all of them, which grows with the largest batch.

use std::sync::Arc;

use super::scratch::{ScratchSizes, scratch_buffer_bytes};
use crate::barrier::ResourceId;
use crate::error::Result;
use crate::gpu::Gpu;
use crate::lock_order::{Mutex, Rank};
use crate::resource::Buffer;
use crate::resource::buffer::{BufferDesc, BufferUsage, InternalUsage};

/// The shared scratch buffer. Barriers separate the builds that use it, as for any other writes.
pub(crate) struct ScratchBuffer {
    /// The resource that barriers track in place of the present buffer. All builds of a queue use it, so they run in
    /// order unless they are recorded as concurrent.
    pub(crate) id: ResourceId,
    pub(crate) tiers: ScratchSizes,
    current: Mutex<Option<Arc<Buffer>>>,
}

impl ScratchBuffer {
    /// Creates a scratch buffer of at most `budget` bytes, or more if a single build needs more.
    pub(crate) fn new(budget: u64, alignment: u64) -> Self {
        Self {
            id: ResourceId::next(),
            tiers: ScratchSizes::new(budget, alignment),
            current: Mutex::new(Rank::Scratch, None),
        }
    }

    /// Returns a buffer with `bytes` at an aligned address, and the smaller buffer that it replaces. The caller frees
    /// that one later.
    pub(crate) fn get_or_grow(
        &self,
        gpu: &Arc<Gpu>,
        bytes: u64,
    ) -> Result<(Arc<Buffer>, Option<Arc<Buffer>>)> {
        let alignment = gpu.caps.limits.scratch_alignment.into();
        let needed = scratch_buffer_bytes(bytes, alignment);
        let mut current = self.current.lock();
        match &*current {
            Some(buffer) if buffer.size_bytes >= needed => Ok((Arc::clone(buffer), None)),
            _ => {
                let bytes = scratch_buffer_bytes(self.tiers.buffer_bytes(bytes), alignment);
                let buffer = Arc::new(new_buffer(gpu, bytes)?);
                let replaced = current.replace(Arc::clone(&buffer));
                Ok((buffer, replaced))
            }
        }
    }

    /// Bytes of the present buffer.
    pub(crate) fn bytes(&self) -> u64 {
        let current = self.current.lock();
        current.as_ref().map_or(0, |buffer| buffer.size_bytes)
    }
}

fn new_buffer(gpu: &Arc<Gpu>, bytes: u64) -> Result<Buffer> {
    let desc = BufferDesc {
        size_bytes: bytes.max(1),
        usage: BufferUsage::STORAGE,
        debug_name: "acceleration structure scratch",
        ..Default::default()
    };
    Buffer::new(gpu, &desc, InternalUsage::NONE)
}
