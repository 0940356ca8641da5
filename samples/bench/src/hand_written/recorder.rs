//! A command buffer that is recorded and discarded, to measure recording alone.

use std::rc::Rc;

use lvk::ash::vk;

use super::RawDevice;
use super::command_pool::RawCommandPool;
use crate::error::BenchError;

/// A command buffer that is recorded and discarded repeatedly.
pub(crate) struct RawRecorder {
    pool: RawCommandPool,
    commands: vk::CommandBuffer,
}

impl RawRecorder {
    pub(crate) fn new(device: &Rc<RawDevice>) -> Result<Rc<Self>, BenchError> {
        let pool = RawCommandPool::new(device)?;
        Ok(Rc::new(Self { commands: pool.allocate()?, pool }))
    }

    /// Begins the recording.
    pub(crate) fn begin(&self) -> Result<vk::CommandBuffer, BenchError> {
        self.pool.begin(self.commands)?;
        Ok(self.commands)
    }

    /// Discards the recorded commands.
    pub(crate) fn discard(&self) -> Result<(), BenchError> {
        self.pool.reset()
    }
}
