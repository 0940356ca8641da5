//! The passes of the rasteriser: both g-buffers, and the transparent surfaces over the lit picture.

use lvk::{
    Blend, BufferHandle, ColorAttachment, ColorLoadOp, ColorTarget, CommandBuffer, CompareOp, Context,
    Dependencies, DepthAttachment, DepthTest, Holder, IndexFormat, RenderPass, RenderPassDesc,
    RenderPipelineDesc, RenderPipelineHandle, TextureHandle,
};

use super::frame::Push;
use super::gpu_scene::Draw;
use super::pipelines::{BLEND_FRAGMENT, OPAQUE_FRAGMENT, SURFACE_VERTEX, TRANSPARENT_FRAGMENT};
use super::targets::{COMPOSITE_FORMAT, DEPTH_FORMAT, SURFACE_FORMAT, Targets, step};
use crate::pipelines::SampleStage;

/// The pipelines of the three passes.
pub(super) struct RasterPasses {
    opaque: Holder<RenderPipelineHandle>,
    transparent: Holder<RenderPipelineHandle>,
    blend: Holder<RenderPipelineHandle>,
}

/// Geometry that all passes draw.
#[derive(Clone, Copy)]
pub(super) struct Drawn<'a> {
    pub(super) indices: BufferHandle,
    pub(super) opaque: &'a [Draw],
    /// Farthest first.
    pub(super) transparent: &'a [Draw],
    /// Buffers that were written in the same command buffer.
    pub(super) written: &'a [BufferHandle],
    /// Address of the frame's constants.
    pub(super) frame: u64,
}

impl RasterPasses {
    pub(super) fn new(ctx: &Context) -> lvk::Result<Self> {
        let depth = Some(DepthTest { format: DEPTH_FORMAT, compare: CompareOp::Greater, write: true });
        let surface = ColorTarget::from(SURFACE_FORMAT);
        let blended = ColorTarget::blended(COMPOSITE_FORMAT, Blend::PREMULTIPLIED_ALPHA);
        Ok(Self {
            opaque: pipeline(ctx, OPAQUE_FRAGMENT, surface, depth)?,
            transparent: pipeline(ctx, TRANSPARENT_FRAGMENT, surface, depth)?,
            blend: pipeline(ctx, BLEND_FRAGMENT, blended, None)?,
        })
    }

    /// Both g-buffers: the transparent one has the nearest of what the opaque one does not hide.
    pub(super) fn record_surfaces(
        &self,
        cmd: &mut CommandBuffer,
        targets: &Targets,
        drawn: Drawn<'_>,
    ) -> lvk::Result<()> {
        targets.begin(cmd, step::SURFACES)?;
        let written = Dependencies { read_buffers: drawn.written, ..Dependencies::default() };
        let mut pass = begin_surfaces(cmd, targets.opaque(), written, "opaque surfaces")?;
        draw_all(&mut pass, *self.opaque, drawn, drawn.opaque)?;
        drop(pass);
        let behind = [*targets.opaque_depth];
        let read = Dependencies { sampled_images: &behind, ..written };
        let mut pass = begin_surfaces(cmd, targets.glass(), read, "transparent surfaces")?;
        draw_all(&mut pass, *self.transparent, drawn, drawn.transparent)
    }

    /// Lays the transparent surfaces over the lit picture.
    pub(super) fn record_blend(
        &self,
        cmd: &mut CommandBuffer,
        targets: &Targets,
        drawn: Drawn<'_>,
    ) -> lvk::Result<()> {
        targets.begin(cmd, step::BLEND)?;
        let read = [*targets.opaque_depth, *targets.glass_depth, *targets.glass_reflection];
        let composite = ColorAttachment {
            load: ColorLoadOp::Load,
            ..ColorAttachment::clear(*targets.composite, [0.0; 4])
        };
        let mut pass = cmd.begin_rendering(&RenderPassDesc {
            color: &[composite],
            dependencies: Dependencies { sampled_images: &read, ..Dependencies::default() },
            debug_name: "blend",
            ..RenderPassDesc::default()
        })?;
        draw_all(&mut pass, *self.blend, drawn, drawn.transparent)
    }
}

fn begin_surfaces<'a>(
    cmd: &'a mut CommandBuffer,
    [surface, depth]: [TextureHandle; 2],
    dependencies: Dependencies<'_>,
    debug_name: &str,
) -> lvk::Result<RenderPass<'a>> {
    let color = ColorAttachment {
        texture: surface,
        mip: 0,
        layer: 0,
        load: ColorLoadOp::ClearUint([0; 4]),
        store: true,
        resolve: None,
    };
    cmd.begin_rendering(&RenderPassDesc {
        color: &[color],
        depth: Some(DepthAttachment::clear(depth, 0.0)),
        dependencies,
        debug_name,
        ..Default::default()
    })
}

fn draw_all(
    pass: &mut RenderPass<'_>,
    pipeline: RenderPipelineHandle,
    drawn: Drawn<'_>,
    draws: &[Draw],
) -> lvk::Result<()> {
    pass.bind_render_pipeline(pipeline)?;
    pass.bind_index_buffer(drawn.indices, 0, IndexFormat::U16)?;
    for draw in draws {
        pass.push_constants(&Push { frame: drawn.frame, arguments: [draw.geometry, 0, 0, 0] })?;
        pass.draw_indexed(draw.indices.clone(), 0, draw.instances.clone())?;
    }
    Ok(())
}

fn pipeline(
    ctx: &Context,
    fragment: SampleStage,
    color: ColorTarget,
    depth: Option<DepthTest>,
) -> lvk::Result<Holder<RenderPipelineHandle>> {
    let vertex = SURFACE_VERTEX.create(ctx, "reflections")?;
    let module = fragment.create(ctx, "reflections")?;
    ctx.create_render_pipeline(&RenderPipelineDesc {
        vertex: Some(*vertex),
        fragment: Some(*module),
        color: &[color],
        depth,
        debug_name: fragment.name,
        ..RenderPipelineDesc::default()
    })
}
