//! The table of texel formats: Vulkan format, block size and class of contents.

use ash::vk;

/// The smallest block of a format that can be copied.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct TexelBlock {
    /// Width and height in texels: 1 for uncompressed formats.
    pub(super) texels: [u32; 2],
    /// Size in bytes. For depth with stencil, the size of the depth alone; for planar formats, the size of Y.
    pub(super) bytes: u32,
}

/// Class of the contents of texels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum CompatibilityClass {
    Float,
    Uint,
    Sint,
    /// Compressed colours, which shaders read as floats.
    TexelBlock,
    Depth,
    Stencil,
    DepthStencil,
    /// Y'CbCr in two planes: Y, and both colour differences with half the width and height.
    TwoPlanes,
    /// Y'CbCr in three planes, one for each colour difference.
    ThreePlanes,
}

const fn texel(bytes: u32) -> TexelBlock {
    block([1, 1], bytes)
}

const fn block(texels: [u32; 2], bytes: u32) -> TexelBlock {
    TexelBlock { texels, bytes }
}

macro_rules! formats {
    ($($(#[$doc:meta])* $name:ident = $raw:ident, $block:expr, $class:ident;)*) => {
        /// Format of the texels of a texture or a render target.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        #[non_exhaustive]
        pub enum Format {
            $($(#[$doc])* $name,)*
        }

        impl Format {
            /// All formats of the library. [`Context::format_support`](crate::Context::format_support)
            /// returns a device's support for each.
            pub const ALL: &'static [Self] = &[$(Self::$name),*];

            pub(crate) fn raw(self) -> vk::Format {
                match self {
                    $(Self::$name => vk::Format::$raw,)*
                }
            }

            pub(super) fn block(self) -> TexelBlock {
                match self {
                    $(Self::$name => $block,)*
                }
            }

            pub(super) fn class(self) -> CompatibilityClass {
                match self {
                    $(Self::$name => CompatibilityClass::$class,)*
                }
            }
        }
    };
}

formats! {
    /// One 8-bit normalised channel.
    R8Unorm = R8_UNORM, texel(1), Float;
    /// One 8-bit signed normalised channel.
    R8Snorm = R8_SNORM, texel(1), Float;
    /// One 8-bit unsigned integer channel.
    R8Uint = R8_UINT, texel(1), Uint;
    /// One 8-bit signed integer channel.
    R8Sint = R8_SINT, texel(1), Sint;
    /// Two 8-bit normalised channels.
    Rg8Unorm = R8G8_UNORM, texel(2), Float;
    /// Two 8-bit signed normalised channels.
    Rg8Snorm = R8G8_SNORM, texel(2), Float;
    /// Two 8-bit unsigned integer channels.
    Rg8Uint = R8G8_UINT, texel(2), Uint;
    /// Two 8-bit signed integer channels.
    Rg8Sint = R8G8_SINT, texel(2), Sint;
    /// Four 8-bit normalised channels.
    Rgba8Unorm = R8G8B8A8_UNORM, texel(4), Float;
    /// Four 8-bit signed normalised channels.
    Rgba8Snorm = R8G8B8A8_SNORM, texel(4), Float;
    /// Four 8-bit unsigned integer channels.
    Rgba8Uint = R8G8B8A8_UINT, texel(4), Uint;
    /// Four 8-bit signed integer channels.
    Rgba8Sint = R8G8B8A8_SINT, texel(4), Sint;
    /// Four 8-bit channels, colour encoded as sRGB.
    Rgba8Srgb = R8G8B8A8_SRGB, texel(4), Float;
    /// Four 8-bit normalised channels, blue first.
    Bgra8Unorm = B8G8R8A8_UNORM, texel(4), Float;
    /// Four 8-bit channels, blue first, colour encoded as sRGB.
    Bgra8Srgb = B8G8R8A8_SRGB, texel(4), Float;
    /// One 8-bit normalised channel that shaders read as alpha (`VK_KHR_maintenance5`).
    A8Unorm = A8_UNORM_KHR, texel(1), Float;
    /// One 16-bit normalised channel.
    R16Unorm = R16_UNORM, texel(2), Float;
    /// One 16-bit signed normalised channel.
    R16Snorm = R16_SNORM, texel(2), Float;
    /// One 16-bit unsigned integer channel.
    R16Uint = R16_UINT, texel(2), Uint;
    /// One 16-bit signed integer channel.
    R16Sint = R16_SINT, texel(2), Sint;
    /// One 16-bit float.
    R16Float = R16_SFLOAT, texel(2), Float;
    /// Two 16-bit normalised channels.
    Rg16Unorm = R16G16_UNORM, texel(4), Float;
    /// Two 16-bit signed normalised channels.
    Rg16Snorm = R16G16_SNORM, texel(4), Float;
    /// Two 16-bit unsigned integer channels.
    Rg16Uint = R16G16_UINT, texel(4), Uint;
    /// Two 16-bit signed integer channels.
    Rg16Sint = R16G16_SINT, texel(4), Sint;
    /// Two 16-bit floats.
    Rg16Float = R16G16_SFLOAT, texel(4), Float;
    /// Four 16-bit normalised channels.
    Rgba16Unorm = R16G16B16A16_UNORM, texel(8), Float;
    /// Four 16-bit signed normalised channels.
    Rgba16Snorm = R16G16B16A16_SNORM, texel(8), Float;
    /// Four 16-bit unsigned integer channels.
    Rgba16Uint = R16G16B16A16_UINT, texel(8), Uint;
    /// Four 16-bit signed integer channels.
    Rgba16Sint = R16G16B16A16_SINT, texel(8), Sint;
    /// Four 16-bit floats.
    Rgba16Float = R16G16B16A16_SFLOAT, texel(8), Float;
    /// One 32-bit unsigned integer channel.
    R32Uint = R32_UINT, texel(4), Uint;
    /// One 32-bit signed integer channel.
    R32Sint = R32_SINT, texel(4), Sint;
    /// One 32-bit float.
    R32Float = R32_SFLOAT, texel(4), Float;
    /// Two 32-bit unsigned integer channels.
    Rg32Uint = R32G32_UINT, texel(8), Uint;
    /// Two 32-bit signed integer channels.
    Rg32Sint = R32G32_SINT, texel(8), Sint;
    /// Two 32-bit floats.
    Rg32Float = R32G32_SFLOAT, texel(8), Float;
    /// Four 32-bit unsigned integer channels.
    Rgba32Uint = R32G32B32A32_UINT, texel(16), Uint;
    /// Four 32-bit signed integer channels.
    Rgba32Sint = R32G32B32A32_SINT, texel(16), Sint;
    /// Four 32-bit floats.
    Rgba32Float = R32G32B32A32_SFLOAT, texel(16), Float;
    /// Red and blue with 5 bits, green with 6, normalised. Red is in the highest bits of a word.
    R5G6B5Unorm = R5G6B5_UNORM_PACK16, texel(2), Float;
    /// Three 5-bit normalised channels, and 1 bit of alpha in the highest bit.
    A1Rgb5Unorm = A1R5G5B5_UNORM_PACK16, texel(2), Float;
    /// Three 5-bit normalised channels, from the highest bits blue, green, red, below 1 bit of alpha in the
    /// highest bit (`VK_KHR_maintenance5`).
    A1Bgr5Unorm = A1B5G5R5_UNORM_PACK16_KHR, texel(2), Float;
    /// Three 10-bit normalised channels and 2 bits of alpha, red in the lowest bits.
    Rgb10A2Unorm = A2B10G10R10_UNORM_PACK32, texel(4), Float;
    /// Three 10-bit unsigned integers and 2 bits of alpha, red in the lowest bits.
    Rgb10A2Uint = A2B10G10R10_UINT_PACK32, texel(4), Uint;
    /// Three 10-bit normalised channels and 2 bits of alpha, blue in the lowest bits.
    Bgr10A2Unorm = A2R10G10B10_UNORM_PACK32, texel(4), Float;
    /// Three small unsigned floats.
    Rg11B10Float = B10G11R11_UFLOAT_PACK32, texel(4), Float;
    /// Three 9-bit mantissas with a shared exponent of 5 bits.
    Rgb9E5Float = E5B9G9R9_UFLOAT_PACK32, texel(4), Float;
    /// 16-bit normalised depth.
    D16Unorm = D16_UNORM, texel(2), Depth;
    /// 24-bit normalised depth. A copy moves 4 bytes, of which the highest is unused.
    X8D24Unorm = X8_D24_UNORM_PACK32, texel(4), Depth;
    /// Float depth.
    D32Float = D32_SFLOAT, texel(4), Depth;
    /// 8-bit stencil.
    S8Uint = S8_UINT, texel(1), Stencil;
    /// 24-bit depth and 8-bit stencil.
    D24UnormS8 = D24_UNORM_S8_UINT, texel(4), DepthStencil;
    /// Float depth and 8-bit stencil.
    D32FloatS8 = D32_SFLOAT_S8_UINT, texel(4), DepthStencil;
    /// BC1 without alpha: blocks of 4 x 4 texels in 8 bytes.
    Bc1RgbUnorm = BC1_RGB_UNORM_BLOCK, block([4, 4], 8), TexelBlock;
    /// BC1 without alpha: blocks of 4 x 4 texels in 8 bytes, colour encoded as sRGB.
    Bc1RgbSrgb = BC1_RGB_SRGB_BLOCK, block([4, 4], 8), TexelBlock;
    /// BC1 with 1 bit of alpha: blocks of 4 x 4 texels in 8 bytes.
    Bc1RgbaUnorm = BC1_RGBA_UNORM_BLOCK, block([4, 4], 8), TexelBlock;
    /// BC1 with 1 bit of alpha: blocks of 4 x 4 texels in 8 bytes, colour encoded as sRGB.
    Bc1RgbaSrgb = BC1_RGBA_SRGB_BLOCK, block([4, 4], 8), TexelBlock;
    /// BC2, alpha of 4 bits: blocks of 4 x 4 texels in 16 bytes.
    Bc2Unorm = BC2_UNORM_BLOCK, block([4, 4], 16), TexelBlock;
    /// BC2, alpha of 4 bits: blocks of 4 x 4 texels in 16 bytes, colour encoded as sRGB.
    Bc2Srgb = BC2_SRGB_BLOCK, block([4, 4], 16), TexelBlock;
    /// BC3, alpha interpolated: blocks of 4 x 4 texels in 16 bytes.
    Bc3Unorm = BC3_UNORM_BLOCK, block([4, 4], 16), TexelBlock;
    /// BC3, alpha interpolated: blocks of 4 x 4 texels in 16 bytes, colour encoded as sRGB.
    Bc3Srgb = BC3_SRGB_BLOCK, block([4, 4], 16), TexelBlock;
    /// BC4, one channel: blocks of 4 x 4 texels in 8 bytes.
    Bc4Unorm = BC4_UNORM_BLOCK, block([4, 4], 8), TexelBlock;
    /// BC4, one channel, signed.
    Bc4Snorm = BC4_SNORM_BLOCK, block([4, 4], 8), TexelBlock;
    /// BC5, two channels: blocks of 4 x 4 texels in 16 bytes.
    Bc5Unorm = BC5_UNORM_BLOCK, block([4, 4], 16), TexelBlock;
    /// BC5, two channels, signed.
    Bc5Snorm = BC5_SNORM_BLOCK, block([4, 4], 16), TexelBlock;
    /// BC6H, unsigned half floats: blocks of 4 x 4 texels in 16 bytes.
    Bc6hUfloat = BC6H_UFLOAT_BLOCK, block([4, 4], 16), TexelBlock;
    /// BC6H, signed half floats.
    Bc6hFloat = BC6H_SFLOAT_BLOCK, block([4, 4], 16), TexelBlock;
    /// BC7: blocks of 4 x 4 texels in 16 bytes.
    Bc7Unorm = BC7_UNORM_BLOCK, block([4, 4], 16), TexelBlock;
    /// BC7: blocks of 4 x 4 texels in 16 bytes, colour encoded as sRGB.
    Bc7Srgb = BC7_SRGB_BLOCK, block([4, 4], 16), TexelBlock;
    /// ETC2 without alpha: blocks of 4 x 4 texels in 8 bytes.
    Etc2Rgb8Unorm = ETC2_R8G8B8_UNORM_BLOCK, block([4, 4], 8), TexelBlock;
    /// ETC2 without alpha: blocks of 4 x 4 texels in 8 bytes, colour encoded as sRGB.
    Etc2Rgb8Srgb = ETC2_R8G8B8_SRGB_BLOCK, block([4, 4], 8), TexelBlock;
    /// ETC2 with 1 bit of alpha: blocks of 4 x 4 texels in 8 bytes.
    Etc2Rgb8A1Unorm = ETC2_R8G8B8A1_UNORM_BLOCK, block([4, 4], 8), TexelBlock;
    /// ETC2 with 1 bit of alpha: blocks of 4 x 4 texels in 8 bytes, colour encoded as sRGB.
    Etc2Rgb8A1Srgb = ETC2_R8G8B8A1_SRGB_BLOCK, block([4, 4], 8), TexelBlock;
    /// ETC2 with EAC alpha: blocks of 4 x 4 texels in 16 bytes.
    Etc2Rgba8Unorm = ETC2_R8G8B8A8_UNORM_BLOCK, block([4, 4], 16), TexelBlock;
    /// ETC2 with EAC alpha: blocks of 4 x 4 texels in 16 bytes, colour encoded as sRGB.
    Etc2Rgba8Srgb = ETC2_R8G8B8A8_SRGB_BLOCK, block([4, 4], 16), TexelBlock;
    /// EAC, one channel: blocks of 4 x 4 texels in 8 bytes.
    EacR11Unorm = EAC_R11_UNORM_BLOCK, block([4, 4], 8), TexelBlock;
    /// EAC, one channel, signed.
    EacR11Snorm = EAC_R11_SNORM_BLOCK, block([4, 4], 8), TexelBlock;
    /// EAC, two channels: blocks of 4 x 4 texels in 16 bytes.
    EacRg11Unorm = EAC_R11G11_UNORM_BLOCK, block([4, 4], 16), TexelBlock;
    /// EAC, two channels, signed.
    EacRg11Snorm = EAC_R11G11_SNORM_BLOCK, block([4, 4], 16), TexelBlock;
    /// ASTC: blocks of 4 x 4 texels in 16 bytes.
    Astc4x4Unorm = ASTC_4X4_UNORM_BLOCK, block([4, 4], 16), TexelBlock;
    /// ASTC: blocks of 4 x 4 texels in 16 bytes, colour encoded as sRGB.
    Astc4x4Srgb = ASTC_4X4_SRGB_BLOCK, block([4, 4], 16), TexelBlock;
    /// ASTC: blocks of 5 x 4 texels in 16 bytes.
    Astc5x4Unorm = ASTC_5X4_UNORM_BLOCK, block([5, 4], 16), TexelBlock;
    /// ASTC: blocks of 5 x 4 texels in 16 bytes, colour encoded as sRGB.
    Astc5x4Srgb = ASTC_5X4_SRGB_BLOCK, block([5, 4], 16), TexelBlock;
    /// ASTC: blocks of 5 x 5 texels in 16 bytes.
    Astc5x5Unorm = ASTC_5X5_UNORM_BLOCK, block([5, 5], 16), TexelBlock;
    /// ASTC: blocks of 5 x 5 texels in 16 bytes, colour encoded as sRGB.
    Astc5x5Srgb = ASTC_5X5_SRGB_BLOCK, block([5, 5], 16), TexelBlock;
    /// ASTC: blocks of 6 x 5 texels in 16 bytes.
    Astc6x5Unorm = ASTC_6X5_UNORM_BLOCK, block([6, 5], 16), TexelBlock;
    /// ASTC: blocks of 6 x 5 texels in 16 bytes, colour encoded as sRGB.
    Astc6x5Srgb = ASTC_6X5_SRGB_BLOCK, block([6, 5], 16), TexelBlock;
    /// ASTC: blocks of 6 x 6 texels in 16 bytes.
    Astc6x6Unorm = ASTC_6X6_UNORM_BLOCK, block([6, 6], 16), TexelBlock;
    /// ASTC: blocks of 6 x 6 texels in 16 bytes, colour encoded as sRGB.
    Astc6x6Srgb = ASTC_6X6_SRGB_BLOCK, block([6, 6], 16), TexelBlock;
    /// ASTC: blocks of 8 x 5 texels in 16 bytes.
    Astc8x5Unorm = ASTC_8X5_UNORM_BLOCK, block([8, 5], 16), TexelBlock;
    /// ASTC: blocks of 8 x 5 texels in 16 bytes, colour encoded as sRGB.
    Astc8x5Srgb = ASTC_8X5_SRGB_BLOCK, block([8, 5], 16), TexelBlock;
    /// ASTC: blocks of 8 x 6 texels in 16 bytes.
    Astc8x6Unorm = ASTC_8X6_UNORM_BLOCK, block([8, 6], 16), TexelBlock;
    /// ASTC: blocks of 8 x 6 texels in 16 bytes, colour encoded as sRGB.
    Astc8x6Srgb = ASTC_8X6_SRGB_BLOCK, block([8, 6], 16), TexelBlock;
    /// ASTC: blocks of 8 x 8 texels in 16 bytes.
    Astc8x8Unorm = ASTC_8X8_UNORM_BLOCK, block([8, 8], 16), TexelBlock;
    /// ASTC: blocks of 8 x 8 texels in 16 bytes, colour encoded as sRGB.
    Astc8x8Srgb = ASTC_8X8_SRGB_BLOCK, block([8, 8], 16), TexelBlock;
    /// ASTC: blocks of 10 x 5 texels in 16 bytes.
    Astc10x5Unorm = ASTC_10X5_UNORM_BLOCK, block([10, 5], 16), TexelBlock;
    /// ASTC: blocks of 10 x 5 texels in 16 bytes, colour encoded as sRGB.
    Astc10x5Srgb = ASTC_10X5_SRGB_BLOCK, block([10, 5], 16), TexelBlock;
    /// ASTC: blocks of 10 x 6 texels in 16 bytes.
    Astc10x6Unorm = ASTC_10X6_UNORM_BLOCK, block([10, 6], 16), TexelBlock;
    /// ASTC: blocks of 10 x 6 texels in 16 bytes, colour encoded as sRGB.
    Astc10x6Srgb = ASTC_10X6_SRGB_BLOCK, block([10, 6], 16), TexelBlock;
    /// ASTC: blocks of 10 x 8 texels in 16 bytes.
    Astc10x8Unorm = ASTC_10X8_UNORM_BLOCK, block([10, 8], 16), TexelBlock;
    /// ASTC: blocks of 10 x 8 texels in 16 bytes, colour encoded as sRGB.
    Astc10x8Srgb = ASTC_10X8_SRGB_BLOCK, block([10, 8], 16), TexelBlock;
    /// ASTC: blocks of 10 x 10 texels in 16 bytes.
    Astc10x10Unorm = ASTC_10X10_UNORM_BLOCK, block([10, 10], 16), TexelBlock;
    /// ASTC: blocks of 10 x 10 texels in 16 bytes, colour encoded as sRGB.
    Astc10x10Srgb = ASTC_10X10_SRGB_BLOCK, block([10, 10], 16), TexelBlock;
    /// ASTC: blocks of 12 x 10 texels in 16 bytes.
    Astc12x10Unorm = ASTC_12X10_UNORM_BLOCK, block([12, 10], 16), TexelBlock;
    /// ASTC: blocks of 12 x 10 texels in 16 bytes, colour encoded as sRGB.
    Astc12x10Srgb = ASTC_12X10_SRGB_BLOCK, block([12, 10], 16), TexelBlock;
    /// ASTC: blocks of 12 x 12 texels in 16 bytes.
    Astc12x12Unorm = ASTC_12X12_UNORM_BLOCK, block([12, 12], 16), TexelBlock;
    /// ASTC: blocks of 12 x 12 texels in 16 bytes, colour encoded as sRGB.
    Astc12x12Srgb = ASTC_12X12_SRGB_BLOCK, block([12, 12], 16), TexelBlock;
    /// Y'CbCr, 8 bits: a plane of Y, and a plane of Cb and Cr with half the width and height.
    Nv12 = G8_B8R8_2PLANE_420_UNORM, texel(1), TwoPlanes;
    /// Y'CbCr, 8 bits: planes of Y, Cb and Cr. The last two have half the width and height.
    Yuv420p8 = G8_B8_R8_3PLANE_420_UNORM, texel(1), ThreePlanes;
    /// Y'CbCr, 10 bits in the upper bits of 16: a plane of Y, and a plane of Cb and Cr with half the width
    /// and height.
    P010 = G10X6_B10X6R10X6_2PLANE_420_UNORM_3PACK16, texel(2), TwoPlanes;
    /// Y'CbCr, 10 bits in the upper bits of 16: planes of Y, Cb and Cr. The last two have half the width and
    /// height.
    Yuv420p10 = G10X6_B10X6_R10X6_3PLANE_420_UNORM_3PACK16, texel(2), ThreePlanes;
}
