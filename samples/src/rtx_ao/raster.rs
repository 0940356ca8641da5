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
    pub(super) fn record_depth(
        &self,
        cmd: &mut CommandBuffer,
        targets: &Targets,
        bodies: &[Body],
        frame: u64,
    ) -> lvk::Result<()> {
        let mut pass = cmd.begin_rendering(&RenderPassDesc {
            depth: Some(DepthAttachment::clear(*targets.depth, 0.0)),
            debug_name: "depth",
            ..RenderPassDesc::default()
        })?;
        draw_all(&mut pass, *self.depth, bodies, frame)
    }

    /// Records the pass that draws surfaces at that depth.
    pub(super) fn record_surfaces(
        &self,
        cmd: &mut CommandBuffer,
        targets: &Targets,
        bodies: &[Body],
        frame: u64,
    ) -> lvk::Result<()> {
        let colors: Vec<_> =
            targets.colors().into_iter().map(|target| ColorAttachment::clear(target, [0.0; 4])).collect();
        let depth =
            DepthAttachment { load: DepthLoadOp::Load, ..DepthAttachment::clear(*targets.depth, 0.0) };
        let mut pass = cmd.begin_rendering(&RenderPassDesc {
            color: &colors,
            depth: Some(depth),
            debug_name: "surfaces",
            ..RenderPassDesc::default()
        })?;
        draw_all(&mut pass, *self.surfaces, bodies, frame)
    }
}

fn draw_all(
    pass: &mut RenderPass<'_>,
    pipeline: RenderPipelineHandle,
    bodies: &[Body],
    frame: u64,
) -> lvk::Result<()> {
    pass.bind_render_pipeline(pipeline)?;
    for (number, body) in (0..).zip(bodies) {
        pass.push_constants(&Push::new(frame, number))?;
        pass.draw(0..3 * body.triangle_count, 0..1)?;
    }
    Ok(())
}
