//! The picture that a sample draws.

use lvk::{Context, Format, Holder, TextureDesc, TextureHandle, TextureUsage};

use super::{RtxConfig, RtxError};

/// The picture that a sample draws.
pub(crate) struct Canvas {
    picture: Holder<TextureHandle>,
}

impl Canvas {
    /// A picture of 8 bits a channel, sRGB as far as shaders encode it, for which `config` is checked.
    pub(crate) fn new(ctx: &Context, config: &RtxConfig) -> Result<Self, RtxError> {
        config.check(ctx.capabilities())?;
        let picture = ctx.create_texture(&TextureDesc {
            format: Format::Rgba8Unorm,
            extent: config.extent(),
            usage: TextureUsage::STORAGE | TextureUsage::SAMPLED,
            debug_name: "picture",
            ..TextureDesc::default()
        })?;
        Ok(Self { picture })
    }

    /// Where shaders store their pixels.
    pub(crate) fn picture(&self) -> &Holder<TextureHandle> {
        &self.picture
    }
}
