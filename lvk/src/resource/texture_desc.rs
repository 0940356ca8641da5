//! What callers say of a texture: its shape, format and uses.

use bitflags::bitflags;

use super::swizzle::Swizzle;
use crate::format::Format;

bitflags! {
    /// What a texture is used for, besides copies, which are always allowed.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
    pub struct TextureUsage: u32 {
        /// Sampled or fetched by shaders.
        const SAMPLED = 1;
        /// Written and read by shaders as a storage image (mip 0).
        const STORAGE = 1 << 1;
        /// A colour or depth target of render passes.
        const TARGET = 1 << 2;
        /// A target that fragment shaders of its own pass read too, by
        /// [`RenderPassDesc::local_read`](crate::RenderPassDesc::local_read). Goes with `TARGET`; needs
        /// [`OptionalFeature::LocalRead`](crate::OptionalFeature::LocalRead).
        const INPUT = 1 << 3;
        /// Shading rates of passes
        /// ([`RenderPassDesc::shading_rate`](crate::RenderPassDesc::shading_rate)), of one sample and the format
        /// [`R8Uint`](Format::R8Uint). Needs
        /// [`OptionalFeature::AttachmentShadingRate`](crate::OptionalFeature::AttachmentShadingRate).
        const SHADING_RATE = 1 << 4;
    }
}

/// Shape of a texture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum TextureKind {
    /// One row of texels, which is not drawn to: an element of what `LVK_TEXTURES(texture1D, kTextures1D)` declares in a
    /// shader.
    D1,
    /// One 2D image: an element of `kTextures2D[]`.
    #[default]
    D2,
    /// Layers of 2D images: an element of `kTextures2DArray[]`.
    D2Array {
        /// Number of layers, at least 1.
        layers: u32,
    },
    /// Slices of a volume: an element of `kTextures3D[]`. Its mips halve in depth too; it has one layer.
    D3 {
        /// Number of slices of mip 0, at least 1.
        depth: u32,
    },
    /// Six faces in the order +X -X +Y -Y +Z -Z: an element of `kTexturesCube[]`.
    Cube,
    /// Cubes, each with six layers: an element of what `LVK_TEXTURES(textureCubeArray, kTexturesCubeArray)` declares
    /// in a shader. Needs [`Capabilities::cube_arrays`](crate::Capabilities).
    CubeArray {
        /// Number of cubes, at least 1.
        cubes: u32,
    },
}

impl TextureKind {
    /// Images of one mip; faces of cubes count each. Slices of a volume are no layers.
    pub fn layers(self) -> u32 {
        match self {
            Self::D1 | Self::D2 | Self::D3 { .. } => 1,
            Self::D2Array { layers } => layers,
            Self::Cube => 6,
            Self::CubeArray { cubes } => cubes.saturating_mul(6),
        }
    }

    /// Slices of mip 0: 1 for all but volumes.
    pub fn depth(self) -> u32 {
        if let Self::D3 { depth } = self { depth } else { 1 }
    }

    /// Whether layers are faces.
    pub(crate) fn is_cube(self) -> bool {
        matches!(self, Self::Cube | Self::CubeArray { .. })
    }

    /// Whether the texture is a volume.
    pub(crate) fn is_3d(self) -> bool {
        matches!(self, Self::D3 { .. })
    }
}

/// Where a texture lives.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum TextureMemory {
    /// In memory of its own.
    #[default]
    Device,
    /// Only inside of render passes, on devices that can (`VK_MEMORY_PROPERTY_LAZILY_ALLOCATED_BIT`); elsewhere in memory of
    /// its own. Such a texture is a [`TextureUsage::TARGET`], perhaps an [`INPUT`](TextureUsage::INPUT) too, and nothing else:
    /// passes neither load nor store it, and it is not copied, cleared by command or sampled.
    Transient,
}

/// Describes a texture.
#[derive(Debug, Clone, Copy)]
pub struct TextureDesc<'a> {
    /// Shape.
    pub kind: TextureKind,
    /// Format of the texels.
    pub format: Format,
    /// Width and height of mip 0 in texels; the height of a row is 1.
    pub extent: [u32; 2],
    /// Number of mips; 0 is the whole chain down to one texel.
    pub mips: u32,
    /// Samples a texel: 1, or a power of two for a multisampled target, an element of `kTextures2DMS[]`. It has one mip,
    /// is `D2` or `D2Array`, and takes no data: passes and clears write it, resolves read it.
    /// [`Limits::color_samples`](crate::Limits) says which counts there are.
    pub samples: u32,
    /// What the texture is used for.
    pub usage: TextureUsage,
    /// Where the texture lives.
    pub memory: TextureMemory,
    /// Other colour formats, of texels of the same size, in which
    /// [`Context::create_texture_view`](crate::Context::create_texture_view) may show the texels. A usage is then enough if
    /// one of all these formats has it; the texture itself keeps what its own format can.
    ///
    /// Any (`VK_IMAGE_CREATE_MUTABLE_FORMAT_BIT`) may cost the compression of the image, so list none without need.
    pub view_formats: &'a [Format],
    /// Which channels of a texel the four that shaders sample are. Storage images and targets show the channels as they are.
    pub swizzle: Swizzle,
    /// First contents, tightly packed: of each mip in turn, from 0 on, all layers or slices one after the other. Of depth
    /// with stencil the depth; of Y'CbCr all planes one after the other.
    pub data: Option<&'a [u8]>,
    /// Number of mips that `data` has; 0 is all.
    pub data_mips: u32,
    /// Which of [`ContextDesc::yuv`](crate::ContextDesc) converts a texture in Y'CbCr; `None` is the first of its format.
    pub conversion: Option<usize>,
    /// Fills the other mips by halving the last of `data`, which holds one (colour formats the device can filter).
    pub generate_mips: bool,
    /// Name in error messages, validation messages and debuggers.
    pub debug_name: &'a str,
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
