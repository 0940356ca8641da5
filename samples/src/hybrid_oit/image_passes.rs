//! The two compute passes around the others: placing the spheres, and making the picture.

use lvk::{CommandBuffer, ComputePipelineDesc, ComputePipelineHandle, Context, Dependencies, Holder};

use super::buffers::Buffers;
use super::frame::Push;
use super::pipelines::{self as stages, module};
use super::targets::Targets;
use crate::pipelines::SampleStage;

/// Spheres of a work group (`shaders/hybrid_oit/animate.comp.glsl`).
const ANIMATE_GROUP: u32 = 64;
/// Side of a work group in pixels (`shaders/hybrid_oit/composite.comp.glsl`).
const COMPOSITE_GROUP: u32 = 8;

/// The pipelines of both passes.
pub(super) struct ImagePasses {
    animate: Holder<ComputePipelineHandle>,
    composite: Holder<ComputePipelineHandle>,
}

impl ImagePasses {
    /// Compiles the pipelines.
    pub(super) fn new(ctx: &Context) -> lvk::Result<Self> {
        Ok(Self {
            animate: compute_pipeline(ctx, &stages::ANIMATE)?,
            composite: compute_pipeline(ctx, &stages::COMPOSITE)?,
        })
    }

    /// Records the placing of `sphere_count` spheres.
    pub(super) fn record_animate(
        &self,
        cmd: &mut CommandBuffer,
        buffers: &Buffers,
        push: &Push,
        sphere_count: u32,
    ) -> lvk::Result<()> {
        cmd.bind_compute_pipeline(*self.animate)?;
        cmd.push_constants(push)?;
        let writes = [*buffers.spheres, *buffers.boxes, *buffers.records];
        let dependencies = Dependencies { buffers: &writes, ..Dependencies::default() };
        cmd.dispatch([sphere_count.div_ceil(ANIMATE_GROUP), 1, 1], &dependencies)
    }

    /// Records the making of a picture of `pixels`.
    pub(super) fn record_composite(
        &self,
        cmd: &mut CommandBuffer,
        targets: &Targets,
        buffers: &Buffers,
        push: &Push,
        pixels: [u32; 2],
    ) -> lvk::Result<()> {
        cmd.bind_compute_pipeline(*self.composite)?;
        cmd.push_constants(push)?;
        let dependencies = Dependencies {
            sampled_images: &[*targets.position, *targets.surface, *targets.shadow],
            storage_images: &[*targets.picture],
            read_buffers: &[*buffers.spheres, *buffers.heads, *buffers.nodes],
            ..Dependencies::default()
        };
        let [width, height] = pixels.map(|side| side.div_ceil(COMPOSITE_GROUP));
        cmd.dispatch([width, height, 1], &dependencies)
    }
}

/// A pipeline of one compute stage.
pub(super) fn compute_pipeline(
    ctx: &Context,
    stage: &SampleStage,
) -> lvk::Result<Holder<ComputePipelineHandle>> {
    let shader = module(ctx, stage)?;
    let (module, debug_name) = (Some(*shader), stage.name);
    ctx.create_compute_pipeline(&ComputePipelineDesc { module, debug_name, ..ComputePipelineDesc::default() })
}
