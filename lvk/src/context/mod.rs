//! The facade users hold: a context creates objects, moves data, hands out command buffers and submits them.

pub(crate) mod accel_info;
mod blas_shapes;
mod compact;
pub(crate) mod config;
mod create;
mod create_accel;
mod create_ray_tracing;
mod create_texture;
mod data;
pub(crate) mod destroy;
mod dummy;
pub(crate) mod frame;
pub(crate) mod holder;
mod index_faults;
mod interop;
mod live_objects;
mod profile;
mod queries;
mod read_bounds;
pub(crate) mod serialize;
mod software_blas;
mod start;
mod submit;
mod support;
#[cfg(feature = "test-hooks")]
pub mod test_hooks;

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::accel::compaction::Compactions;
use crate::command::CommandBuffer;
use crate::error::Result;
use crate::gpu::caps::Capabilities;
use crate::gpu::debug::ValidationSink;
use crate::shared::Shared;

use frame::FrameRing;

/// A Vulkan device with everything made from it.
///
/// Cloning is cheap and gives the same context. All methods take `&self` and may be called from any thread. The
/// device goes when the last clone, holder and command buffer are gone; objects still alive then are reported to the
/// `log` crate by name.
#[derive(Clone)]
pub struct Context {
    inner: Arc<Inner>,
}

struct Inner {
    /// Uploads and builds that run before the next submission.
    pending: Mutex<Option<CommandBuffer>>,
    frames: Mutex<FrameRing>,
    /// Compactions under way.
    compactions: Mutex<Compactions>,
    shared: Arc<Shared>,
}

impl Context {
    /// What the device can do.
    pub fn capabilities(&self) -> &Capabilities {
        &self.shared().gpu.caps
    }

    /// The messages of the validation layer so far.
    pub fn validation(&self) -> &ValidationSink {
        self.shared().gpu.instance.sink()
    }

    fn shared(&self) -> &Arc<Shared> {
        &self.inner.shared
    }

    /// Records into the command buffer that runs before the next submission. What it holds stays there whatever
    /// becomes of `record`.
    fn before_next_submission<T>(&self, record: impl FnOnce(&mut CommandBuffer) -> Result<T>) -> Result<T> {
        let mut pending = self.pending();
        let cmd = self.open(&mut pending)?;
        let result = record(cmd);
        // It goes before whatever is submitted next, so commands recorded from now on may rely on it.
        cmd.apply_tlas_updates();
        result
    }

    /// The command buffer that runs before the next submission. What it records next may be for those who have the slots
    /// of structures that are gone.
    fn open<'a>(&self, pending: &'a mut Option<CommandBuffer>) -> Result<&'a mut CommandBuffer> {
        let cmd = match pending {
            Some(cmd) => cmd,
            none => none.insert(CommandBuffer::new(self.shared())?),
        };
        let freed = std::mem::take(&mut *self.shared().freed_tlas());
        cmd.forget_tlas(&freed);
        Ok(cmd)
    }

    fn pending(&self) -> MutexGuard<'_, Option<CommandBuffer>> {
        self.inner.pending.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl std::fmt::Debug for Context {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Context").field("device", &self.capabilities().device_name).finish_non_exhaustive()
    }
}
