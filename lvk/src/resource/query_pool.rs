//! Pools of queries: timestamps, occlusion and pipeline statistics.

use std::sync::Arc;

use ash::vk;
use bytemuck::{Pod, Zeroable};

use super::query_reset_state::QueryResetState;
use crate::barrier::ResourceId;
use crate::error::limit_origin::LimitOrigin;
use crate::error::{Error, Result, check_limit_of};
use crate::gpu::Gpu;
use crate::gpu::caps::optional_features::OptionalFeature;
use crate::lock_order::{Guard, Mutex, Rank};

/// Measurement of the queries of a pool.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum QueryKind {
    /// The time at which the GPU reaches a command (`VK_QUERY_TYPE_TIMESTAMP`).
    #[default]
    Timestamps,
    /// The number of samples that pass the depth and stencil tests between begin and end (`VK_QUERY_TYPE_OCCLUSION`).
    Occlusion {
        /// Counts exactly (`VK_QUERY_CONTROL_PRECISE_BIT`); needs
        /// [`Capabilities::precise_occlusion`](crate::Capabilities::precise_occlusion). Otherwise the number is 0 if no
        /// sample passed, and any other number if some did.
        precise: bool,
    },
    /// [`PipelineStatistics`] between begin and end, without task and mesh shaders
    /// (`VK_QUERY_TYPE_PIPELINE_STATISTICS`). Draws of mesh shaders are not allowed in between. Needs
    /// [`Capabilities::pipeline_statistics`](crate::Capabilities::pipeline_statistics).
    PipelineStatistics,
    /// [`PipelineStatistics`] between begin and end, only of fragment, compute, task and mesh shaders. Vulkan counts
    /// nothing else for pipelines with mesh shaders. Needs [`OptionalFeature::MeshShaderQueries`].
    MeshStatistics,
}

impl QueryKind {
    pub(crate) fn raw(self) -> vk::QueryType {
        match self {
            Self::Timestamps => vk::QueryType::TIMESTAMP,
            Self::Occlusion { .. } => vk::QueryType::OCCLUSION,
            Self::PipelineStatistics | Self::MeshStatistics => vk::QueryType::PIPELINE_STATISTICS,
        }
    }

    pub(crate) fn control_flags(self) -> vk::QueryControlFlags {
        match self {
            Self::Occlusion { precise: true } => vk::QueryControlFlags::PRECISE,
            _ => vk::QueryControlFlags::empty(),
        }
    }

    /// Returns the name for error messages.
    pub(crate) fn label(self) -> &'static str {
        match self {
            Self::Timestamps => "timestamps",
            Self::Occlusion { .. } => "occlusion",
            Self::PipelineStatistics => "pipeline statistics",
            Self::MeshStatistics => "mesh statistics",
        }
    }

    /// Returns the bits of the statistics, in the order of the fields of [`PipelineStatistics`]; empty for other kinds.
    pub(crate) fn statistics(self) -> vk::QueryPipelineStatisticFlags {
        let bits = match self {
            Self::Timestamps | Self::Occlusion { .. } => 0,
            Self::PipelineStatistics => PipelineStatistics::PLAIN_BITS,
            Self::MeshStatistics => PipelineStatistics::MESH_BITS,
        };
        vk::QueryPipelineStatisticFlags::from_raw(bits)
    }

    fn check_supported(self, gpu: &Gpu) -> Result<()> {
        match self {
            Self::Timestamps if gpu.caps.limits.timestamp_bits == 0 => {
                Err(gpu.unsupported("timestamps on the queue"))
            }
            Self::Occlusion { precise: true } => {
                gpu.require(OptionalFeature::OcclusionQueryPrecise, "an exact occlusion query")
            }
            Self::PipelineStatistics => {
                gpu.require(OptionalFeature::PipelineStatisticsQuery, "a query of pipeline statistics")
            }
            Self::MeshStatistics => {
                gpu.require(OptionalFeature::MeshShaderQueries, "a query of mesh statistics")
            }
            Self::Timestamps | Self::Occlusion { .. } => Ok(()),
        }
    }
}

/// Describes a pool of queries.
#[derive(Debug, Clone, Copy)]
pub struct QueryPoolDesc<'a> {
    /// Measurement of all queries of the pool. Default: [`QueryKind::Timestamps`].
    pub kind: QueryKind,
    /// Number of queries, 1 to 65,536. Default: 2.
    pub count: u32,
    /// Name in error messages, validation messages and debuggers. Default: `"query pool"`.
    pub debug_name: &'a str,
}

impl Default for QueryPoolDesc<'_> {
    fn default() -> Self {
        Self { kind: QueryKind::Timestamps, count: 2, debug_name: "query pool" }
    }
}

/// Invocations of pipeline stages and the primitives that they output (`VkQueryPipelineStatisticFlagBits`).
///
/// Drivers may count more or fewer than an ideal machine. Vertices shared by triangles may be shaded once or each time,
/// and invocations that only serve derivatives may count. Stages that no pipeline between begin and end has stay 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Pod, Zeroable)]
#[repr(C)] // Vulkan writes the values in the order of its bits
pub struct PipelineStatistics {
    /// Vertices of draws.
    pub input_vertices: u64,
    /// Primitives of draws.
    pub input_primitives: u64,
    /// Invocations of vertex shaders.
    pub vertex_invocations: u64,
    /// Invocations of geometry shaders.
    pub geometry_invocations: u64,
    /// Primitives that geometry shaders output.
    pub geometry_primitives: u64,
    /// Primitives that reached clipping.
    pub clipped_primitives: u64,
    /// Primitives that clipping output.
    pub rasterized_primitives: u64,
    /// Invocations of fragment shaders.
    pub fragment_invocations: u64,
    /// Patches that tessellation control shaders processed.
    pub tessellation_patches: u64,
    /// Invocations of tessellation evaluation shaders.
    pub tessellation_invocations: u64,
    /// Invocations of compute shaders, including the library's own kernels.
    pub compute_invocations: u64,
    /// Invocations of task shaders; only [`QueryKind::MeshStatistics`] counts them.
    pub task_invocations: u64,
    /// Invocations of mesh shaders; only [`QueryKind::MeshStatistics`] counts them.
    pub mesh_invocations: u64,
}

impl PipelineStatistics {
    const FIELDS: usize = 13;
    /// Bits of the fields from the first to the compute shaders.
    const PLAIN_BITS: u32 = (1 << 11) - 1;
    /// Bits of fragment, compute, task and mesh shaders.
    const MESH_BITS: u32 = 1 << 7 | 0b111 << 10;

    /// Creates statistics from the numbers of these bits, the lowest bit first.
    fn from_values(bits: u32, numbers: &[u64]) -> Self {
        let mut fields = [0; Self::FIELDS];
        let counted = fields.iter_mut().enumerate().filter(|(bit, _)| bits >> bit & 1 != 0);
        counted.zip(numbers).for_each(|((_, field), number)| *field = *number);
        bytemuck::cast(fields)
    }
}

/// A query pool, destroyed on drop.
pub(crate) struct QueryPool {
    pub(crate) raw: vk::QueryPool,
    /// Identifies the pool in the synchronisation of queues.
    pub(crate) id: ResourceId,
    pub(crate) kind: QueryKind,
    pub(crate) count: u32,
    pub(crate) name: String,
    /// State of the queries after all submitted command buffers.
    reset_state: Mutex<QueryResetState>,
    gpu: Arc<Gpu>,
}

impl QueryPool {
    const MAX_COUNT: u32 = 65_536;

    pub(crate) fn new(gpu: &Arc<Gpu>, desc: &QueryPoolDesc<'_>) -> Result<Self> {
        desc.kind.check_supported(gpu)?;
        if desc.count == 0 {
            return Err(Error::usage(desc.debug_name, "a query pool needs at least one query"));
        }
        check_limit_of(
            LimitOrigin::Library,
            desc.debug_name,
            "query count",
            desc.count.into(),
            Self::MAX_COUNT.into(),
        )?;
        Self::with_type(gpu, desc, desc.kind.raw())
    }

    /// Creates a pool of queries of type `ty`, which may differ from the kind of the description.
    pub(crate) fn with_type(gpu: &Arc<Gpu>, desc: &QueryPoolDesc<'_>, ty: vk::QueryType) -> Result<Self> {
        let mut info = vk::QueryPoolCreateInfo::default().query_type(ty).query_count(desc.count);
        if ty == vk::QueryType::PIPELINE_STATISTICS {
            info = info.pipeline_statistics(desc.kind.statistics());
        }
        // SAFETY: the description is valid.
        let raw = unsafe { gpu.device.create_query_pool(&info, None) }
            .map_err(Error::vulkan("vkCreateQueryPool", desc.debug_name))?;
        // SAFETY: `hostQueryReset` is on and no command uses the new pool.
        unsafe { gpu.device.reset_query_pool(raw, 0, desc.count) };
        gpu.name(raw, desc.debug_name);
        Ok(Self {
            raw,
            id: ResourceId::next(),
            kind: desc.kind,
            count: desc.count,
            name: desc.debug_name.to_owned(),
            reset_state: Mutex::new(Rank::QueryResetState, QueryResetState::new(desc.count)),
            gpu: Arc::clone(gpu),
        })
    }

    /// Fails unless `first..first + count` are queries of the pool.
    pub(crate) fn check_range(&self, first: u32, count: u32) -> Result<()> {
        if first.checked_add(count).is_some_and(|end| end <= self.count) {
            return Ok(());
        }
        let message =
            format!("{count} queries from {first} on are outside of the pool's {} queries", self.count);
        Err(Error::usage(&self.name, message))
    }

    /// Fails with the message `call` unless the kind of the pool fits.
    pub(crate) fn check_kind(&self, fits: bool, call: &str) -> Result<()> {
        if fits {
            return Ok(());
        }
        Err(Error::usage(&self.name, format!("its queries are {}; {call}", self.kind.label())))
    }

    /// Fails if a command buffer with the state `next` writes a query twice without a reset in between.
    pub(crate) fn check_submit(&self, next: &QueryResetState) -> Result<()> {
        match self.reset_state().first_conflict(next) {
            None => Ok(()),
            Some(query) => Err(self.not_reset_error(query)),
        }
    }

    /// Returns the error for a query that would be written twice.
    pub(crate) fn not_reset_error(&self, query: u32) -> Error {
        let message = format!("query {query} was written before; reset it first with reset_queries");
        Error::usage(&self.name, message)
    }

    /// Records that a command buffer with the state `next` was submitted.
    pub(crate) fn mark_submitted(&self, next: &QueryResetState) {
        self.reset_state().append(next);
    }

    /// Returns milliseconds of each timestamp since an arbitrary start; `None` for timestamps that are not written yet.
    pub(crate) fn milliseconds(&self, first: u32, count: u32) -> Result<Vec<Option<f64>>> {
        self.check_kind(self.kind == QueryKind::Timestamps, "times come from a pool of timestamps")?;
        let timestamps = self.gpu.timestamps();
        let milliseconds = |ticks: u64| timestamps.milliseconds(ticks);
        Ok(self.values(first, count)?.into_iter().map(|ticks| ticks.map(milliseconds)).collect())
    }

    /// Returns the number of each query; `None` if it is not available yet (`vkGetQueryPoolResults`).
    pub(crate) fn values(&self, first: u32, count: u32) -> Result<Vec<Option<u64>>> {
        self.check_range(first, count)?;
        let mut values = vec![None; count as usize];
        self.read(first, &mut values)?;
        Ok(values)
    }

    /// Reads the numbers into `out`, as [`values`](Self::values) without an allocation.
    pub(crate) fn read(&self, first: u32, out: &mut [Option<u64>]) -> Result<()> {
        const AT_ONCE: usize = 32;
        self.check_range(first, u32::try_from(out.len()).unwrap_or(u32::MAX))?;
        for (place, part) in (first..).step_by(AT_ONCE).zip(out.chunks_mut(AT_ONCE)) {
            let mut raw = [[0_u64; 2]; AT_ONCE];
            let raw = &mut raw[..part.len()];
            self.results(place, raw)?;
            for (value, [number, ready]) in part.iter_mut().zip(raw) {
                *value = (*ready != 0).then_some(*number);
            }
        }
        Ok(())
    }

    /// Returns the statistics of a query; `None` if they are not available yet.
    pub(crate) fn statistics(&self, query: u32) -> Result<Option<PipelineStatistics>> {
        let bits = self.kind.statistics().as_raw();
        self.check_kind(bits != 0, "statistics come from a pool of pipeline or mesh statistics")?;
        self.check_range(query, 1)?;
        match self.kind {
            QueryKind::MeshStatistics => self.statistic_values::<5>(query, bits),
            _ => self.statistic_values::<12>(query, bits),
        }
    }

    /// Reads the `N - 1` numbers of these bits, if they are available.
    fn statistic_values<const N: usize>(&self, query: u32, bits: u32) -> Result<Option<PipelineStatistics>> {
        let mut raw = [[0_u64; N]];
        self.results(query, &mut raw)?;
        let [(ready, numbers)] = raw.each_ref().map(|row| row.split_last().unwrap_or((&0, &[])));
        Ok((*ready != 0).then(|| PipelineStatistics::from_values(bits, numbers)))
    }

    /// Reads the numbers of queries of the pool. The availability follows the numbers of each query.
    fn results<T: Copy>(&self, first: u32, raw: &mut [T]) -> Result<()> {
        let flags = vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WITH_AVAILABILITY;
        // SAFETY: the queries exist, and a `T` holds the numbers and the availability of one query.
        match unsafe { self.gpu.device.get_query_pool_results(self.raw, first, raw, flags) } {
            Ok(()) | Err(vk::Result::NOT_READY) => Ok(()),
            Err(result) => Err(Error::vulkan("vkGetQueryPoolResults", &self.name)(result)),
        }
    }

    fn reset_state(&self) -> Guard<'_, QueryResetState> {
        self.reset_state.lock()
    }
}

impl Drop for QueryPool {
    fn drop(&mut self) {
        // SAFETY: the owner has waited until the GPU is done with the pool.
        unsafe { self.gpu.device.destroy_query_pool(self.raw, None) };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_come_to_the_fields_of_their_bits() {
        type Flags = vk::QueryPipelineStatisticFlags;
        let of = |kind: QueryKind, numbers: &[u64]| {
            assert_eq!(kind.statistics().as_raw().count_ones() as usize, numbers.len(), "{kind:?}");
            PipelineStatistics::from_values(kind.statistics().as_raw(), numbers)
        };
        let mesh = of(QueryKind::MeshStatistics, &[1, 2, 3, 4]);
        let expected = PipelineStatistics {
            fragment_invocations: 1,
            compute_invocations: 2,
            task_invocations: 3,
            mesh_invocations: 4,
            ..Default::default()
        };
        assert_eq!(mesh, expected);
        let bits = QueryKind::MeshStatistics.statistics();
        let named = [Flags::FRAGMENT_SHADER_INVOCATIONS, Flags::COMPUTE_SHADER_INVOCATIONS];
        let named = named.into_iter().fold(Flags::TASK_SHADER_INVOCATIONS_EXT, |all, bit| all | bit);
        assert_eq!(bits, named | Flags::MESH_SHADER_INVOCATIONS_EXT);
        let plain = of(QueryKind::PipelineStatistics, &[1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11]);
        assert_eq!((plain.input_vertices, plain.clipped_primitives), (1, 6));
        assert_eq!((plain.compute_invocations, plain.task_invocations, plain.mesh_invocations), (11, 0, 0));
        assert!(QueryKind::Timestamps.statistics().is_empty());
    }
}
