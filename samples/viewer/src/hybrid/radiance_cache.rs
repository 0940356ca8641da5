//! The radiance cache: a table of light in the world, which paths of the frames before have found.

use lvk::{BufferHandle, CommandBuffer, ComputePipelineHandle, Context, Dependencies, Holder};
use lvk_samples::app::array_buffer::buffer;

use crate::config::ViewerConfig;
use crate::gpu::layout::{CACHE_LAYOUTS, CacheAddresses, GpuCacheCell, GpuUpdatingPath, Push};
use crate::launch::compute;
use crate::pipelines::RADIANCE_CACHE;

/// Entries of a bucket (`kBucketEntries` in `shaders/viewer/radiance_cache_layout.glsl`).
const BUCKET_ENTRIES: u32 = 16;
/// Bytes of the sums of an entry (`kSumWords` there).
const SUM_BYTES: u64 = 16;
/// Side of a block of pixels, of which one updates the cache in each frame (`kBlock` in `shaders/viewer/radiance_cache.glsl`).
const BLOCK: u32 = 4;
/// Buckets of a work group.
const GROUP: u32 = 64;
/// Side of a cell in pixels, and its least and largest share of the distance from the eye.
const CELL_PIXELS: f32 = 16.0;
const CELL_SHARES: [f32; 2] = [0.01, 0.04];

/// The table on the GPU, and the pass that adds what a frame has found.
pub(crate) struct RadianceCache {
    table: Holder<BufferHandle>,
    plan: CachePlan,
    pipeline: Holder<ComputePipelineHandle>,
}

/// What a frame's constants say of the radiance cache.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct CacheConstants {
    pub(crate) addresses: CacheAddresses,
    /// 0 without a cache.
    pub(crate) bucket_count: u32,
}

/// Sizes and offsets in bytes.
#[derive(Debug, Clone, Copy, PartialEq)]
struct CachePlan {
    bucket_count: u32,
    sums: u64,
    cells: u64,
    updating_paths: u64,
    size_bytes: u64,
}

impl RadianceCache {
    pub(crate) fn new(ctx: &Context, config: &ViewerConfig) -> lvk::Result<Self> {
        let plan = CachePlan::new(config.cache_entries, config.extent());
        Ok(Self {
            table: buffer(ctx, "radiance cache", plan.size_bytes)?,
            plan,
            pipeline: compute(ctx, RADIANCE_CACHE, CACHE_LAYOUTS)?,
        })
    }

    pub(crate) fn constants(&self) -> lvk::Result<CacheConstants> {
        let CachePlan { bucket_count, sums, cells, updating_paths, .. } = self.plan;
        let keys = self.table.address()?;
        let addresses = CacheAddresses {
            keys,
            sums: keys + sums,
            cells: keys + cells,
            updating_paths: keys + updating_paths,
        };
        Ok(CacheConstants { addresses, bucket_count })
    }

    pub(crate) fn table(&self) -> BufferHandle {
        *self.table
    }

    /// Records that no entry has light.
    pub(crate) fn clear(&self, cmd: &mut CommandBuffer) -> lvk::Result<()> {
        cmd.fill_buffer(*self.table, 0, self.plan.updating_paths, 0)
    }

    /// Records the pass that adds what the paths of a frame have found.
    pub(crate) fn record(&self, cmd: &mut CommandBuffer, push: &Push) -> lvk::Result<()> {
        cmd.bind_compute_pipeline(*self.pipeline)?;
        cmd.push_constants(push)?;
        let dependencies = Dependencies { buffers: &[*self.table], ..Dependencies::default() };
        cmd.dispatch([self.plan.bucket_count.div_ceil(GROUP), 1, 1], &dependencies)
    }
}

impl CacheConstants {
    /// Those without a cache.
    pub(crate) const NONE: Self =
        Self { addresses: CacheAddresses { keys: 0, sums: 0, cells: 0, updating_paths: 0 }, bucket_count: 0 };
}

impl CachePlan {
    /// A table of at least `entries` entries, for pictures of a size.
    fn new(entries: u32, [width, height]: [u32; 2]) -> Self {
        let bucket_count = entries.div_ceil(BUCKET_ENTRIES);
        let entries = u64::from(bucket_count) * u64::from(BUCKET_ENTRIES);
        let blocks = u64::from(width.div_ceil(BLOCK)) * u64::from(height.div_ceil(BLOCK));
        let sums = 4 * entries;
        let cells = sums + SUM_BYTES * entries;
        let updating_paths = cells + size_of::<GpuCacheCell>() as u64 * entries;
        let size_bytes = updating_paths + size_of::<GpuUpdatingPath>() as u64 * blocks;
        Self { bucket_count, sums, cells, updating_paths, size_bytes }
    }
}

/// The side of a cell over its distance from the eye, where pixels spread like this.
pub(crate) fn cell_share(pixel_spread: f32) -> f32 {
    (CELL_PIXELS * pixel_spread).clamp(CELL_SHARES[0], CELL_SHARES[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_of_the_table_follow_each_other_and_hold_their_elements() {
        let plan = CachePlan::new(33, [9, 4]);
        let entries = 48;
        let (cells, updating_paths) = (20 * entries, 40 * entries);
        let size_bytes = updating_paths + 3 * 116;
        assert_eq!(plan, CachePlan { bucket_count: 3, sums: 4 * entries, cells, updating_paths, size_bytes });
        assert_eq!(CachePlan::new(1, [1, 1]).bucket_count, 1);
    }

    #[test]
    fn cells_are_some_pixels_wide_but_neither_dust_nor_walls() {
        assert_eq!(cell_share(0.00125), 0.02);
        assert_eq!([1e-5, 1.0].map(cell_share), CELL_SHARES);
    }
}
