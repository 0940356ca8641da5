//! Visibility by a rasteriser of compute shaders: every triangle a thread, large ones in tiles, and the nearest
//! one of each pixel by 64-bit atomic minimum.

use bytemuck::{Pod, Zeroable};
use lvk::{
    BufferDesc, BufferHandle, BufferUsage, CommandBuffer, ComputePipelineDesc, ComputePipelineHandle,
    Context, Dependencies, Holder, ShaderStage, SpecializationConstant, SpecializationValue,
};

use super::config::RasterTuning;
use super::frame::{Push, VisibilityPlaces};
use super::shader_module::module;
use crate::shaders::hybrid as texts;

/// Triangles of a workgroup (`shaders/hybrid/raster_small.comp.glsl`).
const GROUP: u32 = 128;
/// `constant_id` of the pixels of a small triangle (`shaders/hybrid/raster_small.comp.glsl`).
const SMALL_CONSTANT: u32 = 0;
/// Pixels of a small triangle on a GPU, where neighbours wait for the thread with the largest one.
const GPU_SMALL_PIXELS: u32 = 32;
/// The same on a CPU, where a workgroup for a tile costs more than waiting.
const CPU_SMALL_PIXELS: u32 = 1 << 16;
/// Bytes at the start of the queue that each frame sets to 0: the count and the first argument.
const QUEUE_RESET_BYTES: u64 = 12;

/// The rasteriser: its pipelines, the words it fills and its queue.
pub(super) struct ComputeRaster {
    small: Holder<ComputePipelineHandle>,
    tiles: Holder<ComputePipelineHandle>,
    words: Holder<BufferHandle>,
    words_bytes: u64,
    queue: Holder<BufferHandle>,
    groups: [u32; 3],
}

/// The head of `TileQueue` in `shaders/hybrid/raster.glsl`; tiles of 8 bytes follow.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct QueueHead {
    count: [u32; 2],
    groups: [u32; 3],
    capacity: u32,
}

impl ComputeRaster {
    const TILE_BYTES: u64 = 8;

    /// The rasteriser of `triangle_count` triangles for a picture of `extent` pixels.
    ///
    /// # Errors
    /// [`lvk::Error::Unsupported`] where the device lacks 64-bit atomics.
    pub(super) fn new(
        ctx: &Context,
        triangle_count: u32,
        extent: [u32; 2],
        tuning: &RasterTuning,
    ) -> lvk::Result<Self> {
        let suited = if ctx.capabilities().is_cpu { CPU_SMALL_PIXELS } else { GPU_SMALL_PIXELS };
        let value = SpecializationValue::U32(tuning.small_pixels.unwrap_or(suited));
        let small_pixels = [SpecializationConstant { id: SMALL_CONSTANT, value }];
        let small = pipeline(ctx, texts::RASTER_SMALL_COMP, &small_pixels, "raster_small.comp")?;
        let tiles = pipeline(ctx, texts::RASTER_TILE_COMP, &[], "raster_tile.comp")?;
        let words_bytes = u64::from(extent[0]) * u64::from(extent[1]) * size_of::<u64>() as u64;
        let words = ctx.create_buffer(&BufferDesc {
            size_bytes: words_bytes,
            debug_name: "visibility words",
            ..BufferDesc::default()
        })?;
        let groups = groups_for(triangle_count, GROUP);
        Ok(Self { small, tiles, words, words_bytes, queue: queue(ctx, tuning.queue_tiles)?, groups })
    }

    /// Tells the shaders where its buffers are.
    pub(super) fn name_in(&self, ctx: &Context, places: &mut VisibilityPlaces) -> lvk::Result<()> {
        places.words = ctx.buffer_address(*self.words)?;
        places.tile_queue = ctx.buffer_address(*self.queue)?;
        Ok(())
    }

    /// What the ray pass reads.
    pub(super) fn words(&self) -> BufferHandle {
        self.words.handle()
    }

    /// Records the pass.
    pub(super) fn record(&self, cmd: &mut CommandBuffer, push: &Push) -> lvk::Result<()> {
        let (words, queue) = (self.words.handle(), self.queue.handle());
        cmd.fill_buffer(words, 0, self.words_bytes, u32::MAX)?;
        cmd.fill_buffer(queue, 0, QUEUE_RESET_BYTES, 0)?;
        let both = Dependencies { buffers: &[words, queue], ..Dependencies::default() };
        cmd.bind_compute_pipeline(*self.small)?;
        cmd.push_constants(push)?;
        cmd.dispatch(self.groups, &both)?;
        let tiles = Dependencies { buffers: &[words], read_buffers: &[queue], ..Dependencies::default() };
        cmd.bind_compute_pipeline(*self.tiles)?;
        cmd.push_constants(push)?;
        let arguments = std::mem::offset_of!(QueueHead, groups) as u64;
        cmd.dispatch_indirect(queue, arguments, &tiles)
    }
}

/// Workgroups of `size` threads for `count` items, in two dimensions, since one may not be long enough.
pub(super) fn groups_for(count: u32, size: u32) -> [u32; 3] {
    const LONGEST: u32 = 65_535;
    let groups = count.div_ceil(size);
    let rows = groups.div_ceil(LONGEST).max(1);
    [groups.div_ceil(rows), rows, 1]
}

fn pipeline(
    ctx: &Context,
    text: &str,
    specialization: &[SpecializationConstant],
    debug_name: &str,
) -> lvk::Result<Holder<ComputePipelineHandle>> {
    let shader = module(ctx, ShaderStage::Compute, text, &[], debug_name)?;
    ctx.create_compute_pipeline(&ComputePipelineDesc { module: Some(*shader), specialization, debug_name })
}

fn queue(ctx: &Context, capacity: u32) -> lvk::Result<Holder<BufferHandle>> {
    let head = QueueHead { count: [0; 2], groups: [0, 1, 1], capacity };
    let queue = ctx.create_buffer(&BufferDesc {
        size_bytes: size_of::<QueueHead>() as u64 + u64::from(capacity) * ComputeRaster::TILE_BYTES,
        usage: BufferUsage::STORAGE | BufferUsage::INDIRECT,
        debug_name: "tile queue",
        ..BufferDesc::default()
    })?;
    ctx.upload_buffer(*queue, 0, bytemuck::bytes_of(&head))?;
    Ok(queue)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_triangle_has_a_thread_and_no_axis_is_too_long() {
        for (count, size) in
            [(1, 128), (128, 128), (129, 128), (1 << 24, 128), (u32::MAX / 3, 128), (1 << 24, 256)]
        {
            let [x, y, z] = groups_for(count, size);
            assert!(x <= 65_535 && y <= 65_535 && z == 1, "{count}: {x} {y}");
            assert!(u64::from(x) * u64::from(y) * u64::from(size) >= u64::from(count), "{count}: {x} {y}");
            assert!(
                u64::from(x) * u64::from(y) * u64::from(size) < u64::from(count + (y + 1) * size),
                "{count}"
            );
        }
    }

    #[test]
    fn the_queue_head_is_the_shaders() {
        assert_eq!(size_of::<QueueHead>(), 24);
        assert_eq!(std::mem::offset_of!(QueueHead, groups), 8);
    }
}
