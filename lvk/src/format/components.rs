//! Components of colour formats, which decide how an image may be reinterpreted.

use super::Format;

impl Format {
    /// True if texels have the components of `other`: the same number, with the same bits each.
    pub(crate) fn has_components_of(self, other: Self) -> bool {
        let bits = self.component_bits();
        self == other
            || !bits.is_empty() && bits == other.component_bits()
            || self.is_compressed() && self.is_viewable_as(other)
    }

    /// Returns the bits of each component of uncompressed colours; empty for all other formats.
    fn component_bits(self) -> &'static [u8] {
        match self {
            Self::R8Unorm | Self::R8Snorm | Self::R8Uint | Self::R8Sint | Self::A8Unorm => &[8],
            Self::Rg8Unorm | Self::Rg8Snorm | Self::Rg8Uint | Self::Rg8Sint => &[8, 8],
            Self::Rgba8Unorm | Self::Rgba8Snorm | Self::Rgba8Uint | Self::Rgba8Sint => &[8, 8, 8, 8],
            Self::Rgba8Srgb | Self::Bgra8Unorm | Self::Bgra8Srgb => &[8, 8, 8, 8],
            Self::R16Unorm | Self::R16Snorm | Self::R16Uint | Self::R16Sint | Self::R16Float => &[16],
            Self::Rg16Unorm | Self::Rg16Snorm | Self::Rg16Uint | Self::Rg16Sint | Self::Rg16Float => {
                &[16, 16]
            }
            Self::Rgba16Unorm | Self::Rgba16Snorm | Self::Rgba16Uint => &[16, 16, 16, 16],
            Self::Rgba16Sint | Self::Rgba16Float => &[16, 16, 16, 16],
            Self::R32Uint | Self::R32Sint | Self::R32Float => &[32],
            Self::Rg32Uint | Self::Rg32Sint | Self::Rg32Float => &[32, 32],
            Self::Rgba32Uint | Self::Rgba32Sint | Self::Rgba32Float => &[32, 32, 32, 32],
            Self::R5G6B5Unorm => &[5, 6, 5],
            Self::A1Rgb5Unorm | Self::A1Bgr5Unorm => &[5, 5, 5, 1],
            Self::Rgb10A2Unorm | Self::Rgb10A2Uint | Self::Bgr10A2Unorm => &[10, 10, 10, 2],
            Self::Rg11B10Float => &[11, 11, 10],
            Self::Rgb9E5Float => &[9, 9, 9, 5],
            _ => &[],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_plain_colour_has_components_that_fill_its_texel() {
        for format in Format::ALL {
            let bits: u32 = format.component_bits().iter().map(|bits| u32::from(*bits)).sum();
            let plain = format.is_color() && !format.is_compressed() && !format.is_yuv();
            assert_eq!(bits, if plain { 8 * format.block().bytes } else { 0 }, "{format:?}");
        }
    }

    #[test]
    fn encodings_and_orders_keep_the_components() {
        for (format, other, same) in [
            (Format::Rgba8Srgb, Format::Bgra8Unorm, true),
            (Format::Rgba8Unorm, Format::R32Uint, false),
            (Format::Rg11B10Float, Format::Rgb10A2Unorm, false),
            (Format::Bc1RgbUnorm, Format::Bc1RgbSrgb, true),
            (Format::Bc1RgbUnorm, Format::Rg32Uint, false),
            (Format::D32Float, Format::D32Float, true),
            (Format::D32Float, Format::R32Float, false),
        ] {
            assert_eq!(format.has_components_of(other), same, "{format:?} {other:?}");
            assert_eq!(other.has_components_of(format), same, "{other:?} {format:?}");
        }
    }
}
