//! The pass that draws the picture: surfaces, and the cube map unfolded in a corner.

use crate::app::render_target::RenderTarget;
use lvk::{
    CommandBuffer, Context, CullMode, Dependencies, Holder, RenderPipelineDesc, RenderPipelineHandle,
    TextureHandle, Topology,
};

use super::frame::Push;
use super::models::Draw;
use super::pipelines::{SURFACES, UNFOLDED};

/// Pipelines of the pass that draws the scene.
pub(super) struct ScenePass {
    surfaces: Holder<RenderPipelineHandle>,
    unfolded: Holder<RenderPipelineHandle>,
}

impl ScenePass {
    pub(super) fn new(ctx: &Context) -> lvk::Result<Self> {
        // Walls seen from outside are left out.
        let seen = RenderPipelineDesc { cull: CullMode::Back, ..RenderPipelineDesc::default() };
        let strip = RenderPipelineDesc { topology: Topology::TriangleStrip, ..RenderPipelineDesc::default() };
        Ok(Self { surfaces: SURFACES.create_with(ctx, &seen)?, unfolded: UNFOLDED.create_with(ctx, &strip)? })
    }

    /// Draws the picture in the light that the cube map of shadows leaves, and that over it where it is wanted.
    pub(super) fn record(
        &self,
        cmd: &mut CommandBuffer,
        target: &RenderTarget,
        cube: TextureHandle,
        draws: &[Draw],
        (frame, shows_cube): (u64, bool),
    ) -> lvk::Result<()> {
        let reads = Dependencies { sampled_images: &[cube], ..Dependencies::default() };
        let mut pass = target.begin(cmd, "surfaces", [0.0; 3], &reads)?;
        pass.bind_render_pipeline(*self.surfaces)?;
        pass.push_constants(&Push::new(frame, 0))?;
        // Floor and walls come last, as much of them is hidden.
        for draw in draws.iter().rev() {
            pass.draw(draw.corners.clone(), draw.instances.clone())?;
        }
        if shows_cube {
            pass.bind_render_pipeline(*self.unfolded)?;
            pass.draw(0..4, 0..6)?;
        }
        Ok(())
    }
}
