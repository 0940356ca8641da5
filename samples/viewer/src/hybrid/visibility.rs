//! The rasteriser: which triangle each pixel shows.

use lvk::{
    ColorAttachment, ColorLoadOp, ColorTarget, CommandBuffer, CompareOp, Context, Dependencies,
    DepthAttachment, DepthTest, Format, Holder, RenderPassDesc, RenderPipelineDesc, RenderPipelineHandle,
    TextureDesc, TextureHandle, TextureUsage,
};
use lvk_samples::app::frame::Frame;

use super::depth_pyramid::DepthPyramid;
use crate::gpu::layout::{
    ALL_INSTANCES, CullingStep, DrawPush, Push, SCENE_LAYOUTS, VisibilityConstants, VisibleTargets,
};
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
    targets: Targets,
    occlusion: Option<Occlusion>,
    extent: [u32; 2],
}

/// Textures that a pass draws to.
struct Targets {
    triangles: Holder<TextureHandle>,
    depth: Holder<TextureHandle>,
}

/// Data of occlusion culling: the depth pyramid of the first pass, and the targets of the second.
struct Occlusion {
    pyramid: DepthPyramid,
    targets: Targets,
}

impl Visibility {
    pub(crate) fn new(ctx: &Context, extent: [u32; 2]) -> lvk::Result<Self> {
        let (pipeline, targets) = (pipeline(ctx)?, Targets::new(ctx, extent)?);
        Ok(Self { pipeline, targets, occlusion: None, extent })
    }

    /// Leaves out what others hide, or no longer. It may be on only while frames are culled.
    pub(crate) fn set_occlusion(&mut self, ctx: &Context, is_on: bool) -> lvk::Result<()> {
        if is_on != self.occlusion.is_some() {
            self.occlusion = is_on.then(|| Occlusion::new(ctx, self.extent)).transpose()?;
        }
        Ok(())
    }

    /// Textures that hold the visible triangles.
    pub(crate) fn textures(&self) -> Vec<TextureHandle> {
        let Some(occlusion) = &self.occlusion else { return vec![*self.targets.triangles] };
        let targets = [&self.targets, &occlusion.targets];
        targets.iter().flat_map(|targets| [*targets.triangles, *targets.depth]).collect()
    }

    /// Indices of the textures with the visible triangles, and the address of the pyramid.
    pub(crate) fn constants(&self) -> lvk::Result<VisibilityConstants> {
        let second = self.occlusion.as_ref().map(|occlusion| occlusion.targets.indices());
        Ok(VisibilityConstants {
            visible1: self.targets.indices(),
            visible2: second.unwrap_or(VisibleTargets::NONE),
            pyramid: self.occlusion.as_ref().map_or(Ok(0), |occlusion| occlusion.pyramid.address())?,
        })
    }

    /// Records all passes, with constants at `frame`.
    pub(crate) fn record(&self, to: &mut Frame<'_>, frame: u64, scene: FrameScene<'_>) -> lvk::Result<()> {
        let push = |step: CullingStep| Push { frame, argument: step as u32, _padding: 0 };
        let Self { targets, occlusion, .. } = self;
        if let Some(culling) = scene.culling {
            let step = occlusion.as_ref().map_or(CullingStep::Frustum, |_| CullingStep::LastVisible);
            to.pass("culling", |cmd| culling.record(cmd, &push(step), None))?;
        }
        to.pass("visible triangles", |cmd| self.draw(cmd, frame, scene, targets))?;
        let (Some(Occlusion { pyramid, targets: second }), Some(culling)) = (occlusion, scene.culling) else {
            return Ok(());
        };
        to.pass("depth pyramid", |cmd| pyramid.record(cmd, &targets.depth))?;
        let depths = Some(pyramid.depths());
        to.pass("occlusion culling", |cmd| culling.record(cmd, &push(CullingStep::Pyramid), depths))?;
        to.pass("newly visible triangles", |cmd| self.draw(cmd, frame, scene, second))
    }

    /// Draws what culling has left, or everything.
    fn draw(
        &self,
        cmd: &mut CommandBuffer,
        frame: u64,
        scene: FrameScene<'_>,
        targets: &Targets,
    ) -> lvk::Result<()> {
        let color = ColorAttachment {
            texture: *targets.triangles,
            mip: 0,
            layer: 0,
            load: ColorLoadOp::ClearUint([NOTHING; 4]),
            store: true,
            resolve: None,
        };
        let store = self.occlusion.is_some();
        let culled = scene.culling.map(Culling::reads).into_iter().flatten();
        let read_buffers: Vec<_> = scene.written.iter().copied().chain(culled).collect();
        let mut pass = cmd.begin_rendering(&RenderPassDesc {
            color: &[color],
            depth: Some(DepthAttachment { store, ..DepthAttachment::clear(*targets.depth, 0.0) }),
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

impl Targets {
    fn new(ctx: &Context, extent: [u32; 2]) -> lvk::Result<Self> {
        let usage = TextureUsage::TARGET | TextureUsage::SAMPLED;
        let target = |format, debug_name| {
            ctx.create_texture(&TextureDesc { format, extent, usage, debug_name, ..TextureDesc::default() })
        };
        Ok(Self {
            triangles: target(TRIANGLE_FORMAT, "visible triangles")?,
            depth: target(DEPTH_FORMAT, "depth")?,
        })
    }

    fn indices(&self) -> VisibleTargets {
        VisibleTargets { triangles: self.triangles.index(), depth: self.depth.index() }
    }
}

impl Occlusion {
    fn new(ctx: &Context, extent: [u32; 2]) -> lvk::Result<Self> {
        Ok(Self { pyramid: DepthPyramid::new(ctx, extent)?, targets: Targets::new(ctx, extent)? })
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
