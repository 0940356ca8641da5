//! Builds of opacity micromaps.

use super::CommandBuffer;
use crate::accel::micromap::Micromap;
use crate::barrier::Use;
use crate::error::Result;
use crate::resource::Buffer;

impl CommandBuffer {
    /// Builds a micromap (`vkCmdBuildMicromapsEXT`) with scratch memory of [`Micromap::new_scratch`].
    pub(crate) fn build_micromap(&mut self, micromap: &Micromap, scratch: &Buffer) -> Result<()> {
        self.use_buffer(&micromap.storage, Use::accel_build_write());
        self.flush_barriers();
        // SAFETY: the barriers are recorded; both are alive until the GPU is done, and nothing else uses the scratch
        // memory.
        unsafe { micromap.record_build(self.raw(), scratch) }
    }
}
