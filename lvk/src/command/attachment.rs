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

/// A colour target of a render pass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ColorAttachment {
    /// A texture with [`TextureUsage::TARGET`](crate::TextureUsage::TARGET).
    pub texture: TextureHandle,
    /// Mip level drawn to; of a view, counted from its first.
    pub mip: u32,
    /// Layer, cube face, or slice of a volume drawn to; of a view, counted from its first.
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
    /// Layer, cube face, or slice of a volume drawn to; of a view, counted from its first.
    pub layer: u32,
    /// What it holds when the pass begins.
    pub load: DepthLoad,
    /// Whether the depth is kept.
    pub store: bool,
}

impl DepthAttachment {
    /// The first mip and layer, cleared to a depth and kept.
    pub fn clear(texture: TextureHandle, depth: f32) -> Self {
        Self { texture, mip: 0, layer: 0, load: DepthLoad::Clear(depth), store: true }
    }
}
