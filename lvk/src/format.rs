//! Formats of texels, vertices and indices, each with its Vulkan name and size in one table.

use ash::vk;

macro_rules! formats {
    ($($(#[$doc:meta])* $name:ident = $raw:ident, $bytes:literal, $class:ident;)*) => {
        /// Format of the texels of a texture or a render target.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        #[non_exhaustive]
        pub enum Format {
            $($(#[$doc])* $name,)*
        }

        impl Format {
            /// Every format of the library.
            pub const ALL: &'static [Self] = &[$(Self::$name),*];

            pub(crate) fn raw(self) -> vk::Format {
                match self {
                    $(Self::$name => vk::Format::$raw,)*
                }
            }

            /// Bytes of one texel as uploads and downloads move it: the colour, or the depth without its stencil.
            pub fn texel_bytes(self) -> u32 {
                match self {
                    $(Self::$name => $bytes,)*
                }
            }

            fn class(self) -> Class {
                match self {
                    $(Self::$name => Class::$class,)*
                }
            }
        }
    };
}

#[derive(PartialEq, Eq)]
enum Class {
    Float,
    Uint,
    Depth,
    DepthStencil,
}

formats! {
    /// One 8-bit normalised channel.
    R8Unorm = R8_UNORM, 1, Float;
    /// Two 8-bit normalised channels.
    Rg8Unorm = R8G8_UNORM, 2, Float;
    /// Four 8-bit normalised channels.
    Rgba8Unorm = R8G8B8A8_UNORM, 4, Float;
    /// Four 8-bit channels, colour encoded as sRGB.
    Rgba8Srgb = R8G8B8A8_SRGB, 4, Float;
    /// Four 8-bit normalised channels, blue first.
    Bgra8Unorm = B8G8R8A8_UNORM, 4, Float;
    /// Four 8-bit channels, blue first, colour encoded as sRGB.
    Bgra8Srgb = B8G8R8A8_SRGB, 4, Float;
    /// Four 8-bit signed normalised channels.
    Rgba8Snorm = R8G8B8A8_SNORM, 4, Float;
    /// Three 10-bit normalised channels and 2 bits of alpha.
    Rgb10A2Unorm = A2B10G10R10_UNORM_PACK32, 4, Float;
    /// Three small unsigned floats.
    Rg11B10Float = B10G11R11_UFLOAT_PACK32, 4, Float;
    /// One half float.
    R16Float = R16_SFLOAT, 2, Float;
    /// Two half floats.
    Rg16Float = R16G16_SFLOAT, 4, Float;
    /// Four half floats.
    Rgba16Float = R16G16B16A16_SFLOAT, 8, Float;
    /// One float.
    R32Float = R32_SFLOAT, 4, Float;
    /// Two floats.
    Rg32Float = R32G32_SFLOAT, 8, Float;
    /// Four floats.
    Rgba32Float = R32G32B32A32_SFLOAT, 16, Float;
    /// One 8-bit unsigned integer.
    R8Uint = R8_UINT, 1, Uint;
    /// One 16-bit unsigned integer.
    R16Uint = R16_UINT, 2, Uint;
    /// One 32-bit unsigned integer.
    R32Uint = R32_UINT, 4, Uint;
    /// Two 32-bit unsigned integers.
    Rg32Uint = R32G32_UINT, 8, Uint;
    /// Four 32-bit unsigned integers.
    Rgba32Uint = R32G32B32A32_UINT, 16, Uint;
    /// 16-bit normalised depth.
    D16Unorm = D16_UNORM, 2, Depth;
    /// Float depth.
    D32Float = D32_SFLOAT, 4, Depth;
    /// 24-bit depth and 8-bit stencil.
    D24UnormS8 = D24_UNORM_S8_UINT, 4, DepthStencil;
    /// Float depth and 8-bit stencil.
    D32FloatS8 = D32_SFLOAT_S8_UINT, 4, DepthStencil;
}

impl Format {
    /// Whether texels hold depth, with or without stencil.
    pub fn is_depth(self) -> bool {
        matches!(self.class(), Class::Depth | Class::DepthStencil)
    }

    /// Whether shaders read texels as unsigned integers.
    pub fn is_uint(self) -> bool {
        self.class() == Class::Uint
    }

    /// Whether texels hold stencil.
    pub fn has_stencil(self) -> bool {
        self.class() == Class::DepthStencil
    }

    /// All aspects, as barriers name them.
    pub(crate) fn aspects(self) -> vk::ImageAspectFlags {
        match self.class() {
            Class::Float | Class::Uint => vk::ImageAspectFlags::COLOR,
            Class::Depth => vk::ImageAspectFlags::DEPTH,
            Class::DepthStencil => vk::ImageAspectFlags::DEPTH | vk::ImageAspectFlags::STENCIL,
        }
    }

    /// The aspect shaders sample and copies move.
    pub(crate) fn sampled_aspect(self) -> vk::ImageAspectFlags {
        if self.is_depth() { vk::ImageAspectFlags::DEPTH } else { vk::ImageAspectFlags::COLOR }
    }
}

/// Format of a vertex attribute, and of positions an acceleration structure is built from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[non_exhaustive]
pub enum VertexFormat {
    /// One float.
    F32,
    /// Two floats.
    F32x2,
    /// Three floats.
    #[default]
    F32x3,
    /// Four floats.
    F32x4,
    /// Two half floats.
    F16x2,
    /// Four half floats.
    F16x4,
    /// Two signed normalised 16-bit integers.
    Snorm16x2,
    /// Four signed normalised 16-bit integers.
    Snorm16x4,
    /// Four normalised bytes.
    Unorm8x4,
    /// One 32-bit unsigned integer.
    U32,
}

impl VertexFormat {
    pub(crate) fn raw(self) -> vk::Format {
        match self {
            Self::F32 => vk::Format::R32_SFLOAT,
            Self::F32x2 => vk::Format::R32G32_SFLOAT,
            Self::F32x3 => vk::Format::R32G32B32_SFLOAT,
            Self::F32x4 => vk::Format::R32G32B32A32_SFLOAT,
            Self::F16x2 => vk::Format::R16G16_SFLOAT,
            Self::F16x4 => vk::Format::R16G16B16A16_SFLOAT,
            Self::Snorm16x2 => vk::Format::R16G16_SNORM,
            Self::Snorm16x4 => vk::Format::R16G16B16A16_SNORM,
            Self::Unorm8x4 => vk::Format::R8G8B8A8_UNORM,
            Self::U32 => vk::Format::R32_UINT,
        }
    }

    /// Bytes of one attribute.
    pub fn size_bytes(self) -> u32 {
        match self {
            Self::F32 | Self::F16x2 | Self::Snorm16x2 | Self::Unorm8x4 | Self::U32 => 4,
            Self::F32x2 | Self::F16x4 | Self::Snorm16x4 => 8,
            Self::F32x3 => 12,
            Self::F32x4 => 16,
        }
    }

    /// Bytes of one component: the alignment of addresses and strides of build inputs.
    pub(crate) fn component_bytes(self) -> u32 {
        match self {
            Self::F16x2 | Self::F16x4 | Self::Snorm16x2 | Self::Snorm16x4 => 2,
            Self::Unorm8x4 => 1,
            _ => 4,
        }
    }
}

/// Format of indices.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum IndexFormat {
    /// 16-bit indices.
    U16,
    /// 32-bit indices.
    #[default]
    U32,
}

impl IndexFormat {
    pub(crate) fn raw(self) -> vk::IndexType {
        match self {
            Self::U16 => vk::IndexType::UINT16,
            Self::U32 => vk::IndexType::UINT32,
        }
    }

    /// Bytes of one index.
    pub fn size_bytes(self) -> u32 {
        match self {
            Self::U16 => 2,
            Self::U32 => 4,
        }
    }
}
