//! The cube map, and both ways to draw its faces.

use crate::app::render_target::RenderTarget;
use lvk::{
    ColorAttachment, CommandBuffer, Context, DepthAttachment, Format, Holder, RenderPass, RenderPassDesc,
    SamplerDesc, SamplerHandle, TextureDesc, TextureHandle, TextureKind, TextureMemory, TextureUsage,
};

use super::config::CubeMapFaces;

/// CubeMapFaces of a cube.
pub(super) const FACES: u32 = 6;
/// A bit for each.
pub(super) const ALL_FACES: u32 = (1 << FACES) - 1;
/// Linear light, brighter than white too.
pub(super) const COLOR: Format = Format::Rgba16Float;
/// The faces in their order, for debuggers and the profiler.
const NAMES: [&str; FACES as usize] = ["+x", "-x", "+y", "-y", "+z", "-z"];

/// A cube map that is drawn in every frame.
pub(super) struct CubeMap {
    pub(super) texture: Holder<TextureHandle>,
    pub(super) sampler: Holder<SamplerHandle>,
    pub(super) mips: u32,
    depth: Holder<TextureHandle>,
}

impl CubeMap {
    /// Creates a cube map with faces of `size` pixels a side, and all mips.
    pub(super) fn new(ctx: &Context, size: u32) -> lvk::Result<Self> {
        let color = TextureDesc {
            kind: TextureKind::Cube,
            format: COLOR,
            extent: [size; 2],
            mips: 0,
            usage: TextureUsage::TARGET | TextureUsage::SAMPLED,
            debug_name: "cube map",
            ..TextureDesc::default()
        };
        let depth = TextureDesc {
            kind: TextureKind::D2Array { layers: FACES },
            format: RenderTarget::DEPTH,
            mips: 1,
            usage: TextureUsage::TARGET,
            memory: TextureMemory::Transient,
            debug_name: "depth of the cube map",
            ..color
        };
        Ok(Self {
            texture: ctx.create_texture(&color)?,
            sampler: ctx.create_sampler(&SamplerDesc::default())?,
            mips: 1 + size.max(1).ilog2(),
            depth: ctx.create_texture(&depth)?,
        })
    }

    /// Records all faces and their mips. `draw` draws the view with the number that it is told; in one pass it is told 0, and
    /// shaders know views by `gl_ViewIndex`.
    pub(super) fn record(
        &self,
        cmd: &mut CommandBuffer,
        faces: CubeMapFaces,
        draw: impl Fn(&mut RenderPass<'_>, u32) -> lvk::Result<()>,
    ) -> lvk::Result<()> {
        match faces {
            CubeMapFaces::OnePass => draw(&mut self.begin(cmd, "all faces", 0, ALL_FACES)?, 0)?,
            CubeMapFaces::SixPasses => {
                for (face, name) in (0..).zip(NAMES) {
                    draw(&mut self.begin(cmd, name, face, 0)?, face)?;
                }
            }
        }
        cmd.generate_mipmaps(*self.texture)
    }

    /// Begins a pass over the face with this number, or over those of `view_mask`, if it is not 0. The sky covers every pixel.
    fn begin<'c>(
        &self,
        cmd: &'c mut CommandBuffer,
        debug_name: &str,
        layer: u32,
        view_mask: u32,
    ) -> lvk::Result<RenderPass<'c>> {
        let color = ColorAttachment { layer, ..ColorAttachment::clear(*self.texture, [0.0; 4]) };
        let depth = DepthAttachment {
            layer,
            store: false,
            stencil_store: false,
            ..DepthAttachment::clear(*self.depth, 0.0)
        };
        cmd.begin_rendering(&RenderPassDesc {
            color: &[color],
            depth: Some(depth),
            view_mask,
            debug_name,
            ..RenderPassDesc::default()
        })
    }
}
