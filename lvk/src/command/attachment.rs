//! Targets of a render pass, as callers describe them.

use crate::handle::TextureHandle;

/// What a colour target holds when the pass begins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ColorLoad {
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
pub enum DepthLoad {
    /// What was in it.
    Load,
    /// This depth, 0 to 1.
    Clear(f32),
    /// Anything.
    DontCare,
}

/// What the stencil of a depth target holds when the pass begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StencilLoad {
    /// What was in it.
    Load,
    /// This value.
    Clear(u8),
    /// Anything.
    DontCare,
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
    pub load: ColorLoad,
    /// Whether what was drawn is kept.
    pub store: bool,
}

impl ColorAttachment {
    /// The first mip and layer, cleared to a colour and kept.
    pub fn clear(texture: TextureHandle, color: [f32; 4]) -> Self {
        Self { texture, mip: 0, layer: 0, load: ColorLoad::Clear(color), store: true }
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
    pub load: DepthLoad,
    /// Whether the depth is kept.
    pub store: bool,
    /// What its stencil holds when the pass begins; means nothing to formats without stencil.
    pub stencil: StencilLoad,
    /// Whether the stencil is kept.
    pub stencil_store: bool,
    /// Depth and stencil are loaded and tested, and never written. The texture may be sampled meanwhile, where the pass's
    /// dependencies list it.
    pub read_only: bool,
}

impl DepthAttachment {
    /// The first mip and layer, cleared to a depth and the stencil 0, and kept.
    pub fn clear(texture: TextureHandle, depth: f32) -> Self {
        Self {
            texture,
            mip: 0,
            layer: 0,
            load: DepthLoad::Clear(depth),
            store: true,
            stencil: StencilLoad::Clear(0),
            stencil_store: true,
            read_only: false,
        }
    }

    /// The first mip and layer, with what is in them, and kept.
    pub fn load(texture: TextureHandle) -> Self {
        Self { load: DepthLoad::Load, stencil: StencilLoad::Load, ..Self::clear(texture, 0.0) }
    }

    /// The first mip and layer, tested and not written.
    pub fn read_only(texture: TextureHandle) -> Self {
        Self { read_only: true, ..Self::load(texture) }
    }
}
