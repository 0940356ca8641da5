//! Formats of vertices and indices.

use ash::vk;

macro_rules! vertex_formats {
    ($($(#[$meta:meta])* $name:ident = $raw:ident, $bytes:literal, $component:literal, $position:literal;)*) => {
        /// Format of a vertex attribute. Shaders read floats and normalised values as `float` and its
        /// vectors, other integers as `int` or `uint` and their vectors.
        ///
        /// Acceleration structures can be built from positions as floats, half floats,
        /// [`Snorm16x2`](Self::Snorm16x2), [`Snorm16x4`](Self::Snorm16x4), [`Unorm8x4`](Self::Unorm8x4) or
        /// [`U32`](Self::U32), if the device supports the format. [`F32x3`](Self::F32x3) always works.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
        #[non_exhaustive]
        pub enum VertexFormat {
            $($(#[$meta])* $name,)*
        }

        impl VertexFormat {
            /// Every format.
            pub const ALL: &'static [Self] = &[$(Self::$name),*];

            pub(crate) fn raw(self) -> vk::Format {
                match self {
                    $(Self::$name => vk::Format::$raw,)*
                }
            }

            /// Returns the size of one attribute in bytes.
            pub fn size_bytes(self) -> u32 {
                match self {
                    $(Self::$name => $bytes,)*
                }
            }

            /// Returns the size of one component in bytes, which is the alignment of addresses and strides.
            pub(crate) fn component_bytes(self) -> u32 {
                match self {
                    $(Self::$name => $component,)*
                }
            }

            /// True if the library can build acceleration structures from positions of this format.
            pub(crate) fn is_position(self) -> bool {
                match self {
                    $(Self::$name => $position,)*
                }
            }
        }
    };
}

vertex_formats! {
    /// One float.
    F32 = R32_SFLOAT, 4, 4, true;
    /// Two floats.
    F32x2 = R32G32_SFLOAT, 8, 4, true;
    /// Three floats.
    #[default]
    F32x3 = R32G32B32_SFLOAT, 12, 4, true;
    /// Four floats.
    F32x4 = R32G32B32A32_SFLOAT, 16, 4, true;
    /// Two half floats.
    F16x2 = R16G16_SFLOAT, 4, 2, true;
    /// Four half floats.
    F16x4 = R16G16B16A16_SFLOAT, 8, 2, true;
    /// Two signed normalised 16-bit integers.
    Snorm16x2 = R16G16_SNORM, 4, 2, true;
    /// Four signed normalised 16-bit integers.
    Snorm16x4 = R16G16B16A16_SNORM, 8, 2, true;
    /// Two normalised 16-bit integers.
    Unorm16x2 = R16G16_UNORM, 4, 2, false;
    /// Four normalised 16-bit integers.
    Unorm16x4 = R16G16B16A16_UNORM, 8, 2, false;
    /// Two 16-bit integers.
    I16x2 = R16G16_SINT, 4, 2, false;
    /// Four 16-bit integers.
    I16x4 = R16G16B16A16_SINT, 8, 2, false;
    /// Two 16-bit unsigned integers.
    U16x2 = R16G16_UINT, 4, 2, false;
    /// Four 16-bit unsigned integers.
    U16x4 = R16G16B16A16_UINT, 8, 2, false;
    /// Four normalised bytes.
    Unorm8x4 = R8G8B8A8_UNORM, 4, 1, true;
    /// Four signed normalised bytes.
    Snorm8x4 = R8G8B8A8_SNORM, 4, 1, false;
    /// Four signed bytes.
    I8x4 = R8G8B8A8_SINT, 4, 1, false;
    /// Four bytes.
    U8x4 = R8G8B8A8_UINT, 4, 1, false;
    /// Three normalised 10-bit integers, starting at the lowest bits, and one of 2 bits.
    Unorm10x3A2 = A2B10G10R10_UNORM_PACK32, 4, 4, false;
    /// One 32-bit integer.
    I32 = R32_SINT, 4, 4, false;
    /// Two 32-bit integers.
    I32x2 = R32G32_SINT, 8, 4, false;
    /// Three 32-bit integers.
    I32x3 = R32G32B32_SINT, 12, 4, false;
    /// Four 32-bit integers.
    I32x4 = R32G32B32A32_SINT, 16, 4, false;
    /// One 32-bit unsigned integer.
    U32 = R32_UINT, 4, 4, true;
    /// Two 32-bit unsigned integers.
    U32x2 = R32G32_UINT, 8, 4, false;
    /// Three 32-bit unsigned integers.
    U32x3 = R32G32B32_UINT, 12, 4, false;
    /// Four 32-bit unsigned integers.
    U32x4 = R32G32B32A32_UINT, 16, 4, false;
}

/// Format of indices.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum IndexFormat {
    /// 8-bit indices, for draws only
    /// ([`OptionalFeature::IndexTypeUint8`](crate::OptionalFeature::IndexTypeUint8)).
    U8,
    /// 16-bit indices.
    U16,
    /// 32-bit indices.
    #[default]
    U32,
}

impl IndexFormat {
    pub(crate) fn raw(self) -> vk::IndexType {
        match self {
            Self::U8 => vk::IndexType::UINT8_KHR,
            Self::U16 => vk::IndexType::UINT16,
            Self::U32 => vk::IndexType::UINT32,
        }
    }

    /// Returns the size of one index in bytes.
    pub fn size_bytes(self) -> u32 {
        match self {
            Self::U8 => 1,
            Self::U16 => 2,
            Self::U32 => 4,
        }
    }
}
