//! The background of a window while its sample is loading.

use lvk::{Context, Format, Holder, TextureDesc, TextureHandle, TextureUsage};

/// Red, green, blue and alpha, sRGB: a dark grey that the progress stands out from.
const COLOR: [u8; 4] = [24, 26, 30, 255];

/// A texture of one texel.
pub(super) fn background(ctx: &Context) -> lvk::Result<Holder<TextureHandle>> {
    ctx.create_texture(&TextureDesc {
        format: Format::Rgba8Unorm,
        extent: [1, 1],
        usage: TextureUsage::SAMPLED,
        data: Some(&COLOR),
        debug_name: "picture while loading",
        ..TextureDesc::default()
    })
}
