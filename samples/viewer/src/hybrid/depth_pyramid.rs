//! The depth pyramid: for regions of the picture the farthest depth in them.

use bytemuck::{Pod, Zeroable};
use lvk::{BufferHandle, CommandBuffer, ComputePipelineHandle, Context, Dependencies, Holder, TextureHandle};
use lvk_samples::app::array_buffer::buffer;

use crate::launch::compute;
use crate::pipelines::DEPTH_PYRAMID;

/// Levels that a dispatch makes from the one before them.
const LEVELS_OF_DISPATCH: u32 = 5;

lvk::shader_struct! {
    /// `PushConstants` of `depth_pyramid.comp.glsl`.
    #[derive(Debug, Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    struct PyramidPush {
        pyramid: u64,
        pixels: [u32; 2],
        depth_texture: u32,
        source: u32,
    }
}

/// The farthest depths of a picture, as `shaders/viewer/pyramid.glsl` lays them out.
pub(super) struct DepthPyramid {
    pipeline: Holder<ComputePipelineHandle>,
    depths: Holder<BufferHandle>,
    extent: [u32; 2],
}

impl DepthPyramid {
    /// A pyramid over pictures of `extent` pixels.
    pub(super) fn new(ctx: &Context, extent: [u32; 2]) -> lvk::Result<Self> {
        let texels: u64 = (1..=last_level(extent)).map(|level| texel_count(extent, level)).sum();
        Ok(Self {
            pipeline: compute(ctx, DEPTH_PYRAMID, &[])?,
            depths: buffer(ctx, "depth pyramid", size_of::<f32>() as u64 * texels)?,
            extent,
        })
    }

    /// The buffer of all levels.
    pub(super) fn depths(&self) -> BufferHandle {
        *self.depths
    }

    /// Address of the levels.
    pub(super) fn address(&self) -> lvk::Result<u64> {
        self.depths.address()
    }

    /// Records the dispatches that make all levels from a depth texture.
    pub(super) fn record(&self, cmd: &mut CommandBuffer, depth: &Holder<TextureHandle>) -> lvk::Result<()> {
        let dependencies =
            Dependencies { sampled_images: &[**depth], buffers: &[*self.depths], ..Dependencies::default() };
        cmd.bind_compute_pipeline(*self.pipeline)?;
        for source in (0..last_level(self.extent)).step_by(LEVELS_OF_DISPATCH as usize) {
            cmd.push_constants(&PyramidPush {
                pyramid: self.depths.address()?,
                pixels: self.extent,
                depth_texture: depth.index(),
                source,
            })?;
            let [columns, rows] = level_size(self.extent, source + LEVELS_OF_DISPATCH);
            cmd.dispatch([columns, rows, 1], &dependencies)?;
        }
        Ok(())
    }
}

/// Texels of a level (`levelSize`).
fn level_size(extent: [u32; 2], level: u32) -> [u32; 2] {
    extent.map(|pixels| (pixels.max(1) - 1).checked_shr(level).unwrap_or(0) + 1)
}

/// The first level of one texel, at least 1 (`lastLevel`).
fn last_level(extent: [u32; 2]) -> u32 {
    let most = extent[0].max(extent[1]).max(2);
    (most - 1).ilog2() + 1
}

fn texel_count(extent: [u32; 2], level: u32) -> u64 {
    let [columns, rows] = level_size(extent, level);
    u64::from(columns) * u64::from(rows)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_last_level_is_the_first_of_one_texel(extent in [1_u32..20_000, 1_u32..20_000]) {
            let last = last_level(extent);
            prop_assert_eq!(level_size(extent, last), [1, 1]);
            prop_assert!(last == 1 || level_size(extent, last - 1) != [1, 1]);
        }

        #[test]
        fn a_level_has_a_texel_for_each_pixel_and_a_pixel_for_each_texel(
            pixels in 1_u32..20_000,
            level in 0_u32..16,
        ) {
            let [texels, _] = level_size([pixels, 1], level);
            prop_assert_eq!((pixels - 1) >> level, texels - 1);
        }

        #[test]
        fn a_dispatch_covers_its_source(extent in [1_u32..20_000, 1_u32..20_000], source in 0_u32..15) {
            let (size, groups) = (level_size(extent, source), level_size(extent, source + LEVELS_OF_DISPATCH));
            for axis in 0..2 {
                prop_assert_eq!(groups[axis], size[axis].div_ceil(1 << LEVELS_OF_DISPATCH));
            }
        }
    }
}
