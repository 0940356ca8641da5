//! Pools of timestamp queries.

use std::sync::Arc;

use ash::vk;

use crate::error::{Error, Result, check_limit};
use crate::gpu::Gpu;

/// Describes a pool of timestamp queries.
#[derive(Debug, Clone, Copy)]
pub struct QueryPoolDesc<'a> {
    /// Number of timestamps, 1 to 65,536.
    pub count: u32,
    /// Name in error messages, validation messages and debuggers.
    pub debug_name: &'a str,
}

impl Default for QueryPoolDesc<'_> {
    fn default() -> Self {
        Self { count: 2, debug_name: "query pool" }
    }
}

/// A query pool, destroyed on drop.
pub(crate) struct QueryPool {
    pub(crate) raw: vk::QueryPool,
    pub(crate) count: u32,
    pub(crate) name: String,
    gpu: Arc<Gpu>,
}

impl QueryPool {
    const MAX_COUNT: u32 = 65_536;

    pub(crate) fn new(gpu: &Arc<Gpu>, desc: &QueryPoolDesc<'_>) -> Result<Self> {
        if gpu.caps.limits.timestamp_bits == 0 {
            return Err(gpu.lacks("timestamps on the queue"));
        }
        if desc.count == 0 {
            return Err(Error::usage(desc.debug_name, "a query pool needs at least one query"));
        }
        check_limit(desc.debug_name, "query count", desc.count.into(), Self::MAX_COUNT.into())?;
        Self::of(gpu, desc, vk::QueryType::TIMESTAMP)
    }

    /// A pool of any kind whose queries answer one number each.
    pub(crate) fn of(gpu: &Arc<Gpu>, desc: &QueryPoolDesc<'_>, ty: vk::QueryType) -> Result<Self> {
        let info = vk::QueryPoolCreateInfo::default().query_type(ty).query_count(desc.count);
        // SAFETY: the description is valid.
        let raw = unsafe { gpu.device.create_query_pool(&info, None) }
            .map_err(Error::vulkan("vkCreateQueryPool"))?;
        // SAFETY: `hostQueryReset` is on and no command uses the new pool.
        unsafe { gpu.device.reset_query_pool(raw, 0, desc.count) };
        gpu.name(raw, desc.debug_name);
        Ok(Self { raw, count: desc.count, name: desc.debug_name.to_owned(), gpu: Arc::clone(gpu) })
    }

    /// Fails unless `first..first + count` are queries of the pool.
    pub(crate) fn check_range(&self, first: u32, count: u32) -> Result<()> {
        if first.checked_add(count).is_some_and(|end| end <= self.count) {
            return Ok(());
        }
        let message = format!("queries {first}..{first}+{count} are outside of the pool's {}", self.count);
        Err(Error::usage(&self.name, message))
    }

    /// Milliseconds of each timestamp since an arbitrary start; `None` where none was written yet.
    pub(crate) fn milliseconds(&self, first: u32, count: u32) -> Result<Vec<Option<f64>>> {
        let limits = &self.gpu.caps.limits;
        let mask = u64::MAX >> (64 - limits.timestamp_bits.clamp(1, 64));
        let period = f64::from(limits.timestamp_period_ns) * 1e-6;
        let milliseconds = |ticks: u64| (ticks & mask) as f64 * period;
        Ok(self.values(first, count)?.into_iter().map(|ticks| ticks.map(milliseconds)).collect())
    }

    /// The number of each query; `None` where none was written yet (`vkGetQueryPoolResults`).
    pub(crate) fn values(&self, first: u32, count: u32) -> Result<Vec<Option<u64>>> {
        self.check_range(first, count)?;
        let mut raw = vec![[0_u64; 2]; count as usize];
        let flags = vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WITH_AVAILABILITY;
        if count > 0 {
            // SAFETY: the range is checked and `raw` holds a value and an availability for each query.
            let read = unsafe { self.gpu.device.get_query_pool_results(self.raw, first, &mut raw, flags) };
            match read {
                Ok(()) | Err(vk::Result::NOT_READY) => {}
                Err(result) => return Err(Error::vulkan("vkGetQueryPoolResults")(result)),
            }
        }
        Ok(raw.iter().map(|[value, ready]| (*ready != 0).then_some(*value)).collect())
    }
}

impl Drop for QueryPool {
    fn drop(&mut self) {
        // SAFETY: the owner has waited until the GPU is done with the pool.
        unsafe { self.gpu.device.destroy_query_pool(self.raw, None) };
    }
}
