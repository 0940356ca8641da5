//! Visibility by a rasteriser of compute shaders, in three passes: small triangles, each by a thread; medium ones, each by
//! some threads; large ones in tiles, each by a workgroup. The nearest triangle of each pixel wins, by 64-bit atomic minimum.

use super::pipelines;
use crate::pipelines::SampleStage;
use bytemuck::{Pod, Zeroable};
use lvk::{
    BufferDesc, BufferHandle, BufferUsage, CommandBuffer, ComputePipelineDesc, ComputePipelineHandle,
    Context, Dependencies, Holder, SpecializationConstant, SpecializationValue,
};

use super::config::RasterTuning;
use super::frame::{LAYOUTS, Push, VisibilityAddresses};
use super::shader_module::module;
use crate::app::array_buffer::buffer;

/// Triangles of a workgroup of the first pass (`shaders/hybrid/raster_small.comp.glsl`).
const GROUP: u32 = 128;
/// `constant_id` of the most pixels of a triangle in the first and in the second pass.
const MOST_PIXELS: u32 = 0;
/// Most pixels of a small and of a medium triangle on a GPU.
const GPU_PIXELS: [u32; 2] = [8, 512];
/// The same on a CPU, where a pass costs more and fewer threads wait for the one with the largest triangle.
const CPU_PIXELS: [u32; 2] = [256, 1 << 16];

/// The rasteriser: its pipelines, the words it fills, and the triangles that its first pass sets aside.
pub(super) struct ComputeRaster {
    small: Holder<ComputePipelineHandle>,
    medium: Holder<ComputePipelineHandle>,
    tiles: Holder<ComputePipelineHandle>,
    words: Holder<BufferHandle>,
    words_bytes: u64,
    set_triangles: Holder<BufferHandle>,
    set_capacity: u32,
    tile_list: Holder<BufferHandle>,
    tile_capacity: u32,
    groups: [u32; 3],
}

/// The head of `SetTriangles` and of `Tiles` in `shaders/hybrid/raster.glsl`.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct ListHead {
    groups: [u32; 3],
    count: u32,
}

/// Bytes of `SetTriangle` and of `Tile` there.
const TRIANGLE_BYTES: u64 = 104;
const TILE_BYTES: u64 = 8;

impl ComputeRaster {
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
        let [small, medium] = if ctx.capabilities().is_cpu { CPU_PIXELS } else { GPU_PIXELS };
        let most =
            |pixels| [SpecializationConstant { id: MOST_PIXELS, value: SpecializationValue::U32(pixels) }];
        let small_pixels = most(tuning.small_pixels.unwrap_or(small));
        let medium_pixels = most(tuning.medium_pixels.unwrap_or(medium));
        let set_capacity = tuning.set_aside.min(RasterTuning::MOST_SET_ASIDE);
        let words_bytes = u64::from(extent[0]) * u64::from(extent[1]) * size_of::<u64>() as u64;
        Ok(Self {
            small: pipeline(ctx, &pipelines::RASTER_SMALL_COMP, &small_pixels)?,
            medium: pipeline(ctx, &pipelines::RASTER_MEDIUM_COMP, &medium_pixels)?,
            tiles: pipeline(ctx, &pipelines::RASTER_TILE_COMP, &[])?,
            words: buffer(ctx, "visibility words", words_bytes)?,
            words_bytes,
            set_triangles: list(ctx, u64::from(set_capacity) * TRIANGLE_BYTES, "triangles set aside")?,
            set_capacity,
            tile_list: list(ctx, u64::from(tuning.tiles) * TILE_BYTES, "tiles of triangles")?,
            tile_capacity: tuning.tiles,
            groups: groups_for(triangle_count, GROUP),
        })
    }

    /// Tells the shaders where its buffers are.
    pub(super) fn name_in(&self, places: &mut VisibilityAddresses) -> lvk::Result<()> {
        places.words = self.words.address()?;
        places.set_triangles = self.set_triangles.address()?;
        places.set_capacity = self.set_capacity;
        places.tiles = self.tile_list.address()?;
        places.tile_capacity = self.tile_capacity;
        Ok(())
    }

    /// Resources that the ray pass reads.
    pub(super) fn words(&self) -> BufferHandle {
        self.words.handle()
    }

    /// Records the passes.
    pub(super) fn record(&self, cmd: &mut CommandBuffer, push: &Push) -> lvk::Result<()> {
        const GROUPS: u64 = std::mem::offset_of!(ListHead, groups) as u64;
        const COUNT: u64 = std::mem::offset_of!(ListHead, count) as u64;
        let (words, triangles, tiles) = (*self.words, *self.set_triangles, *self.tile_list);
        cmd.fill_buffer(words, 0, self.words_bytes, u32::MAX)?;
        for (list, word) in [(triangles, GROUPS), (triangles, COUNT), (tiles, GROUPS), (tiles, COUNT)] {
            cmd.fill_buffer(list, word, size_of::<u32>() as u64, 0)?;
        }
        let first = Dependencies { buffers: &[words, triangles], ..Dependencies::default() };
        cmd.bind_compute_pipeline(*self.small)?;
        cmd.push_constants(push)?;
        cmd.dispatch(self.groups, &first)?;
        let second =
            Dependencies { buffers: &[words, tiles], read_buffers: &[triangles], ..Dependencies::default() };
        cmd.bind_compute_pipeline(*self.medium)?;
        cmd.push_constants(push)?;
        cmd.dispatch_indirect(triangles, GROUPS, &second)?;
        let third =
            Dependencies { buffers: &[words], read_buffers: &[triangles, tiles], ..Dependencies::default() };
        cmd.bind_compute_pipeline(*self.tiles)?;
        cmd.push_constants(push)?;
        cmd.dispatch_indirect(tiles, GROUPS, &third)
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
    stage: &SampleStage,
    specialization: &[SpecializationConstant],
) -> lvk::Result<Holder<ComputePipelineHandle>> {
    let (shader, debug_name) = (module(ctx, stage, &[])?, stage.name);
    ctx.create_compute_pipeline(&ComputePipelineDesc {
        module: Some(*shader),
        specialization,
        layouts: LAYOUTS,
        debug_name,
        ..ComputePipelineDesc::default()
    })
}

/// A list with room for items of `bytes` in all.
fn list(ctx: &Context, bytes: u64, debug_name: &str) -> lvk::Result<Holder<BufferHandle>> {
    let head = ListHead { groups: [0, 1, 1], count: 0 };
    let list = ctx.create_buffer(&BufferDesc {
        size_bytes: size_of::<ListHead>() as u64 + bytes,
        usage: BufferUsage::STORAGE | BufferUsage::INDIRECT,
        debug_name,
        ..BufferDesc::default()
    })?;
    ctx.upload_buffer(*list, 0, bytemuck::bytes_of(&head))?;
    Ok(list)
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
}
