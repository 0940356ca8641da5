//! The profiler: what the GPU took for the labelled parts of frames.

use std::sync::Arc;

use super::Context;
use crate::error::Result;
use crate::submit::GpuProfile;

impl Context {
    /// Turns the profiler on or off for command buffers acquired from now on. It is off at first, and costs nothing then.
    ///
    /// While it is on, each command buffer stamps its begin, its end and its labels with the time
    /// (`vkCmdWriteTimestamp2`), named render passes included, and what the GPU has finished is read without waiting. One
    /// stamp costs the GPU about as much as a small barrier.
    ///
    /// # Errors
    /// [`Unsupported`](crate::Error::Unsupported) where the queue has no timestamps.
    pub fn set_profiling(&self, on: bool) -> Result<()> {
        self.device_state().profiler.set_enabled(on)
    }

    /// What the GPU took for the latest frame it has finished, or the latest submission where
    /// [`next_frame`](Self::next_frame) was never called; `None` before the first. Does not wait.
    ///
    /// A frame is what was submitted between two calls of [`next_frame`](Self::next_frame), so it is known after the second
    /// at the earliest. Uploads made by the library count in the whole and are no scopes.
    ///
    /// # Errors
    /// What Vulkan answers when it is asked how far the GPU is.
    pub fn last_profile(&self) -> Result<Option<Arc<GpuProfile>>> {
        self.device_state().collect()?;
        Ok(self.device_state().profiler.last())
    }
}
