//! Descriptions of render passes and their targets.

use crate::command::dependencies::Dependencies;
use crate::gpu::caps::resolve_modes::ResolveMode;
use crate::handle::TextureHandle;

/// Contents of a colour target when the pass begins (`VkAttachmentLoadOp`).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ColorLoadOp {
    /// The previous contents.
    Load,
    /// The given colour.
    Clear([f32; 4]),
    /// The given integers, for targets of an unsigned integer format.
    ClearUint([u32; 4]),
    /// The given integers, for targets of a signed integer format.
    ClearSint([i32; 4]),
    /// Undefined contents; the pass draws every pixel.
    DontCare,
}

/// Contents of a depth target when the pass begins (`VkAttachmentLoadOp`).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DepthLoadOp {
    /// The previous contents.
    Load,
    /// The given depth, 0 to 1.
    Clear(f32),
    /// Undefined contents.
    DontCare,
}

/// Contents of the stencil of a depth target when the pass begins (`VkAttachmentLoadOp`).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StencilLoadOp {
    /// The previous contents.
    Load,
    /// The given value.
    Clear(u8),
    /// Undefined contents.
    DontCare,
}

/// The resolve of a multisampled colour target at the end of the pass. Each pixel becomes the mean of its samples, or
/// the first of them for integer formats.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Resolve {
    /// A texture of one sample a pixel and the same format, with
    /// [`TextureUsage::TARGET`](crate::TextureUsage::TARGET).
    pub texture: TextureHandle,
    /// Mip level written; of a view, counted from its first.
    pub mip: u32,
    /// Layer written: the first of as many as the pass has.
    pub layer: u32,
}

/// The resolve of a multisampled depth target at the end of the pass.
/// [`Limits::depth_resolve`](crate::Limits::depth_resolve) has the supported modes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DepthResolve {
    /// A texture of one sample a pixel and the same format, with
    /// [`TextureUsage::TARGET`](crate::TextureUsage::TARGET).
    pub texture: TextureHandle,
    /// Mip level written; of a view, counted from its first.
    pub mip: u32,
    /// Layer written: the first of as many as the pass has.
    pub layer: u32,
    /// Mode that resolves depth; `None` leaves depth unchanged.
    pub depth: Option<ResolveMode>,
    /// Mode that resolves stencil; `None` leaves stencil unchanged. Ignored for formats without stencil.
    pub stencil: Option<ResolveMode>,
}

/// A colour target of a render pass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ColorAttachment {
    /// A texture with [`TextureUsage::TARGET`](crate::TextureUsage::TARGET).
    pub texture: TextureHandle,
    /// Mip level drawn to; of a view, counted from its first.
    pub mip: u32,
    /// Layer, cube face, or slice of a volume drawn to: the first one if the pass has several. Of a view, counted from
    /// its first.
    pub layer: u32,
    /// Contents when the pass begins.
    pub load: ColorLoadOp,
    /// True if the contents are stored at the end of the pass.
    pub store: bool,
    /// Resolve of a multisampled target; the samples themselves need not be stored.
    pub resolve: Option<Resolve>,
}

impl ColorAttachment {
    /// Returns a target of the first mip and layer, cleared to a colour and stored.
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
    /// Layer, cube face, or slice of a volume drawn to: the first one if the pass has several. Of a view, counted from
    /// its first.
    pub layer: u32,
    /// Contents when the pass begins.
    pub load: DepthLoadOp,
    /// True if the depth is stored at the end of the pass.
    pub store: bool,
    /// Contents of the stencil when the pass begins; ignored for formats without stencil.
    pub stencil: StencilLoadOp,
    /// True if the stencil is stored at the end of the pass.
    pub stencil_store: bool,
    /// True if depth and stencil are loaded and tested, but never written. The pass may then also sample the texture,
    /// if its dependencies list it.
    pub read_only: bool,
    /// Resolve of a multisampled target.
    pub resolve: Option<DepthResolve>,
}

/// The texture from which a render pass takes shading rates. A texel covers a block of pixels of the targets, in all
/// layers and views alike.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ShadingRateAttachment {
    /// A texture with [`TextureUsage::SHADING_RATE`](crate::TextureUsage::SHADING_RATE).
    /// [`ShadingRate::texel`](crate::ShadingRate::texel) returns the values of its texels.
    pub texture: TextureHandle,
    /// Mip level read; of a view, counted from its first.
    pub mip: u32,
    /// Layer read; of a view, counted from its first.
    pub layer: u32,
    /// Width and height of the pixels that a texel covers, as [`Limits::shading_rate`](crate::Limits::shading_rate)
    /// allows.
    pub texel: [u32; 2],
}

impl ShadingRateAttachment {
    /// Returns an attachment of the first mip and layer.
    pub fn new(texture: TextureHandle, texel: [u32; 2]) -> Self {
        Self { texture, mip: 0, layer: 0, texel }
    }
}

impl DepthAttachment {
    /// Returns a target of the first mip and layer, cleared to a depth and the stencil 0, and stored.
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

    /// Returns a target of the first mip and layer, with its previous contents, and stored.
    pub fn load(texture: TextureHandle) -> Self {
        Self { load: DepthLoadOp::Load, stencil: StencilLoadOp::Load, ..Self::clear(texture, 0.0) }
    }

    /// Returns a target of the first mip and layer, tested and not written.
    pub fn read_only(texture: TextureHandle) -> Self {
        Self { read_only: true, ..Self::load(texture) }
    }
}

/// Describes a render pass.
#[derive(Debug, Clone, Copy, Default)]
pub struct RenderPassDesc<'a> {
    /// Colour targets, in the order of the shaders' outputs. Default: empty.
    pub color: &'a [ColorAttachment],
    /// Depth and stencil target. Default: none.
    pub depth: Option<DepthAttachment>,
    /// Number of layers drawn to in each target, from the target's own first on; 0 and 1 both mean one. Draws choose
    /// their layer by `gl_Layer`, in the geometry and mesh stages, and with
    /// [`OptionalFeature::ShaderOutputLayer`](crate::OptionalFeature::ShaderOutputLayer) in the vertex stage.
    /// Default: 0.
    pub layers: u32,
    /// Views that each draw renders at once, a bit for each: bit `i` draws to layer `i` of each target, counted from
    /// the target's own first. Shaders read the view from `gl_ViewIndex` (`#extension GL_EXT_multiview`). 0 for a pass
    /// without views. Needs [`OptionalFeature::Multiview`](crate::OptionalFeature::Multiview); at most
    /// [`Limits::max_views`](crate::Limits::max_views). Default: 0.
    pub view_mask: u32,
    /// The pixels that are loaded, cleared, drawn and stored: x, y, width and height. `None` for all pixels.
    /// Default: none.
    pub area: Option<[u32; 4]>,
    /// True if fragment shaders read the targets that have [`TextureUsage::INPUT`](crate::TextureUsage::INPUT). Each
    /// reads the results of earlier draws of the pass at its own pixel (`LVK_INPUT`, `LVK_DEPTH_INPUT`,
    /// `LVK_STENCIL_INPUT` and `subpassLoad`). Needs [`OptionalFeature::LocalRead`](crate::OptionalFeature::LocalRead).
    /// Default: false.
    pub local_read: bool,
    /// Texture of shading rates. Pipelines combine their own [`shading_rate`](crate::RenderPipelineDesc::shading_rate)
    /// with it. Default: none.
    pub shading_rate: Option<ShadingRateAttachment>,
    /// Resources that the pass's shaders access bindlessly, and resources that its draws read and that were written
    /// earlier in the same command buffer. No barrier can be recorded inside a pass. Acceleration structures need not
    /// be listed. Default: empty.
    pub dependencies: Dependencies<'a>,
    /// Name of the pass in debuggers; empty for none. Default: empty.
    pub debug_name: &'a str,
    /// Colour of the pass in debuggers, as [`Label::color`](crate::Label::color). Default: four zeros.
    pub debug_color: [f32; 4],
}
