//! Formats and samplers of glTF as Vulkan has them.

use lvk::{AddressMode, Format, SamplerDesc};
use lvk_gltf::{ColorSpace, Filter, Image, Sampler, TexelFormat, Wrap};

/// The format of an image's texels; `None` where Vulkan has none that `lvk` knows.
pub(super) fn format_of(image: &Image) -> Option<Format> {
    let is_srgb = image.color_space == ColorSpace::Srgb;
    let [linear, srgb] = match image.data.format {
        TexelFormat::Rgba8 => [Format::Rgba8Unorm, Format::Rgba8Srgb],
        TexelFormat::Bc1Rgb => [Format::Bc1RgbUnorm, Format::Bc1RgbSrgb],
        TexelFormat::Bc1Rgba => [Format::Bc1RgbaUnorm, Format::Bc1RgbaSrgb],
        TexelFormat::Bc2 => [Format::Bc2Unorm, Format::Bc2Srgb],
        TexelFormat::Bc3 => [Format::Bc3Unorm, Format::Bc3Srgb],
        TexelFormat::Bc4 => [Format::Bc4Unorm; 2],
        TexelFormat::Bc5 => [Format::Bc5Unorm; 2],
        TexelFormat::Bc7 => [Format::Bc7Unorm, Format::Bc7Srgb],
        TexelFormat::Etc2Rgb => [Format::Etc2Rgb8Unorm, Format::Etc2Rgb8Srgb],
        TexelFormat::Etc2Rgba => [Format::Etc2Rgba8Unorm, Format::Etc2Rgba8Srgb],
        TexelFormat::Astc([4, 4]) => [Format::Astc4x4Unorm, Format::Astc4x4Srgb],
        TexelFormat::Astc([6, 6]) => [Format::Astc6x6Unorm, Format::Astc6x6Srgb],
        TexelFormat::Astc([8, 8]) => [Format::Astc8x8Unorm, Format::Astc8x8Srgb],
        TexelFormat::Astc(_) => return None,
    };
    Some(if is_srgb { srgb } else { linear })
}

/// A sampler as the file describes it.
pub(super) fn sampler_desc(sampler: &Sampler) -> SamplerDesc<'static> {
    let filter = |filter| match filter {
        Filter::Nearest => lvk::Filter::Nearest,
        Filter::Linear => lvk::Filter::Linear,
    };
    let wrap = |wrap| match wrap {
        Wrap::Repeat => AddressMode::Repeat,
        Wrap::MirroredRepeat => AddressMode::MirroredRepeat,
        Wrap::ClampToEdge => AddressMode::ClampToEdge,
    };
    let whole = SamplerDesc::default().lod_range;
    SamplerDesc {
        mag_filter: filter(sampler.mag_filter),
        min_filter: filter(sampler.min_filter),
        mip_filter: sampler.mip_filter.map_or(lvk::Filter::Nearest, filter),
        address: [wrap(sampler.wrap_u), wrap(sampler.wrap_v), AddressMode::Repeat],
        lod_range: if sampler.mip_filter.is_some() { whole } else { [0.0, 0.0] },
        debug_name: "texture sampler",
        ..SamplerDesc::default()
    }
}
