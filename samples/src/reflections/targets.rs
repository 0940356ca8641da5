//! The pictures that the passes hand to each other.

use lvk::{BufferHandle, Context, Format, Holder, TextureDesc, TextureHandle, TextureUsage};

use super::frame::Indices;
use crate::app::array_buffer::buffer;

/// Normals, colour, roughness and material of a g-buffer (`shaders/reflections/gbuffer.glsl`).
pub(super) const SURFACE_FORMAT: Format = Format::Rgba32Uint;
/// Depth, which counts down from 1 at the near plane.
pub(super) const DEPTH_FORMAT: Format = Format::D32Float;
/// Light before it is exposed.
pub(super) const COMPOSITE_FORMAT: Format = Format::Rgba16Float;

/// One texel a pixel in each.
pub(super) struct Targets {
    pub(super) opaque_surface: Holder<TextureHandle>,
    pub(super) opaque_depth: Holder<TextureHandle>,
    pub(super) glass_surface: Holder<TextureHandle>,
    pub(super) glass_depth: Holder<TextureHandle>,
    /// Visibility of each light, and ambient visibility.
    pub(super) visibility: Holder<TextureHandle>,
    /// The same on its way through the filter.
    pub(super) smoothed: Holder<TextureHandle>,
    /// Half the width of each light's penumbra, in pixels.
    pub(super) penumbra: Holder<TextureHandle>,
    /// Reflected radiance and the distance of what is reflected.
    pub(super) reflection: Holder<TextureHandle>,
    pub(super) filtered: Holder<TextureHandle>,
    pub(super) glass_reflection: Holder<TextureHandle>,
    pub(super) composite: Holder<TextureHandle>,
    /// The image, sRGB.
    pub(super) picture: Holder<TextureHandle>,
    /// The sums of the samples.
    pub(super) sums: Holder<BufferHandle>,
    pub(super) sums_address: u64,
    pub(super) extent: [u32; 2],
}

impl Targets {
    pub(super) fn new(ctx: &Context, extent: [u32; 2]) -> lvk::Result<Self> {
        let make = |format, usage, debug_name| {
            let usage = usage | TextureUsage::SAMPLED;
            ctx.create_texture(&TextureDesc { format, extent, usage, debug_name, ..TextureDesc::default() })
        };
        let target = |format, name| make(format, TextureUsage::TARGET, name);
        let size_bytes = u64::from(extent[0]) * u64::from(extent[1]) * size_of::<[f32; 4]>() as u64;
        let sums = buffer(ctx, "sums", size_bytes)?;
        let light = |name| make(Format::Rgba16Float, TextureUsage::STORAGE, name);
        Ok(Self {
            opaque_surface: target(SURFACE_FORMAT, "opaque surface")?,
            opaque_depth: target(DEPTH_FORMAT, "opaque depth")?,
            glass_surface: target(SURFACE_FORMAT, "glass surface")?,
            glass_depth: target(DEPTH_FORMAT, "glass depth")?,
            visibility: light("visibility")?,
            smoothed: light("smoothed visibility")?,
            penumbra: light("penumbra")?,
            reflection: light("reflection")?,
            filtered: light("filtered reflection")?,
            glass_reflection: light("glass reflection")?,
            composite: make(COMPOSITE_FORMAT, TextureUsage::STORAGE | TextureUsage::TARGET, "composite")?,
            picture: make(Format::Rgba8Unorm, TextureUsage::STORAGE, "picture")?,
            sums_address: sums.address()?,
            sums,
            extent,
        })
    }

    /// Tells the shaders where the targets are.
    pub(super) fn name_in(&self, indices: &mut Indices) {
        indices.opaque_surface = self.opaque_surface.index();
        indices.opaque_depth = self.opaque_depth.index();
        indices.glass_surface = self.glass_surface.index();
        indices.glass_depth = self.glass_depth.index();
        indices.visibility = self.visibility.index();
        indices.smoothed = self.smoothed.index();
        indices.penumbra = self.penumbra.index();
        indices.reflection = self.reflection.index();
        indices.filtered = self.filtered.index();
        indices.glass_reflection = self.glass_reflection.index();
        indices.composite = self.composite.index();
        indices.picture = self.picture.index();
    }

    /// The g-buffer of opaque surfaces.
    pub(super) fn opaque(&self) -> [TextureHandle; 2] {
        [*self.opaque_surface, *self.opaque_depth]
    }

    /// The g-buffer of transparent surfaces.
    pub(super) fn glass(&self) -> [TextureHandle; 2] {
        [*self.glass_surface, *self.glass_depth]
    }
}
