//! Memory of a software acceleration structure.

use std::sync::Arc;

use crate::accel::storage::{AccelStorage, StorageRange};
use crate::error::Result;
use crate::gpu::Gpu;
use crate::resource::Buffer;

/// The memory of a BLAS or TLAS.
pub(crate) struct SoftwareAccelStorage {
    storage: StorageRange,
    /// Address that instances, or the table of TLASes, refer to.
    pub(crate) address: u64,
}

impl SoftwareAccelStorage {
    /// Allocates `bytes`; nothing is built yet.
    pub(crate) fn new(gpu: &Arc<Gpu>, storage: &AccelStorage, name: &str, bytes: u64) -> Result<Self> {
        let storage = storage.alloc(gpu, name, bytes)?;
        let address = storage.buffer.address + storage.offset;
        Ok(Self { storage, address })
    }

    /// Returns the buffer that contains the memory.
    pub(crate) fn buffer(&self) -> &Arc<Buffer> {
        &self.storage.buffer
    }

    /// Returns the offset in the buffer.
    pub(crate) fn offset(&self) -> u64 {
        self.storage.offset
    }

    /// Returns the bytes of the memory.
    pub(crate) fn memory_bytes(&self) -> u64 {
        self.storage.bytes
    }
}
