//! The textures that passes hand to each other.

use lvk::{Context, Format, Holder, TextureDesc, TextureHandle, TextureUsage};

/// One texel a sample, but for the picture.
pub(super) struct Targets {
    /// Depth of what is opaque, reversed: 1 at the near plane, 0 at infinity.
    pub(super) depth: Holder<TextureHandle>,
    /// Position in scene units, and distance from the eye; distance 0 where the sky is seen.
    pub(super) position: Holder<TextureHandle>,
    /// Normal (octahedral, two floats), albedo and gloss (four half floats).
    pub(super) surface: Holder<TextureHandle>,
    /// Share of the sun that reaches the surface, of red, green and blue.
    pub(super) shadow: Holder<TextureHandle>,
    /// The picture.
    pub(super) picture: Holder<TextureHandle>,
}

impl Targets {
    pub(super) const DEPTH: Format = Format::D32Float;
    const POSITION: Format = Format::Rgba32Float;
    const SURFACE: Format = Format::Rgba32Uint;
    const SHADOW: Format = Format::Rgba16Float;
    /// Formats of the G-buffer's colour targets, in the order of the shaders' outputs.
    pub(super) const GBUFFER: [Format; 2] = [Self::POSITION, Self::SURFACE];

    /// Textures for a raster of `samples` and a picture of `pixels`.
    pub(super) fn new(ctx: &Context, samples: [u32; 2], pixels: [u32; 2]) -> lvk::Result<Self> {
        use TextureUsage as Usage;
        let texture = |format, extent, usage, debug_name| {
            ctx.create_texture(&TextureDesc { format, extent, usage, debug_name, ..TextureDesc::default() })
        };
        let drawn = Usage::SAMPLED | Usage::TARGET;
        let stored = Usage::SAMPLED | Usage::STORAGE;
        Ok(Self {
            depth: texture(Self::DEPTH, samples, Usage::TARGET, "depth")?,
            position: texture(Self::POSITION, samples, drawn, "g-buffer position")?,
            surface: texture(Self::SURFACE, samples, drawn, "g-buffer surface")?,
            shadow: texture(Self::SHADOW, samples, stored, "sunlight")?,
            picture: texture(Format::Rgba8Unorm, pixels, stored, "picture")?,
        })
    }
}
