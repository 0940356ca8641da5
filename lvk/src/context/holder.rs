//! The owner of an object: destroys it when it goes out of scope.

use std::fmt;
use std::ops::Deref;

use super::Context;
use super::destroy::Destroy;

/// Owns the object behind a handle and destroys it on drop, once the GPU is done with it.
///
/// Derefs to the handle, so `&holder` or `*holder` goes wherever a handle is wanted.
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

    /// The handle, by value.
    pub fn handle(&self) -> H {
        self.handle
    }

    /// The number by which shaders reach the object: an element of `kTextures2D[]`, `kSamplers[]`, `kTLAS[]`.
    ///
    /// 0, the dummy, for objects that take no bindless slot (buffers are reached by address).
    pub fn index(&self) -> u32 {
        self.index
    }

    /// Gives ownership up: the object lives until [`Context::destroy`] or the end of the context.
    pub fn release(self) -> H {
        let holder = std::mem::ManuallyDrop::new(self);
        // SAFETY: `holder` is never dropped nor read again, so the context clone is moved out exactly once.
        drop(unsafe { std::ptr::read(&holder.ctx) });
        holder.handle
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
        self.ctx.destroy(self.handle);
    }
}

impl<H: Destroy> fmt::Debug for Holder<H> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Holder").field(&self.handle).field(&self.index).finish()
    }
}
