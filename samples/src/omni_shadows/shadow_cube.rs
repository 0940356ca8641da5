//! The cube map of depths around the lamp, and both ways to draw it.

use lvk::{
    Channel, CommandBuffer, CompareOp, Context, DepthAttachment, Filter, Holder, RenderPassDesc,
    RenderPipelineHandle, SamplerDesc, SamplerHandle, Swizzle, TextureDesc, TextureHandle, TextureKind,
    TextureUsage, TextureViewDesc,
};

use super::frame::Push;
use super::models::Draw;
use super::pipelines::{ALL_FACES, CUBE, FACE, FACES};

/// The cube map.
pub(super) struct ShadowCube {
    pub(super) texture: Holder<TextureHandle>,
    /// Each face as a picture, with its depth in all channels.
    pub(super) faces: [Holder<TextureHandle>; 6],
    pub(super) size: u32,
}

impl ShadowCube {
    /// Creates a cube map with faces of `size` texels a side.
    pub(super) fn new(ctx: &Context, size: u32) -> lvk::Result<Self> {
        let texture = ctx.create_texture(&TextureDesc {
            kind: TextureKind::Cube,
            format: CUBE,
            extent: [size, size],
            usage: TextureUsage::TARGET | TextureUsage::SAMPLED,
            debug_name: "shadow cube",
            ..TextureDesc::default()
        })?;
        let face = |base_layer| {
            ctx.create_texture_view(&TextureViewDesc {
                texture: Some(*texture),
                kind: Some(TextureKind::D2),
                base_layer,
                swizzle: GREY,
                usage: Some(TextureUsage::SAMPLED),
                debug_name: "face of the shadow cube",
                ..TextureViewDesc::default()
            })
        };
        let faces = [face(0)?, face(1)?, face(2)?, face(3)?, face(4)?, face(5)?];
        Ok(Self { texture, faces, size })
    }
}

/// Samplers of the cube map: nearest comparing, linear comparing, reading.
pub(super) fn samplers(ctx: &Context) -> lvk::Result<[Holder<SamplerHandle>; 3]> {
    let linear = if ctx.format_support(CUBE)?.linear { Filter::Linear } else { Filter::Nearest };
    let sampler = |filter, compare, debug_name| {
        ctx.create_sampler(&SamplerDesc {
            mag_filter: filter,
            min_filter: filter,
            compare,
            debug_name,
            ..SamplerDesc::default()
        })
    };
    // Depth falls with distance: what is at least as near as the nearest is lit.
    let lit = Some(CompareOp::GreaterOrEqual);
    Ok([
        sampler(Filter::Nearest, lit, "nearest comparing")?,
        sampler(linear, lit, "linear comparing")?,
        sampler(Filter::Nearest, None, "reading")?,
    ])
}

/// The pass, or the passes, that draw the cube map.
pub(super) struct CubePass {
    pipeline: Holder<RenderPipelineHandle>,
    is_multiview: bool,
}

impl CubePass {
    pub(super) fn new(ctx: &Context, is_multiview: bool) -> lvk::Result<Self> {
        let pipeline = if is_multiview { FACES } else { FACE };
        Ok(Self { pipeline: pipeline.create(ctx)?, is_multiview })
    }

    /// True if all faces are drawn in one pass.
    pub(super) fn is_multiview(&self) -> bool {
        self.is_multiview
    }

    /// Records the depths around the lamp.
    pub(super) fn record(
        &self,
        cmd: &mut CommandBuffer,
        cube: &ShadowCube,
        draws: &[Draw],
        constants: u64,
    ) -> lvk::Result<()> {
        let (passes, view_mask) = if self.is_multiview { (1, ALL_FACES) } else { (6, 0) };
        for face in 0..passes {
            let depth = DepthAttachment { layer: face, ..DepthAttachment::clear(*cube.texture, 0.0) };
            let desc = RenderPassDesc { depth: Some(depth), view_mask, ..RenderPassDesc::default() };
            let mut pass = cmd.begin_rendering(&desc)?;
            pass.bind_render_pipeline(*self.pipeline)?;
            pass.push_constants(&Push::new(constants, face))?;
            for draw in draws.iter().filter(|draw| draw.casts) {
                pass.draw(draw.corners.clone(), draw.instances.clone())?;
            }
        }
        Ok(())
    }
}

/// Depth in all channels.
const GREY: Swizzle =
    Swizzle { red: Channel::Red, green: Channel::Red, blue: Channel::Red, alpha: Channel::One };
