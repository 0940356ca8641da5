//! The passes from picture to picture: the filters of shadows and reflections, the composite and the final average.

use lvk::{
    BufferDesc, BufferHandle, CommandBuffer, ComputePipelineHandle, Context, Dependencies, Holder,
    TextureHandle,
};

use super::frame::{Push, words};
use super::moving::compute;
use super::pipelines::{COMPOSITE, FILTER, RESOLVE, SMOOTH};
use super::ray_passes::GROUP;
use super::targets::Targets;

/// The pipelines, and the sums of the samples.
pub(super) struct ImagePasses {
    smooth: Holder<ComputePipelineHandle>,
    filter: Holder<ComputePipelineHandle>,
    composite: Holder<ComputePipelineHandle>,
    resolve: Holder<ComputePipelineHandle>,
    sums: Holder<BufferHandle>,
    sums_address: u64,
    extent: [u32; 2],
}

impl ImagePasses {
    pub(super) fn new(ctx: &Context, extent: [u32; 2]) -> lvk::Result<Self> {
        let size_bytes = u64::from(extent[0]) * u64::from(extent[1]) * size_of::<[f32; 4]>() as u64;
        let sums =
            ctx.create_buffer(&BufferDesc { size_bytes, debug_name: "sums", ..BufferDesc::default() })?;
        Ok(Self {
            smooth: compute(ctx, SMOOTH)?,
            filter: compute(ctx, FILTER)?,
            composite: compute(ctx, COMPOSITE)?,
            resolve: compute(ctx, RESOLVE)?,
            sums_address: ctx.buffer_address(*sums)?,
            sums,
            extent,
        })
    }

    /// Smooths shadows and filters reflections, both twice, there and back again, and lights the opaque surfaces with
    /// them.
    pub(super) fn record_composite(
        &self,
        cmd: &mut CommandBuffer,
        targets: &Targets,
        frame: u64,
    ) -> lvk::Result<()> {
        let [surface, depth] = targets.opaque();
        let ways = [(&targets.visibility, &targets.smoothed), (&targets.smoothed, &targets.visibility)];
        for (number, (from, to)) in (0..).zip(ways) {
            let arguments = [from.index(), to.index(), number, 0];
            let sampled = [surface, depth, from.handle(), *targets.penumbra];
            self.run(cmd, *self.smooth, Push { frame, arguments }, &sampled, &[to.handle()], &[])?;
        }
        let ways = [(&targets.reflection, &targets.filtered), (&targets.filtered, &targets.reflection)];
        for (number, (from, to)) in (0..).zip(ways) {
            let arguments = [from.index(), to.index(), number, 0];
            let sampled = [surface, depth, from.handle()];
            self.run(cmd, *self.filter, Push { frame, arguments }, &sampled, &[to.handle()], &[])?;
        }
        let sampled = [surface, depth, *targets.visibility, *targets.reflection];
        let push = Push { frame, arguments: [0; 4] };
        self.run(cmd, *self.composite, push, &sampled, &[*targets.composite], &[])
    }

    /// Adds the sample to the picture's sums; the last of `count` samples gives the picture.
    pub(super) fn record_resolve(
        &self,
        cmd: &mut CommandBuffer,
        targets: &Targets,
        frame: u64,
        count: u32,
    ) -> lvk::Result<()> {
        let [low, high] = words(self.sums_address);
        let push = Push { frame, arguments: [low, high, count, 0] };
        self.run(cmd, *self.resolve, push, &[*targets.composite], &[*targets.picture], &[*self.sums])
    }

    fn run(
        &self,
        cmd: &mut CommandBuffer,
        pipeline: ComputePipelineHandle,
        push: Push,
        sampled_images: &[TextureHandle],
        storage_images: &[TextureHandle],
        buffers: &[BufferHandle],
    ) -> lvk::Result<()> {
        cmd.bind_compute_pipeline(pipeline)?;
        cmd.push_constants(&push)?;
        let groups = self.extent.map(|side| side.div_ceil(GROUP));
        let dependencies =
            Dependencies { sampled_images, storage_images, buffers, ..Dependencies::default() };
        cmd.dispatch([groups[0], groups[1], 1], &dependencies)
    }
}
