//! The rasteriser: which triangle each pixel shows.

use lvk::{
    ColorAttachment, ColorLoadOp, ColorTarget, CommandBuffer, CompareOp, Context, Dependencies,
    DepthAttachment, DepthTest, Format, Holder, RenderPassDesc, RenderPipelineDesc, RenderPipelineHandle,
    TextureDesc, TextureHandle, TextureUsage,
};

use crate::gpu::layout::{ALL_INSTANCES, DrawPush, SCENE_LAYOUTS};
use crate::gpu::{Culling, FrameScene};
use crate::pipelines::{SAMPLE, VISIBILITY_FRAGMENT, VISIBILITY_VERTEX};

/// Format of the target: instance, geometry and primitive of each pixel.
pub(crate) const TRIANGLE_FORMAT: Format = Format::Rgba32Uint;
/// Format of depth, which is reversed.
pub(crate) const DEPTH_FORMAT: Format = Format::D32Float;
/// The number of an instance that is not there (`kNothing` in `shaders/viewer/hit.glsl`).
const NOTHING: u32 = u32::MAX;

/// The rasteriser and its targets.
pub(crate) struct Visibility {
    pipeline: Holder<RenderPipelineHandle>,
    triangles: Holder<TextureHandle>,
    depth: Holder<TextureHandle>,
}

impl Visibility {
    pub(crate) fn new(ctx: &Context, extent: [u32; 2]) -> lvk::Result<Self> {
        let target = |format, debug_name, usage| {
            ctx.create_texture(&TextureDesc { format, extent, usage, debug_name, ..TextureDesc::default() })
        };
        Ok(Self {
            pipeline: pipeline(ctx)?,
            triangles: target(
                TRIANGLE_FORMAT,
                "visible triangles",
                TextureUsage::TARGET | TextureUsage::SAMPLED,
            )?,
            depth: target(DEPTH_FORMAT, "depth", TextureUsage::TARGET)?,
        })
    }

    /// The target of triangles.
    pub(crate) fn triangles(&self) -> TextureHandle {
        *self.triangles
    }

    /// The bindless index of the target.
    pub(crate) fn index(&self) -> u32 {
        self.triangles.index()
    }

    /// Records the pass.
    pub(crate) fn record(
        &self,
        cmd: &mut CommandBuffer,
        frame: u64,
        scene: FrameScene<'_>,
    ) -> lvk::Result<()> {
        let color = ColorAttachment {
            texture: *self.triangles,
            mip: 0,
            layer: 0,
            load: ColorLoadOp::ClearUint([NOTHING; 4]),
            store: true,
            resolve: None,
        };
        let reads = scene.culling.map(Culling::reads);
        let read_buffers: Vec<_> = scene.written.iter().copied().chain(reads.into_iter().flatten()).collect();
        let mut pass = cmd.begin_rendering(&RenderPassDesc {
            color: &[color],
            depth: Some(DepthAttachment { store: false, ..DepthAttachment::clear(*self.depth, 0.0) }),
            dependencies: Dependencies { read_buffers: &read_buffers, ..Dependencies::default() },
            debug_name: "visible triangles",
            ..RenderPassDesc::default()
        })?;
        pass.bind_render_pipeline(*self.pipeline)?;
        for (number, draw) in scene.draws.iter().enumerate() {
            let first_visible = scene.culling.map_or(ALL_INSTANCES, |_| draw.instances.start);
            pass.push_constants(&DrawPush { frame, argument: draw.geometry, first_visible })?;
            match scene.culling {
                Some(culling) => culling.draw(&mut pass, number)?,
                None => pass.draw(0..3 * draw.triangle_count, draw.instances.clone())?,
            }
        }
        Ok(())
    }
}

fn pipeline(ctx: &Context) -> lvk::Result<Holder<RenderPipelineHandle>> {
    let vertex = VISIBILITY_VERTEX.create(ctx, SAMPLE)?;
    let fragment = VISIBILITY_FRAGMENT.create(ctx, SAMPLE)?;
    ctx.create_render_pipeline(&RenderPipelineDesc {
        vertex: Some(*vertex),
        fragment: Some(*fragment),
        color: &[ColorTarget::from(TRIANGLE_FORMAT)],
        depth: Some(DepthTest { format: DEPTH_FORMAT, compare: CompareOp::Greater, write: true }),
        layouts: SCENE_LAYOUTS,
        debug_name: "visible triangles",
        ..RenderPipelineDesc::default()
    })
}
