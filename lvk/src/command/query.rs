//! Queries: timestamps, and counts between a begin and an end.

use std::ops::Range;
use std::sync::Arc;

use ash::vk;

use super::CommandBuffer;
use super::render::pass::RenderPass;
use crate::error::{Error, Result};
use crate::handle::QueryPoolHandle;
use crate::resource::QueryPool;
use crate::resource::query_pool::QueryKind;
use crate::submit::last_access::QueueAccess;

impl CommandBuffer {
    /// Resets queries, so that they can be written again (`vkCmdResetQueryPool`).
    ///
    /// # Errors
    /// [`InvalidUsage`](crate::Error::InvalidUsage) for queries outside of the pool, and for open ones;
    /// [`WrongQueue`](Error::WrongQueue) on the transfer queue, which may use new pools, and pools that another queue
    /// has reset.
    pub fn reset_queries(&mut self, pool: QueryPoolHandle, queries: Range<u32>) -> Result<()> {
        self.needs_compute("a reset of queries")?;
        let pool = self.shared.store.query_pools.get(pool)?;
        let Some(count) = queries.end.checked_sub(queries.start) else {
            return Err(Error::reversed_range(&pool.name, "queries", &queries));
        };
        pool.check_range(queries.start, count)?;
        self.state.queries.check_reset(&pool, queries.clone())?;
        if count > 0 {
            self.end_rendering();
            // SAFETY: the queries exist and are not open, and no pass is open.
            unsafe {
                self.shared.gpu.device.cmd_reset_query_pool(self.raw(), pool.raw, queries.start, count)
            };
            self.state.queries.record_reset(&pool, queries);
        }
        Ok(())
    }

    /// Writes the time at which every earlier command is done (`vkCmdWriteTimestamp2`). The query must have been
    /// reset since it was last written.
    ///
    /// # Errors
    /// [`InvalidUsage`](crate::Error::InvalidUsage) for a query outside of the pool, for pools of another kind, and for
    /// a query that this command buffer has written already. [`Context::submit`](crate::Context::submit) checks the
    /// writes of earlier command buffers. [`Unsupported`](Error::Unsupported) on queues of the device that have no
    /// timestamps ([`QueueInfo::timestamp_bits`](crate::QueueInfo::timestamp_bits)).
    pub fn write_timestamp(&mut self, pool: QueryPoolHandle, query: u32) -> Result<()> {
        let pool = self.shared.store.query_pools.get(pool)?;
        pool.check_range(query, self.views)?;
        pool.check_kind(pool.kind == QueryKind::Timestamps, "measure with begin_query and end_query")?;
        self.needs_timestamps()?;
        self.state.queries.check_ready(&pool, query, self.views)?;
        let stage = vk::PipelineStageFlags2::ALL_COMMANDS;
        // SAFETY: the query exists and is ready.
        unsafe { self.shared.gpu.device.cmd_write_timestamp2(self.raw(), stage, pool.raw, query) };
        self.state.queries.record_write(&pool, query, self.views);
        Ok(())
    }

    /// Begins a query that counts samples that pass, or the work of the stages (`vkCmdBeginQuery`), up to
    /// [`end_query`](Self::end_query). Passes may lie in between. The query must have been reset since it was last
    /// used.
    ///
    /// # Errors
    /// [`InvalidUsage`](crate::Error::InvalidUsage) for a query outside of the pool, for pools of timestamps, and for a
    /// query that this command buffer has used already. Also [`InvalidUsage`](crate::Error::InvalidUsage) while another
    /// query of the same kind is open. [`Context::submit`](crate::Context::submit) checks the queries of earlier
    /// command buffers. [`Unsupported`](Error::Unsupported) for statistics after a render pass on lavapipe, which
    /// crashes there; [`WrongQueue`](Error::WrongQueue) on queues other than the graphics queue.
    pub fn begin_query(&mut self, pool: QueryPoolHandle, query: u32) -> Result<()> {
        self.end_rendering();
        self.begin_query_at(pool, query)
    }

    /// Ends the query that [`begin_query`](Self::begin_query) began (`vkCmdEndQuery`).
    ///
    /// # Errors
    /// [`InvalidUsage`](crate::Error::InvalidUsage) if the query is not open, or was begun in a render pass.
    pub fn end_query(&mut self, pool: QueryPoolHandle, query: u32) -> Result<()> {
        self.end_rendering();
        self.end_query_at(pool, query)
    }

    fn begin_query_at(&mut self, pool: QueryPoolHandle, query: u32) -> Result<()> {
        self.needs_graphics("a query of samples or statistics")?;
        let pool = self.shared.store.query_pools.get(pool)?;
        pool.check_range(query, self.views)?;
        pool.check_kind(pool.kind != QueryKind::Timestamps, "write them with write_timestamp")?;
        self.state.queries.check_begin(&pool)?;
        self.state.queries.check_ready(&pool, query, self.views)?;
        self.check_statistics(pool.kind)?;
        // SAFETY: the query exists and is ready, and none of its type is open.
        unsafe {
            let device = &self.shared.gpu.device;
            device.cmd_begin_query(self.raw(), pool.raw, query, pool.kind.control_flags());
        }
        self.state.queries.record_begin(pool, query, self.views, self.rendering);
        Ok(())
    }

    /// Fails for pipeline statistics on lavapipe that begin outside of render passes after one: lavapipe 25.0 crashes
    /// there.
    fn check_statistics(&self, kind: QueryKind) -> Result<()> {
        let gpu = &self.shared.gpu;
        let outside = self.had_pass && !self.rendering;
        if kind.statistics().is_empty() || !outside || gpu.caps.driver_name != "llvmpipe" {
            return Ok(());
        }
        let why = "lavapipe cannot; begin them inside of a pass, before the first pass, or in a command buffer of their own";
        Err(Error::unsupported("beginning pipeline statistics behind a render pass", why))
    }

    fn end_query_at(&mut self, pool: QueryPoolHandle, query: u32) -> Result<()> {
        let pool = self.shared.store.query_pools.get(pool)?;
        self.state.queries.record_end(&pool, query, self.rendering)?;
        self.record_end_query(&pool, query);
        Ok(())
    }

    /// Ends the queries that were begun in the pass that ends now. The submission reports each of them as an error.
    pub(super) fn end_pass_queries(&mut self) {
        for open in self.state.queries.take_pass_queries() {
            self.record_end_query(&open.pool, open.query);
        }
    }

    /// Ends the queries that are still open.
    pub(super) fn end_open_queries(&mut self) {
        self.end_rendering();
        for open in self.state.queries.take_open_queries() {
            self.record_end_query(&open.pool, open.query);
        }
    }

    fn record_end_query(&self, pool: &Arc<QueryPool>, query: u32) {
        // SAFETY: the query was begun on this side of the pass and has not been ended.
        unsafe { self.shared.gpu.device.cmd_end_query(self.raw(), pool.raw, query) };
    }

    /// References the query pools for queue synchronisation.
    pub(super) fn reference_query_pools(&mut self) {
        if self.shared.gpu.queues.has_several() {
            self.recording.references.extend(self.state.queries.pools().map(|id| (id, QueueAccess::Write)));
        }
    }

    /// Fails if a query is open, or is written again without a reset.
    pub(crate) fn check_queries(&self) -> Result<()> {
        self.state.queries.check_submit()
    }
}

impl RenderPass<'_> {
    /// As [`CommandBuffer::write_timestamp`], between draws. Tile-based devices return times of the whole pass. In a
    /// pass with a view mask, this and the following queries are written, one for each view.
    pub fn write_timestamp(&mut self, pool: QueryPoolHandle, query: u32) -> Result<()> {
        self.cmd.write_timestamp(pool, query)
    }

    /// As [`CommandBuffer::begin_query`], to be ended in the same pass. In a pass with a view mask, this and the
    /// following queries are used, one for each view. The result is their sum, which drivers may put into the first
    /// alone.
    pub fn begin_query(&mut self, pool: QueryPoolHandle, query: u32) -> Result<()> {
        self.cmd.begin_query_at(pool, query)
    }

    /// Ends the query that [`begin_query`](Self::begin_query) began in this pass (`vkCmdEndQuery`).
    ///
    /// # Errors
    /// [`InvalidUsage`](crate::Error::InvalidUsage) if the query is not open, or was begun before the pass.
    pub fn end_query(&mut self, pool: QueryPoolHandle, query: u32) -> Result<()> {
        self.cmd.end_query_at(pool, query)
    }
}
