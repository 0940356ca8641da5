//! The staging ring in host-visible memory: what the host hands to commands.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use ash::vk;

use super::ring::Ring;
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::gpu::memory::MemoryKind;
use crate::resource::Buffer;
use crate::resource::buffer::{BufferDesc, BufferUsage, InternalUsage};

/// Bytes written by the host for one command buffer.
pub(crate) struct StagingRegion {
    pub(crate) buffer: vk::Buffer,
    pub(crate) offset: u64,
    pub(crate) address: u64,
    /// A buffer of its own where the ring had no room; the caller retires it.
    pub(crate) temporary: Option<Arc<Buffer>>,
}

/// A ring of host-visible memory. A region lives until the command buffer it was taken for is done.
pub(crate) struct Staging {
    buffer: Arc<Buffer>,
    ring: Mutex<Ring>,
    gpu: Arc<Gpu>,
}

impl Staging {
    pub(crate) fn new(gpu: &Arc<Gpu>, bytes: u64) -> Result<Self> {
        let bytes = bytes.max(64 * 1024);
        let buffer = Arc::new(new_buffer(gpu, bytes, "staging ring")?);
        Ok(Self { buffer, ring: Mutex::new(Ring::new(bytes)), gpu: Arc::clone(gpu) })
    }

    /// Copies `data` to where the command buffer `sequence` can read it, at an address of this alignment (a power of
    /// two).
    pub(crate) fn write(&self, data: &[u8], align: u64, sequence: u64) -> Result<StagingRegion> {
        self.write_with(data.len() as u64, align, sequence, |region| {
            region.copy_from_slice(data);
        })
    }

    /// As [`write`](Self::write), but `fill` writes the bytes in place.
    pub(crate) fn write_with(
        &self,
        bytes: u64,
        align: u64,
        sequence: u64,
        fill: impl FnOnce(&mut [u8]),
    ) -> Result<StagingRegion> {
        let room = bytes + align;
        let found = self.lock().alloc(room, align, sequence);
        let (buffer, start, temporary) = match found {
            Some(start) => (Arc::clone(&self.buffer), start, None),
            None => {
                let own = Arc::new(new_buffer(&self.gpu, room, "staging, too large for the ring")?);
                (Arc::clone(&own), 0, Some(own))
            }
        };
        let address = (buffer.address + start).next_multiple_of(align.max(1));
        let offset = address - buffer.address;
        let mapped = buffer.mapped().ok_or_else(|| Error::usage("staging", "the memory is not mapped"))?;
        // SAFETY: `offset + bytes <= start + room` lies inside the mapping, and no other region overlaps this one.
        fill(unsafe { std::slice::from_raw_parts_mut(mapped.as_ptr().add(offset as usize), bytes as usize) });
        Ok(StagingRegion { buffer: buffer.raw, offset, address, temporary })
    }

    /// The command buffer is done with its regions.
    pub(crate) fn release(&self, sequence: u64) {
        self.lock().release(sequence);
    }

    fn lock(&self) -> MutexGuard<'_, Ring> {
        self.ring.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn new_buffer(gpu: &Arc<Gpu>, bytes: u64, name: &str) -> Result<Buffer> {
    let inputs = if gpu.accel.is_some() { BufferUsage::ACCEL_INPUT } else { BufferUsage::empty() };
    let desc = BufferDesc {
        size_bytes: bytes,
        usage: BufferUsage::STORAGE | inputs,
        memory: MemoryKind::HostVisible,
        data: None,
        debug_name: name,
    };
    Buffer::new(gpu, &desc, InternalUsage::NONE)
}
