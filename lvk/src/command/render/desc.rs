//! Targets of a render pass, as callers describe them.

use crate::command::dependencies::Dependencies;
use crate::gpu::caps::resolve_modes::ResolveMode;
use crate::handle::TextureHandle;

/// What a colour target holds when the pass begins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ColorLoadOp {
    /// What was in it.
    Load,
    /// This colour.
    Clear([f32; 4]),
    /// These integers, for targets of an unsigned integer format.
    ClearUint([u32; 4]),
    /// These integers, for targets of a signed integer format.
    ClearSint([i32; 4]),
    /// Anything; every pixel is drawn.
    DontCare,
}

/// What a depth target holds when the pass begins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DepthLoadOp {
    /// What was in it.
    Load,
    /// This depth, 0 to 1.
    Clear(f32),
    /// Anything.
    DontCare,
}

/// What the stencil of a depth target holds when the pass begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StencilLoadOp {
    /// What was in it.
    Load,
    /// This value.
    Clear(u8),
    /// Anything.
    DontCare,
}

/// What a multisampled colour target is resolved to at the end of the pass: the mean of a pixel's samples, or the first of
/// them where they are integers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Resolve {
    /// A texture of one sample a pixel and the same format, with
    /// [`TextureUsage::TARGET`](crate::TextureUsage::TARGET).
    pub texture: TextureHandle,
    /// Mip level written; of a view, counted from its first.
    pub mip: u32,
    /// Layer written, the first of as many as the pass has.
    pub layer: u32,
}

/// What a multisampled depth target is resolved to at the end of the pass;
/// [`Limits::depth_resolve`](crate::Limits::depth_resolve) says how it can be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DepthResolve {
    /// A texture of one sample a pixel and the same format, with
    /// [`TextureUsage::TARGET`](crate::TextureUsage::TARGET).
    pub texture: TextureHandle,
    /// Mip level written; of a view, counted from its first.
    pub mip: u32,
    /// Layer written, the first of as many as the pass has.
    pub layer: u32,
    /// How depth is resolved; `None` leaves it alone.
    pub depth: Option<ResolveMode>,
    /// How stencil is resolved; `None` leaves it alone. Means nothing to formats without stencil.
    pub stencil: Option<ResolveMode>,
}

/// A colour target of a render pass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ColorAttachment {
    /// A texture with [`TextureUsage::TARGET`](crate::TextureUsage::TARGET).
    pub texture: TextureHandle,
    /// Mip level drawn to; of a view, counted from its first.
    pub mip: u32,
    /// Layer, cube face, or slice of a volume drawn to, the first of them where the pass has several; of a view, counted
    /// from its first.
    pub layer: u32,
    /// What it holds when the pass begins.
    pub load: ColorLoadOp,
    /// Whether what was drawn is kept.
    pub store: bool,
    /// What several samples a pixel are resolved to; the samples themselves need not be kept.
    pub resolve: Option<Resolve>,
}

impl ColorAttachment {
    /// The first mip and layer, cleared to a colour and kept.
    pub fn clear(texture: TextureHandle, color: [f32; 4]) -> Self {
        Self { texture, mip: 0, layer: 0, load: ColorLoadOp::Clear(color), store: true, resolve: None }
    }
}

/// The depth target of a render pass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DepthAttachment {
    /// A texture of a depth format with [`TextureUsage::TARGET`](crate::TextureUsage::TARGET).
    pub texture: TextureHandle,
    /// Mip level drawn to; of a view, counted from its first.
    pub mip: u32,
    /// Layer, cube face, or slice of a volume drawn to, the first of them where the pass has several; of a view, counted
    /// from its first.
    pub layer: u32,
    /// What it holds when the pass begins.
    pub load: DepthLoadOp,
    /// Whether the depth is kept.
    pub store: bool,
    /// What its stencil holds when the pass begins; means nothing to formats without stencil.
    pub stencil: StencilLoadOp,
    /// Whether the stencil is kept.
    pub stencil_store: bool,
    /// Depth and stencil are loaded and tested, and never written. The texture may be sampled meanwhile, where the pass's
    /// dependencies list it.
    pub read_only: bool,
    /// What several samples a pixel are resolved to.
    pub resolve: Option<DepthResolve>,
}

/// Where a render pass takes shading rates from: a texel for each few pixels of the targets, of all layers and views alike.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ShadingRateAttachment {
    /// A texture with [`TextureUsage::SHADING_RATE`](crate::TextureUsage::SHADING_RATE), whose texels are as
    /// [`ShadingRate::texel`](crate::ShadingRate::texel) answers.
    pub texture: TextureHandle,
    /// Mip level read; of a view, counted from its first.
    pub mip: u32,
    /// Layer read; of a view, counted from its first.
    pub layer: u32,
    /// How many pixels a texel stands for, as [`Limits::shading_rate`](crate::Limits::shading_rate) allows.
    pub texel: [u32; 2],
}

impl ShadingRateAttachment {
    /// The first mip and layer.
    pub fn new(texture: TextureHandle, texel: [u32; 2]) -> Self {
        Self { texture, mip: 0, layer: 0, texel }
    }
}

impl DepthAttachment {
    /// The first mip and layer, cleared to a depth and the stencil 0, and kept.
    pub fn clear(texture: TextureHandle, depth: f32) -> Self {
        Self {
            texture,
            mip: 0,
            layer: 0,
            load: DepthLoadOp::Clear(depth),
            store: true,
            stencil: StencilLoadOp::Clear(0),
            stencil_store: true,
            read_only: false,
            resolve: None,
        }
    }

    /// The first mip and layer, with what is in them, and kept.
    pub fn load(texture: TextureHandle) -> Self {
        Self { load: DepthLoadOp::Load, stencil: StencilLoadOp::Load, ..Self::clear(texture, 0.0) }
    }

    /// The first mip and layer, tested and not written.
    pub fn read_only(texture: TextureHandle) -> Self {
        Self { read_only: true, ..Self::load(texture) }
    }
}

/// Describes a render pass.
#[derive(Debug, Clone, Copy, Default)]
pub struct RenderPassDesc<'a> {
    /// Colour targets, in the order of the shaders' outputs.
    pub color: &'a [ColorAttachment],
    /// Depth and stencil target.
    pub depth: Option<DepthAttachment>,
    /// How many layers each target has, from its own first on; 0 and 1 are one. Draws choose theirs by `gl_Layer`, in the
    /// geometry and mesh stages, and with
    /// [`OptionalFeature::ShaderOutputLayer`](crate::OptionalFeature::ShaderOutputLayer) in the vertex stage.
    pub layers: u32,
    /// Views that each draw makes at once, a bit for each: bit `i` draws to the layer `i` of each target, counted from the
    /// target's own first, and shaders know it by `gl_ViewIndex` (`#extension GL_EXT_multiview`). 0 for one picture.
    /// Needs [`OptionalFeature::Multiview`](crate::OptionalFeature::Multiview); at most
    /// [`Limits::max_views`](crate::Limits::max_views).
    pub view_mask: u32,
    /// The pixels that are loaded, cleared, drawn and stored: x, y, width and height. `None` for all.
    pub area: Option<[u32; 4]>,
    /// Fragment shaders read those targets that have [`TextureUsage::INPUT`](crate::TextureUsage::INPUT), each at its own
    /// pixel: what earlier draws of the pass have put there (`LVK_INPUT`, `LVK_DEPTH_INPUT`, `LVK_STENCIL_INPUT` and
    /// `subpassLoad`). Needs [`OptionalFeature::LocalRead`](crate::OptionalFeature::LocalRead).
    pub local_read: bool,
    /// Where pipelines take the sizes of fragments from that combine their
    /// [`shading_rate`](crate::RenderPipelineDesc::shading_rate) with it.
    pub shading_rate: Option<ShadingRateAttachment>,
    /// What the pass's shaders reach bindlessly, and what its draws read that was written earlier in the same command
    /// buffer: no barrier can be placed inside a pass. Acceleration structures need not be listed.
    pub dependencies: Dependencies<'a>,
    /// Name of the pass in debuggers; empty for none.
    pub debug_name: &'a str,
}
