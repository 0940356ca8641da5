//! Descriptions of textures: shape, format and uses.

use bitflags::bitflags;

use super::swizzle::Swizzle;
use crate::format::Format;

bitflags! {
    /// Allowed uses of a texture (`VkImageUsageFlags`). Copies are always allowed.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
    pub struct TextureUsage: u32 {
        /// Sampled or fetched by shaders.
        const SAMPLED = 1;
        /// Written and read by shaders as a storage image (mip 0).
        const STORAGE = 1 << 1;
        /// A colour or depth target of render passes.
        const TARGET = 1 << 2;
        /// A target that fragment shaders can also read in the pass that draws to it, by
        /// [`RenderPassDesc::local_read`](crate::RenderPassDesc::local_read). Must be combined with `TARGET`; needs
        /// [`OptionalFeature::LocalRead`](crate::OptionalFeature::LocalRead).
        const INPUT = 1 << 3;
        /// Shading rates of passes ([`RenderPassDesc::shading_rate`](crate::RenderPassDesc::shading_rate)). The texture
        /// must have one sample and the format [`R8Uint`](Format::R8Uint). Needs
        /// [`OptionalFeature::AttachmentShadingRate`](crate::OptionalFeature::AttachmentShadingRate).
        const SHADING_RATE = 1 << 4;
    }
}

/// Shape of a texture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum TextureKind {
    /// One row of texels, which cannot be a target. Shaders declare the array with
    /// `LVK_TEXTURES(texture1D, kTextures1D)`.
    D1,
    /// One 2D image: an element of `kTextures2D[]`.
    #[default]
    D2,
    /// Layers of 2D images: an element of `kTextures2DArray[]`.
    D2Array {
        /// Number of layers, at least 1.
        layers: u32,
    },
    /// Slices of a volume: an element of `kTextures3D[]`. Each mip has half the depth too. A volume has one layer.
    D3 {
        /// Number of slices of mip 0, at least 1.
        depth: u32,
    },
    /// Six faces in the order +X -X +Y -Y +Z -Z: an element of `kTexturesCube[]`.
    Cube,
    /// Cubes with six layers each. Shaders declare the array with `LVK_TEXTURES(textureCubeArray, kTexturesCubeArray)`.
    /// Needs [`Capabilities::cube_arrays`](crate::Capabilities).
    CubeArray {
        /// Number of cubes, at least 1.
        cubes: u32,
    },
}

impl TextureKind {
    /// Returns the number of layers of one mip. Each face of a cube is a layer; slices of a volume are not.
    pub fn layers(self) -> u32 {
        match self {
            Self::D1 | Self::D2 | Self::D3 { .. } => 1,
            Self::D2Array { layers } => layers,
            Self::Cube => 6,
            Self::CubeArray { cubes } => cubes.saturating_mul(6),
        }
    }

    /// Returns the number of slices of mip 0: 1 for all kinds but volumes.
    pub fn depth(self) -> u32 {
        if let Self::D3 { depth } = self { depth } else { 1 }
    }

    /// True if layers are faces of cubes.
    pub(crate) fn is_cube(self) -> bool {
        matches!(self, Self::Cube | Self::CubeArray { .. })
    }

    /// True if the texture is a volume.
    pub(crate) fn is_3d(self) -> bool {
        matches!(self, Self::D3 { .. })
    }
}

/// Memory of a texture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum TextureMemory {
    /// Device memory.
    #[default]
    Device,
    /// Lazily allocated memory, which exists only inside of render passes (`VK_MEMORY_PROPERTY_LAZILY_ALLOCATED_BIT`).
    /// Devices without such memory use device memory. The usage must be [`TextureUsage::TARGET`], optionally with
    /// [`INPUT`](TextureUsage::INPUT). Passes neither load nor store the texture, and it cannot be copied, cleared by a
    /// command or sampled.
    Transient,
}

/// Describes a texture.
#[derive(Debug, Clone, Copy)]
pub struct TextureDesc<'a> {
    /// Shape of the texture. Default: [`TextureKind::D2`].
    pub kind: TextureKind,
    /// Format of the texels. Default: [`Format::Rgba8Unorm`].
    pub format: Format,
    /// Width and height of mip 0 in texels. The height of a `D1` texture is 1. Default: `[1, 1]`.
    pub extent: [u32; 2],
    /// Number of mips; 0 is the whole chain down to one texel. Default: 1.
    pub mips: u32,
    /// Samples per texel: 1, or a power of two for a multisampled target, an element of `kTextures2DMS[]`. A
    /// multisampled texture has one mip and is `D2` or `D2Array`. It takes no data: passes and clears write it,
    /// resolves read it. [`Limits::color_samples`](crate::Limits) holds the supported counts. Default: 1.
    pub samples: u32,
    /// Allowed uses of the texture. Default: [`TextureUsage::SAMPLED`].
    pub usage: TextureUsage,
    /// Memory of the texture. Default: [`TextureMemory::Device`].
    pub memory: TextureMemory,
    /// Other colour formats with the same texel size that views may have
    /// ([`Context::create_texture_view`](crate::Context::create_texture_view)). With such formats, a usage is allowed
    /// if at least one of all the formats supports it. The texture itself has the usages that its own format supports.
    ///
    /// Any entry (`VK_IMAGE_CREATE_MUTABLE_FORMAT_BIT`) may disable the compression of the image, so list only the
    /// formats that are needed. Default: empty.
    pub view_formats: &'a [Format],
    /// Sources of the four channels that shaders sample. Storage images and targets are not swizzled.
    /// Default: [`Swizzle::IDENTITY`].
    pub swizzle: Swizzle,
    /// Initial contents, tightly packed: mip by mip from 0 on, with all layers or slices of a mip in order. Formats
    /// with depth and stencil take the depth only. Y'CbCr formats take all planes in order. Default: none.
    pub data: Option<&'a [u8]>,
    /// Number of mips in `data`; 0 is all mips of the texture. Default: 1.
    pub data_mips: u32,
    /// Index of the conversion of a Y'CbCr texture in [`ContextDesc::yuv`](crate::ContextDesc). `None` is the first one
    /// of the format. Default: none.
    pub conversion: Option<usize>,
    /// True if the other mips are created by halving mip 0, the only one in `data`. Needs a colour format that the
    /// device can filter, and more than one mip: with `mips: 0` the texture has all. Odd sides are halved as
    /// [`generate_mipmaps`](crate::CommandBuffer::generate_mipmaps) tells. Default: false.
    pub generate_mips: bool,
    /// Name in error messages, validation messages and debuggers. Default: `"texture"`.
    pub debug_name: &'a str,
}

impl TextureDesc<'_> {
    /// Returns the number of mips of the whole chain, from mip 0 down to one texel.
    pub(crate) fn full_mips(&self) -> u32 {
        let [width, height] = self.extent;
        32 - width.max(height).max(self.kind.depth()).leading_zeros()
    }
}

impl Default for TextureDesc<'_> {
    fn default() -> Self {
        Self {
            kind: TextureKind::D2,
            format: Format::Rgba8Unorm,
            extent: [1, 1],
            mips: 1,
            samples: 1,
            usage: TextureUsage::SAMPLED,
            memory: TextureMemory::Device,
            view_formats: &[],
            swizzle: Swizzle::IDENTITY,
            data: None,
            data_mips: 1,
            conversion: None,
            generate_mips: false,
            debug_name: "texture",
        }
    }
}
