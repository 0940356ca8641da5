//! Asynchronous readback from the GPU to the host.

use std::ops::Range;
use std::sync::Arc;

use super::Context;
use crate::command::transfer::BufferCopy;
use crate::device_state::DeferredObject;
use crate::error::{Error, Result};
use crate::gpu::memory::allocator::MemoryKind;
use crate::handle::{BufferHandle, TextureHandle};
use crate::resource::Buffer;
use crate::resource::buffer::{BufferDesc, BufferUsage, InternalUsage, zeroed_bytes};
use crate::resource::region::TextureRegion;
use crate::submit::SubmitHandle;

/// Name, in errors, of the buffers that readbacks copy into.
pub(crate) const READBACK: &str = "readback";

/// Bytes that the GPU copies to the host, from [`Context::read_buffer_later`] and [`Context::read_texture_later`].
///
/// The contents are those at the time of the call: later submissions do not change them. Dropping the object discards
/// the bytes.
#[derive(Clone)]
pub struct Readback {
    /// `None` for a size of 0.
    target: Option<Arc<Buffer>>,
    submission: SubmitHandle,
    ctx: Context,
    /// Debug name of the object that is read.
    owner: String,
}

impl Readback {
    /// Returns true if the bytes are available. Does not wait (`vkGetSemaphoreCounterValue`).
    pub fn is_ready(&self) -> Result<bool> {
        self.ctx.is_done(self.submission)
    }

    /// Returns the bytes. Waits for the GPU if they are not available yet (`vkWaitSemaphores`).
    pub fn wait(&self) -> Result<Vec<u8>> {
        let size = self.target.as_ref().map_or(0, |target| target.size_bytes);
        let mut bytes = zeroed_bytes("Readback::wait", READBACK, size)
            .map_err(|error| error.with_owner(READBACK, &self.owner))?;
        self.wait_into(&mut bytes)?;
        Ok(bytes)
    }

    /// Returns the submission that copies the bytes.
    pub fn submission(&self) -> SubmitHandle {
        self.submission
    }

    pub(super) fn wait_into(&self, bytes: &mut [u8]) -> Result<()> {
        self.ctx.wait(self.submission)?;
        if let Some(target) = &self.target {
            target.read(0, bytes);
        }
        Ok(())
    }
}

impl std::fmt::Debug for Readback {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let bytes = self.target.as_ref().map_or(0, |target| target.size_bytes);
        f.debug_struct("Readback").field("bytes", &bytes).field("submission", &self.submission).finish()
    }
}

impl Context {
    /// Starts a copy of bytes of a buffer in any memory to the host, after everything submitted so far. Does not wait.
    ///
    /// # Errors
    /// [`InvalidUsage`](crate::Error::InvalidUsage) for a range that ends before it begins or outside of the buffer;
    /// [`StaleHandle`](crate::Error::StaleHandle).
    pub fn read_buffer_later(&self, buffer: BufferHandle, range: Range<u64>) -> Result<Readback> {
        let find = || self.device_state().store.buffers.get(buffer);
        let found = find()?;
        let Some(size) = range.end.checked_sub(range.start) else {
            return Err(Error::reversed_range(&found.name, "bytes", &range));
        };
        found.check_range(range.start, size)?;
        let owner = found.name.clone();
        drop(found);
        let copy = BufferCopy { source_offset: range.start, target_offset: 0, size };
        let read = self.read_later(size, |cmd, target| cmd.copy_buffer_objects(&find()?, target, &[copy]));
        read_of(owner, read)
    }

    /// Starts a copy of texels to the host, tightly packed, row by row and layer by layer, after everything submitted
    /// so far. Does not wait.
    ///
    /// # Errors
    /// As [`download_texture`](Self::download_texture).
    pub fn read_texture_later(&self, texture: TextureHandle, region: &TextureRegion) -> Result<Readback> {
        let find = || self.device_state().store.textures.get(texture);
        let found = find()?;
        let (size, owner) = (found.resolve_region(region)?.bytes(), found.name.clone());
        drop(found);
        let read = self
            .read_later(size, |cmd, target| cmd.copy_texture_objects_to_buffer(&find()?, region, target, 0));
        read_of(owner, read)
    }

    /// Creates a buffer that the GPU copies into for the host.
    pub(super) fn readback_buffer(&self, size: u64) -> Result<Arc<Buffer>> {
        let desc = BufferDesc {
            size_bytes: size,
            usage: BufferUsage::empty(),
            memory: MemoryKind::Readback,
            data: None,
            debug_name: READBACK,
        };
        Ok(Arc::new(Buffer::new(&self.device_state().gpu, &desc, InternalUsage::NONE)?))
    }

    /// Submits a copy into a new buffer. `record` looks up the source by handle, or defers the destruction of the source,
    /// as the wait for the copy may fail. An object that another thread destroys before the command buffer is open does
    /// not wait for the copy.
    pub(super) fn read_later(
        &self,
        size: u64,
        record: impl FnOnce(&mut crate::CommandBuffer, &Arc<Buffer>) -> Result<()>,
    ) -> Result<Readback> {
        if size == 0 {
            let submission = SubmitHandle::default();
            return Ok(Readback { target: None, submission, ctx: self.clone(), owner: String::new() });
        }
        let target = self.readback_buffer(size)?;
        let mut cmd = self.acquire_command_buffer()?;
        record(&mut cmd, &target)?;
        // Before the submission: if that fails half-way, the GPU may still write the buffer.
        self.device_state().free_later(DeferredObject::Buffer(Arc::clone(&target)));
        let submission = self.submit(cmd)?;
        Ok(Readback { target: Some(target), submission, ctx: self.clone(), owner: String::new() })
    }
}

/// Names the object that is read, for errors of the call and of the readback.
fn read_of(owner: String, read: Result<Readback>) -> Result<Readback> {
    match read {
        Ok(readback) => Ok(Readback { owner, ..readback }),
        Err(error) => Err(error.with_owner(READBACK, &owner)),
    }
}
