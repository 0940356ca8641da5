//! The passes from picture to picture: the filters of shadows and reflections, the composite and the final average.

use lvk::{BufferHandle, CommandBuffer, ComputePipelineHandle, Context, Dependencies, Holder, TextureHandle};

use super::animation::compute;
use super::frame::{Push, words};
use super::pipelines::{COMPOSITE, FILTER, RESOLVE, SMOOTH};
use super::ray_passes::GROUP;
use super::targets::{Targets, step};

/// The pipelines.
pub(super) struct ImagePasses {
    smooth: Holder<ComputePipelineHandle>,
    filter: Holder<ComputePipelineHandle>,
    composite: Holder<ComputePipelineHandle>,
    resolve: Holder<ComputePipelineHandle>,
}

impl ImagePasses {
    pub(super) fn new(ctx: &Context) -> lvk::Result<Self> {
        Ok(Self {
            smooth: compute(ctx, SMOOTH)?,
            filter: compute(ctx, FILTER)?,
            composite: compute(ctx, COMPOSITE)?,
            resolve: compute(ctx, RESOLVE)?,
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
        targets.begin(cmd, step::SMOOTH)?;
        let ways = [(&targets.visibility, &targets.smoothed), (&targets.smoothed, &targets.visibility)];
        for (number, (from, to)) in (0..).zip(ways) {
            let arguments = [from.index(), to.index(), number, 0];
            let sampled = [surface, depth, from.handle(), *targets.penumbra];
            run(cmd, targets, *self.smooth, Push { frame, arguments }, &sampled, &[to.handle()], &[])?;
        }
        targets.begin(cmd, step::FILTER)?;
        let ways = [(&targets.reflection, &targets.filtered), (&targets.filtered, &targets.reflection)];
        for (number, (from, to)) in (0..).zip(ways) {
            let arguments = [from.index(), to.index(), number, 0];
            let sampled = [surface, depth, from.handle()];
            run(cmd, targets, *self.filter, Push { frame, arguments }, &sampled, &[to.handle()], &[])?;
        }
        targets.begin(cmd, step::COMPOSITE)?;
        let sampled = [surface, depth, *targets.visibility, *targets.reflection];
        let push = Push { frame, arguments: [0; 4] };
        run(cmd, targets, *self.composite, push, &sampled, &[*targets.composite], &[])
    }

    /// Adds the sample to the picture's sums; the last of `count` samples gives the picture.
    pub(super) fn record_resolve(
        &self,
        cmd: &mut CommandBuffer,
        targets: &Targets,
        frame: u64,
        count: u32,
    ) -> lvk::Result<()> {
        targets.begin(cmd, step::RESOLVE)?;
        let [low, high] = words(targets.sums_address);
        let push = Push { frame, arguments: [low, high, count, 0] };
        run(cmd, targets, *self.resolve, push, &[*targets.composite], &[*targets.picture], &[*targets.sums])
    }
}

fn run(
    cmd: &mut CommandBuffer,
    targets: &Targets,
    pipeline: ComputePipelineHandle,
    push: Push,
    sampled_images: &[TextureHandle],
    storage_images: &[TextureHandle],
    buffers: &[BufferHandle],
) -> lvk::Result<()> {
    cmd.bind_compute_pipeline(pipeline)?;
    cmd.push_constants(&push)?;
    let groups = targets.extent.map(|side| side.div_ceil(GROUP));
    let dependencies = Dependencies { sampled_images, storage_images, buffers, ..Dependencies::default() };
    cmd.dispatch([groups[0], groups[1], 1], &dependencies)
}
