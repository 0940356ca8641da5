//! Ownership of an object: destroys the object when the owner is dropped.

use std::fmt;
use std::ops::Deref;

use super::Context;
use super::destroy::Destroy;
use crate::error::Result;
use crate::handle::BufferHandle;

/// Owner of the object behind a handle. Dropping it destroys the object once the GPU is done with it.
///
/// Derefs to the handle, so `&holder` or `*holder` can be used in place of a handle.
#[must_use = "dropping the holder destroys the object"]
pub struct Holder<H: Destroy> {
    ctx: Context,
    handle: H,
    index: u32,
}

impl<H: Destroy> Holder<H> {
    pub(crate) fn new(ctx: &Context, handle: H, index: u32) -> Self {
        Self { ctx: ctx.clone(), handle, index }
    }

    /// Returns the handle.
    pub fn handle(&self) -> H {
        self.handle
    }

    /// Returns the bindless index of the object in shaders: an element of `kTextures2D[]`, `kSamplers[]`, `kTLAS[]`.
    ///
    /// 0, the default descriptor, for objects without a bindless slot (shaders access buffers by address).
    pub fn index(&self) -> u32 {
        self.index
    }

    /// Releases ownership and returns the handle. The object lives until [`Context::destroy`] or the end of the
    /// context.
    pub fn release(self) -> H {
        let holder = std::mem::ManuallyDrop::new(self);
        // SAFETY: `holder` is never dropped nor read again, so the context clone is moved out exactly once.
        drop(unsafe { std::ptr::read(&holder.ctx) });
        holder.handle
    }
}

impl Holder<BufferHandle> {
    /// Returns the address of the buffer in shaders (`vkGetBufferDeviceAddress`), like
    /// [`Context::buffer_address`].
    pub fn address(&self) -> Result<u64> {
        self.ctx.buffer_address(self.handle)
    }
}

impl<H: Destroy> Deref for Holder<H> {
    type Target = H;

    fn deref(&self) -> &H {
        &self.handle
    }
}

impl<H: Destroy> Drop for Holder<H> {
    fn drop(&mut self) {
        // Its object may have been destroyed by the handle.
        let _ = self.handle.destroy_in(&self.ctx);
    }
}

impl<H: Destroy> fmt::Debug for Holder<H> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Holder").field(&self.handle).field(&self.index).finish()
    }
}
