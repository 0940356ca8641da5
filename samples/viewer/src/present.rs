//! The picture of the mean of all samples.

use lvk::{BufferHandle, CommandBuffer, ComputePipelineHandle, Context, Dependencies, Holder, TextureHandle};

use crate::gpu::layout::{FRAME_LAYOUT, Push};
use crate::launch::{compute, groups};
use crate::pipelines::PRESENT;

/// Exposes, maps and encodes sums.
pub(crate) struct Present {
    pipeline: Holder<ComputePipelineHandle>,
}

impl Present {
    pub(crate) fn new(ctx: &Context) -> lvk::Result<Self> {
        Ok(Self { pipeline: compute(ctx, PRESENT, FRAME_LAYOUT)? })
    }

    /// Records the pass that stores `image` from `sums`.
    pub(crate) fn record(
        &self,
        cmd: &mut CommandBuffer,
        push: &Push,
        sums: BufferHandle,
        image: TextureHandle,
        extent: [u32; 2],
    ) -> lvk::Result<()> {
        cmd.bind_compute_pipeline(*self.pipeline)?;
        cmd.push_constants(push)?;
        let dependencies =
            Dependencies { read_buffers: &[sums], storage_images: &[image], ..Dependencies::default() };
        cmd.dispatch(groups(extent), &dependencies)
    }
}
