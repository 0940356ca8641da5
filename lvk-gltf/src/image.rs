//! Images and samplers of textures.

use std::sync::Arc;

/// An image that materials use.
#[derive(Debug, Clone, PartialEq)]
pub struct Image {
    /// Name in the file.
    pub name: Option<String>,
    /// Index of the image in the file.
    pub source: usize,
    /// How texels are to be read.
    pub color_space: ColorSpace,
    /// Texels. Shared with the same image in the other colour space.
    pub data: Arc<ImageData>,
}

/// How the numbers of texels are to be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ColorSpace {
    /// Red, green and blue are encoded as sRGB: use a format `*_SRGB`. Alpha is linear.
    Srgb,
    /// Numbers are linear: use a format `*_UNORM`.
    Linear,
}

/// Texels of an image.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ImageData {
    /// Format of the texels.
    pub format: TexelFormat,
    /// Mip levels, the largest first. At least one; more than one only where the file has them. Each level has
    /// half the size of the one before, rounded down, and at least 1.
    pub mips: Vec<MipLevel>,
}

/// A mip level of an image.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MipLevel {
    /// Width, texels.
    pub width: u32,
    /// Height, texels.
    pub height: u32,
    /// Rows from top to bottom, without gaps. Compressed formats: rows of blocks.
    pub bytes: Vec<u8>,
}

/// Format of texels. The [`ColorSpace`] chooses between a format's `UNORM` and `SRGB` variant.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum TexelFormat {
    /// Red, green, blue, alpha, 8 bits each.
    Rgba8,
    /// BC1 without alpha, 8 bytes a block of 4x4.
    Bc1Rgb,
    /// BC1 with one bit of alpha, 8 bytes a block of 4x4.
    Bc1Rgba,
    /// BC2, 16 bytes a block of 4x4.
    Bc2,
    /// BC3, 16 bytes a block of 4x4.
    Bc3,
    /// BC4, red only, 8 bytes a block of 4x4.
    Bc4,
    /// BC5, red and green, 16 bytes a block of 4x4.
    Bc5,
    /// BC7, 16 bytes a block of 4x4.
    Bc7,
    /// ETC2 without alpha, 8 bytes a block of 4x4.
    Etc2Rgb,
    /// ETC2 with alpha, 16 bytes a block of 4x4.
    Etc2Rgba,
    /// ASTC, 16 bytes a block of this width and height.
    Astc([u8; 2]),
}

/// How a texture is sampled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Sampler {
    /// Filter of magnified texels.
    pub mag_filter: Filter,
    /// Filter of minified texels.
    pub min_filter: Filter,
    /// Filter between mip levels, or `None` to sample the largest level only.
    pub mip_filter: Option<Filter>,
    /// Wrapping of the first coordinate.
    pub wrap_u: Wrap,
    /// Wrapping of the second coordinate.
    pub wrap_v: Wrap,
}

/// A filter of texels or of mip levels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Filter {
    /// The nearest.
    Nearest,
    /// Interpolated.
    Linear,
}

/// What lies beyond the edges of a texture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Wrap {
    /// The texture again.
    Repeat,
    /// The texture again, mirrored.
    MirroredRepeat,
    /// The texels at the edge.
    ClampToEdge,
}

impl ImageData {
    /// Returns width and height of the largest level, texels.
    #[must_use]
    pub fn extent(&self) -> [u32; 2] {
        self.mips.first().map_or([0, 0], |level| [level.width, level.height])
    }
}

impl TexelFormat {
    /// Returns width and height of a block, texels; 1 and 1 for a format without compression.
    #[must_use]
    pub fn block_extent(self) -> [u32; 2] {
        match self {
            Self::Rgba8 => [1, 1],
            Self::Astc([width, height]) => [width.into(), height.into()],
            _ => [4, 4],
        }
    }

    /// Returns the bytes of a block, or of a texel for a format without compression.
    #[must_use]
    pub fn block_bytes(self) -> usize {
        match self {
            Self::Rgba8 => 4,
            Self::Bc1Rgb | Self::Bc1Rgba | Self::Bc4 | Self::Etc2Rgb => 8,
            Self::Bc2 | Self::Bc3 | Self::Bc5 | Self::Bc7 | Self::Etc2Rgba | Self::Astc(_) => 16,
        }
    }

    /// Returns the bytes of a mip level of this size, texels.
    #[must_use]
    pub fn level_bytes(self, width: u32, height: u32) -> u64 {
        let [block_width, block_height] = self.block_extent();
        let blocks = u64::from(width.div_ceil(block_width)) * u64::from(height.div_ceil(block_height));
        blocks.saturating_mul(self.block_bytes() as u64)
    }
}

impl Default for Sampler {
    /// Linear filters, mip levels, repeated: what the format leaves to the reader.
    fn default() -> Self {
        Self {
            mag_filter: Filter::Linear,
            min_filter: Filter::Linear,
            mip_filter: Some(Filter::Linear),
            wrap_u: Wrap::Repeat,
            wrap_v: Wrap::Repeat,
        }
    }
}
