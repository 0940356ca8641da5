//! Raster passes: depth and G-buffer of opaque geometry, and the lists of glass.

use lvk::{
    ColorAttachment, ColorLoadOp, ColorTarget, CommandBuffer, CompareOp, Context, Dependencies,
    DepthAttachment, DepthLoadOp, DepthTest, Holder, RenderPass, RenderPassDesc, RenderPipelineDesc,
    RenderPipelineHandle,
};

use super::buffers::Buffers;
use super::frame::Push;
use super::pipelines::{self as stages, module};
use super::scene::OitScene;
use super::targets::Targets;
use crate::pipelines::SampleStage;

/// Vertices of the square that covers a sphere.
const SQUARE: u32 = 6;

/// The pipelines of the three passes, and what they draw.
pub(super) struct RasterPasses {
    solid_depth: Holder<RenderPipelineHandle>,
    ball_depth: Holder<RenderPipelineHandle>,
    solid: Holder<RenderPipelineHandle>,
    ball: Holder<RenderPipelineHandle>,
    glass: Holder<RenderPipelineHandle>,
    vertex_count: u32,
    ball_count: u32,
    glass_count: u32,
}

/// The resources of all passes.
pub(super) struct PassInputs<'a> {
    pub(super) targets: &'a Targets,
    pub(super) buffers: &'a Buffers,
    pub(super) push: &'a Push,
}

impl RasterPasses {
    /// Compiles the pipelines.
    pub(super) fn new(ctx: &Context, scene: &OitScene, buffers: &Buffers) -> lvk::Result<Self> {
        let gbuffer = Targets::GBUFFER.map(ColorTarget::from);
        // Depth is reversed, so nearer is greater. The G-buffer pass draws what the depth pass has found.
        let nearest = depth_test(CompareOp::Greater, true);
        let visible = depth_test(CompareOp::GreaterOrEqual, false);
        Ok(Self {
            solid_depth: pipeline(ctx, &stages::SOLID_DEPTH, &[], nearest, "solid depth")?,
            ball_depth: pipeline(ctx, &stages::BALL_DEPTH, &[], nearest, "ball depth")?,
            solid: pipeline(ctx, &stages::SOLID, &gbuffer, visible, "solid")?,
            ball: pipeline(ctx, &stages::BALL, &gbuffer, visible, "ball")?,
            glass: pipeline(ctx, &stages::GLASS, &[], visible, "glass")?,
            vertex_count: buffers.vertex_count,
            ball_count: scene.balls.len() as u32,
            glass_count: scene.glass.len() as u32,
        })
    }

    /// Records the depth pass.
    pub(super) fn record_depth(&self, cmd: &mut CommandBuffer, inputs: &PassInputs<'_>) -> lvk::Result<()> {
        let PassInputs { targets, buffers, push } = *inputs;
        let pass = cmd.begin_rendering(&RenderPassDesc {
            depth: Some(DepthAttachment::clear(*targets.depth, 0.0)),
            dependencies: Dependencies { read_buffers: &[*buffers.spheres], ..Dependencies::default() },
            debug_name: "depth",
            ..RenderPassDesc::default()
        })?;
        self.draw_opaque(pass, [*self.solid_depth, *self.ball_depth], push)
    }

    /// Records the G-buffer pass.
    pub(super) fn record_gbuffer(&self, cmd: &mut CommandBuffer, inputs: &PassInputs<'_>) -> lvk::Result<()> {
        let PassInputs { targets, buffers, push } = *inputs;
        let surface = ColorAttachment {
            load: ColorLoadOp::ClearUint([0; 4]),
            ..ColorAttachment::clear(*targets.surface, [0.0; 4])
        };
        let pass = cmd.begin_rendering(&RenderPassDesc {
            color: &[ColorAttachment::clear(*targets.position, [0.0; 4]), surface],
            depth: Some(kept_depth(targets)),
            dependencies: Dependencies { read_buffers: &[*buffers.spheres], ..Dependencies::default() },
            debug_name: "g-buffer",
            ..Default::default()
        })?;
        self.draw_opaque(pass, [*self.solid, *self.ball], push)
    }

    /// Records the pass that empties the lists of glass and fills them.
    pub(super) fn record_glass(
        &self,
        cmd: &mut CommandBuffer,
        inputs: &PassInputs<'_>,
        samples: u64,
    ) -> lvk::Result<()> {
        let PassInputs { targets, buffers, push } = *inputs;
        cmd.fill_buffer(*buffers.heads, 0, 4 * samples, u32::MAX)?;
        cmd.fill_buffer(*buffers.node_count, 0, 4, 0)?;
        let mut pass = cmd.begin_rendering(&RenderPassDesc {
            depth: Some(kept_depth(targets)),
            dependencies: Dependencies {
                sampled_images: &[*targets.position],
                buffers: &[*buffers.heads, *buffers.node_count, *buffers.nodes],
                read_buffers: &[*buffers.spheres, *buffers.glass_light],
                ..Dependencies::default()
            },
            debug_name: "glass",
            ..RenderPassDesc::default()
        })?;
        pass.bind_render_pipeline(*self.glass)?;
        pass.push_constants(push)?;
        pass.draw(0..SQUARE, self.ball_count..self.ball_count + self.glass_count)
    }

    fn draw_opaque(
        &self,
        mut pass: RenderPass<'_>,
        [solid, ball]: [RenderPipelineHandle; 2],
        push: &Push,
    ) -> lvk::Result<()> {
        pass.bind_render_pipeline(solid)?;
        pass.push_constants(push)?;
        pass.draw(0..self.vertex_count, 0..1)?;
        pass.bind_render_pipeline(ball)?;
        pass.push_constants(push)?;
        pass.draw(0..SQUARE, 0..self.ball_count)
    }
}

fn kept_depth(targets: &Targets) -> DepthAttachment {
    DepthAttachment { load: DepthLoadOp::Load, ..DepthAttachment::clear(*targets.depth, 0.0) }
}

fn depth_test(compare: CompareOp, write: bool) -> DepthTest {
    DepthTest { format: Targets::DEPTH, compare, write }
}

/// A pipeline of a vertex stage and, where there is one, a fragment stage.
fn pipeline(
    ctx: &Context,
    stages: &[SampleStage],
    color: &[ColorTarget],
    depth: DepthTest,
    debug_name: &str,
) -> lvk::Result<Holder<RenderPipelineHandle>> {
    let modules = stages.iter().map(|stage| module(ctx, stage)).collect::<lvk::Result<Vec<_>>>()?;
    ctx.create_render_pipeline(&RenderPipelineDesc {
        vertex: modules.first().map(Holder::handle),
        fragment: modules.get(1).map(Holder::handle),
        color,
        depth: Some(depth),
        debug_name,
        ..RenderPipelineDesc::default()
    })
}
