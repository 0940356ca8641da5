//! The profiler: GPU times of the labelled parts of frames.

use std::sync::Arc;

use super::Context;
use crate::error::Result;
use crate::submit::GpuProfile;

impl Context {
    /// Enables or disables the profiler for command buffers acquired from now on. It is off by default and costs
    /// nothing then.
    ///
    /// While it is on, each command buffer writes timestamps at its begin, its end and its labels
    /// (`vkCmdWriteTimestamp2`), including named render passes. Results of finished work are read without waiting. One
    /// timestamp costs the GPU about as much as a small barrier.
    ///
    /// # Errors
    /// [`Unsupported`](crate::Error::Unsupported) where the queue has no timestamps.
    pub fn set_profiling(&self, on: bool) -> Result<()> {
        self.device_state().profiler.set_enabled(on)
    }

    /// Returns the GPU times of the latest finished frame, or of the latest finished submission if
    /// [`next_frame`](Self::next_frame) was never called. `None` before the first. Does not wait.
    ///
    /// A frame is everything submitted between two calls of [`next_frame`](Self::next_frame), so its times are known
    /// after the second call at the earliest. [`wait_idle`](Self::wait_idle) finishes the latest frame without a second
    /// call: its profile then holds what was submitted so far, and grows if the frame submits more. Uploads by the
    /// library count in the total time and have no scopes.
    ///
    /// # Errors
    /// Errors of the Vulkan query for the GPU's progress.
    pub fn last_profile(&self) -> Result<Option<Arc<GpuProfile>>> {
        self.device_state().collect()?;
        Ok(self.device_state().profiler.last())
    }
}
