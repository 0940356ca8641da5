//! Formats of vertices and indices.

use ash::vk;

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
