//! The passes of the rasteriser: depth alone, then the surfaces that are nearest, with their rays where those are queries.

use lvk::{
    ColorAttachment, ColorTarget, CommandBuffer, CompareOp, Context, DepthAttachment, DepthLoadOp, DepthTest,
    Holder, RenderPass, RenderPassDesc, RenderPipelineDesc, RenderPipelineHandle,
};

use super::body::Body;
use super::frame::Push;
use super::pipelines::{SAMPLE, SURFACE_VERTEX, surface_fragment};
use super::targets::{DEPTH, Targets};
use crate::hybrid::RayPath;

/// Both pipelines.
pub(super) struct Raster {
    depth: Holder<RenderPipelineHandle>,
    surfaces: Holder<RenderPipelineHandle>,
}

/// The bodies to draw, and the targets to draw them to.
pub(super) struct Drawn<'a> {
    pub(super) targets: &'a Targets,
    pub(super) bodies: &'a [Body],
    /// Address of the constants.
    pub(super) frame: u64,
}

impl Raster {
    pub(super) fn new(ctx: &Context, path: RayPath) -> lvk::Result<Self> {
        let (fragment, formats) = surface_fragment(path);
        let vertex = SURFACE_VERTEX.create(ctx, SAMPLE)?;
        let fragment = fragment.create(ctx, SAMPLE)?;
        let colors: Vec<_> = formats.into_iter().map(ColorTarget::from).collect();
        let test = |compare, write| Some(DepthTest { format: DEPTH, compare, write });
        let depth = RenderPipelineDesc {
            vertex: Some(*vertex),
            depth: test(CompareOp::Greater, true),
            debug_name: "depth",
            ..RenderPipelineDesc::default()
        };
        let surfaces = RenderPipelineDesc {
            fragment: Some(*fragment),
            color: &colors,
            depth: test(CompareOp::Equal, false),
            debug_name: "surfaces",
            ..depth
        };
        Ok(Self {
            depth: ctx.create_render_pipeline(&depth)?,
            surfaces: ctx.create_render_pipeline(&surfaces)?,
        })
    }

    /// The nearest depth of each pixel.
    pub(super) fn record_depth(&self, cmd: &mut CommandBuffer, drawn: &Drawn<'_>) -> lvk::Result<()> {
        let mut pass = cmd.begin_rendering(&RenderPassDesc {
            depth: Some(DepthAttachment::clear(*drawn.targets.depth, 0.0)),
            debug_name: "depth",
            ..RenderPassDesc::default()
        })?;
        drawn.draw(&mut pass, *self.depth)
    }

    /// Records the pass that draws surfaces at that depth.
    pub(super) fn record_surfaces(&self, cmd: &mut CommandBuffer, drawn: &Drawn<'_>) -> lvk::Result<()> {
        let colors: Vec<_> = drawn
            .targets
            .colors()
            .into_iter()
            .map(|target| ColorAttachment::clear(target, [0.0; 4]))
            .collect();
        let depth =
            DepthAttachment { load: DepthLoadOp::Load, ..DepthAttachment::clear(*drawn.targets.depth, 0.0) };
        let mut pass = cmd.begin_rendering(&RenderPassDesc {
            color: &colors,
            depth: Some(depth),
            debug_name: "surfaces",
            ..RenderPassDesc::default()
        })?;
        drawn.draw(&mut pass, *self.surfaces)
    }
}

impl Drawn<'_> {
    fn draw(&self, pass: &mut RenderPass<'_>, pipeline: RenderPipelineHandle) -> lvk::Result<()> {
        pass.bind_render_pipeline(pipeline)?;
        for (number, body) in (0..).zip(self.bodies) {
            pass.push_constants(&Push::new(self.frame, number))?;
            pass.draw(0..3 * body.triangle_count, 0..1)?;
        }
        Ok(())
    }
}
