//! Timestamps.

use std::ops::Range;

use ash::vk;

use super::CommandBuffer;
use crate::error::Result;
use crate::handle::QueryPoolHandle;

impl CommandBuffer {
    /// Makes queries ready to be written again (`vkCmdResetQueryPool`).
    pub fn reset_queries(&mut self, pool: QueryPoolHandle, queries: Range<u32>) -> Result<()> {
        let pool = self.shared.store.query_pools.get(pool)?;
        let count = queries.end.saturating_sub(queries.start);
        pool.check_range(queries.start, count)?;
        if count > 0 {
            self.end_rendering();
            // SAFETY: the queries exist, and no pass is open.
            unsafe {
                self.shared.gpu.device.cmd_reset_query_pool(self.raw(), pool.raw, queries.start, count)
            };
        }
        Ok(())
    }

    /// Writes the time at which every earlier command is done (`vkCmdWriteTimestamp2`). The query must have been
    /// reset since it was last written.
    pub fn write_timestamp(&mut self, pool: QueryPoolHandle, query: u32) -> Result<()> {
        let pool = self.shared.store.query_pools.get(pool)?;
        pool.check_range(query, 1)?;
        let stage = vk::PipelineStageFlags2::ALL_COMMANDS;
        // SAFETY: the query exists.
        unsafe { self.shared.gpu.device.cmd_write_timestamp2(self.raw(), stage, pool.raw, query) };
        Ok(())
    }
}
