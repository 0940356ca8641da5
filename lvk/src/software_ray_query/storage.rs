//! A structure in its memory.

use std::sync::Arc;

use crate::accel::storage::{AccelStorage, StorageRange};
use crate::error::Result;
use crate::gpu::Gpu;
use crate::resource::Buffer;

/// The memory of a structure of either level.
pub(crate) struct SoftwareAccelStorage {
    storage: StorageRange,
    /// What instances, or the table of top-level structures, refer to.
    pub(crate) address: u64,
}

impl SoftwareAccelStorage {
    /// Room for `bytes`; nothing is built yet.
    pub(crate) fn new(gpu: &Arc<Gpu>, storage: &AccelStorage, name: &str, bytes: u64) -> Result<Self> {
        let storage = storage.alloc(gpu, name, bytes)?;
        let address = storage.buffer.address + storage.offset;
        Ok(Self { storage, address })
    }

    /// The buffer it lies in.
    pub(crate) fn buffer(&self) -> &Arc<Buffer> {
        &self.storage.buffer
    }

    /// Where in the buffer.
    pub(crate) fn offset(&self) -> u64 {
        self.storage.offset
    }

    /// Bytes of memory it takes.
    pub(crate) fn memory_bytes(&self) -> u64 {
        self.storage.bytes
    }
}
