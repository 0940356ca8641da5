//! Results of queries and of calibrated timestamps.

use super::Context;
use crate::error::Result;
use crate::gpu::calibrated_timestamps::CalibratedTimestamps;
use crate::handle::QueryPoolHandle;
use crate::resource::query_pool::PipelineStatistics;

impl Context {
    /// Returns `count` timestamps in milliseconds since an arbitrary start that all timestamps share. `None` for a
    /// timestamp that is not written yet (`vkGetQueryPoolResults`). Does not wait.
    ///
    /// The device's clock wraps after `2^`[`timestamp_bits`](crate::Limits::timestamp_bits) ticks.
    ///
    /// # Errors
    /// [`InvalidUsage`](crate::Error::InvalidUsage) for queries outside of the pool, and for pools of another kind.
    pub fn timestamps_ms(&self, pool: QueryPoolHandle, first: u32, count: u32) -> Result<Vec<Option<f64>>> {
        let state = self.device_state();
        state.submitter.explain_loss(state.store.query_pools.get(pool)?.milliseconds(first, count))
    }

    /// Reads the results of `out.len()` queries from `first` on: ticks of
    /// [`timestamp_period_ns`](crate::Limits::timestamp_period_ns) for timestamps, samples for occlusion. `None` if the
    /// GPU has not reached the query or the query was reset (`vkGetQueryPoolResults`). Until the GPU has run the reset, the former result stays.
    /// Neither waits nor allocates.
    ///
    /// # Errors
    /// [`InvalidUsage`](crate::Error::InvalidUsage) for queries outside of the pool, and for pools of pipeline
    /// statistics.
    pub fn read_queries(&self, pool: QueryPoolHandle, first: u32, out: &mut [Option<u64>]) -> Result<()> {
        let state = self.device_state();
        let pool = state.store.query_pools.get(pool)?;
        pool.check_kind(pool.kind.statistics().is_empty(), "read them with Context::statistics")?;
        state.submitter.explain_loss(pool.read(first, out))
    }

    /// Returns the pipeline statistics between begin and end of a query. `None` if the GPU has not reached the end or
    /// the query was reset (`vkGetQueryPoolResults`). Does not wait.
    ///
    /// # Errors
    /// [`InvalidUsage`](crate::Error::InvalidUsage) for a query outside of the pool, and for pools of another kind.
    pub fn statistics(&self, pool: QueryPoolHandle, query: u32) -> Result<Option<PipelineStatistics>> {
        let state = self.device_state();
        state.submitter.explain_loss(state.store.query_pools.get(pool)?.statistics(query))
    }

    /// Reads the clocks of GPU and host at one moment (`vkGetCalibratedTimestampsKHR`), so that GPU timestamps can be
    /// compared with host times and instants. Does not wait. [`HostClock`](crate::HostClock) says which clock of the
    /// host a driver reads.
    ///
    /// # Errors
    /// [`Unsupported`](crate::Error::Unsupported) without
    /// [`Capabilities::calibrated_timestamps`](crate::Capabilities::calibrated_timestamps), and where the driver reads
    /// none of the clocks of [`HostClock`](crate::HostClock).
    pub fn calibrated_timestamps(&self) -> Result<CalibratedTimestamps> {
        let gpu = &self.device_state().gpu;
        let reader =
            gpu.clock_reader.as_ref().ok_or_else(|| gpu.unsupported("clocks of device and host together"))?;
        reader.read(|ticks| gpu.timestamps().milliseconds(ticks))
    }
}
