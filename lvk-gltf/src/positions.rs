//! Positions of vertices, in the formats of `KHR_mesh_quantization`.

/// Positions of vertices, in the format of the file.
///
/// Integers have a fourth component, which is zero, so that each vertex is aligned to four bytes. Normalised integers are read as
/// Vulkan reads them: signed ones as `max(n / 127, -1)` or `max(n / 32767, -1)`, unsigned ones as `n / 255` or `n / 65535`. The
/// transform of the node usually scales them to the mesh's size.
#[derive(Debug, Clone, PartialEq)]
pub enum Positions {
    /// Three floats, 12 bytes a vertex (`VK_FORMAT_R32G32B32_SFLOAT`).
    F32(Vec<[f32; 3]>),
    /// Signed normalised 16 bits (`VK_FORMAT_R16G16B16A16_SNORM`).
    Snorm16(Vec<[i16; 4]>),
    /// Unsigned normalised 16 bits (`VK_FORMAT_R16G16B16A16_UNORM`).
    Unorm16(Vec<[u16; 4]>),
    /// Signed integers of 16 bits (`VK_FORMAT_R16G16B16A16_SSCALED`).
    Sint16(Vec<[i16; 4]>),
    /// Unsigned integers of 16 bits (`VK_FORMAT_R16G16B16A16_USCALED`).
    Uint16(Vec<[u16; 4]>),
    /// Signed normalised 8 bits (`VK_FORMAT_R8G8B8A8_SNORM`).
    Snorm8(Vec<[i8; 4]>),
    /// Unsigned normalised 8 bits (`VK_FORMAT_R8G8B8A8_UNORM`).
    Unorm8(Vec<[u8; 4]>),
    /// Signed integers of 8 bits (`VK_FORMAT_R8G8B8A8_SSCALED`).
    Sint8(Vec<[i8; 4]>),
    /// Unsigned integers of 8 bits (`VK_FORMAT_R8G8B8A8_USCALED`).
    Uint8(Vec<[u8; 4]>),
}

impl Positions {
    /// Returns the number of positions.
    #[must_use]
    pub fn len(&self) -> usize {
        match self {
            Self::F32(all) => all.len(),
            Self::Snorm16(all) | Self::Sint16(all) => all.len(),
            Self::Unorm16(all) | Self::Uint16(all) => all.len(),
            Self::Snorm8(all) | Self::Sint8(all) => all.len(),
            Self::Unorm8(all) | Self::Uint8(all) => all.len(),
        }
    }

    /// Says whether there are no positions.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns a position, decoded, or `None` if the index is out of range.
    #[must_use]
    pub fn get(&self, index: usize) -> Option<[f32; 3]> {
        match self {
            Self::F32(all) => all.get(index).copied(),
            Self::Snorm16(all) => all.get(index).map(|p| three(p, |n| (f32::from(n) / 32767.0).max(-1.0))),
            Self::Unorm16(all) => all.get(index).map(|p| three(p, |n| f32::from(n) / 65535.0)),
            Self::Sint16(all) => all.get(index).map(|p| three(p, f32::from)),
            Self::Uint16(all) => all.get(index).map(|p| three(p, f32::from)),
            Self::Snorm8(all) => all.get(index).map(|p| three(p, |n| (f32::from(n) / 127.0).max(-1.0))),
            Self::Unorm8(all) => all.get(index).map(|p| three(p, |n| f32::from(n) / 255.0)),
            Self::Sint8(all) => all.get(index).map(|p| three(p, f32::from)),
            Self::Uint8(all) => all.get(index).map(|p| three(p, f32::from)),
        }
    }

    /// Returns all positions, decoded.
    pub fn iter(&self) -> impl Iterator<Item = [f32; 3]> + '_ {
        (0..self.len()).filter_map(|index| self.get(index))
    }

    /// Returns the bytes of the positions, as a GPU reads them.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        match self {
            Self::F32(all) => bytemuck::cast_slice(all),
            Self::Snorm16(all) | Self::Sint16(all) => bytemuck::cast_slice(all),
            Self::Unorm16(all) | Self::Uint16(all) => bytemuck::cast_slice(all),
            Self::Snorm8(all) | Self::Sint8(all) => bytemuck::cast_slice(all),
            Self::Unorm8(all) | Self::Uint8(all) => bytemuck::cast_slice(all),
        }
    }

    /// Returns the distance of two positions in [`Positions::bytes`]: 12, 8 or 4 bytes.
    #[must_use]
    pub fn stride_bytes(&self) -> usize {
        match self {
            Self::F32(_) => 12,
            Self::Snorm16(_) | Self::Unorm16(_) | Self::Sint16(_) | Self::Uint16(_) => 8,
            Self::Snorm8(_) | Self::Unorm8(_) | Self::Sint8(_) | Self::Uint8(_) => 4,
        }
    }
}

impl Default for Positions {
    fn default() -> Self {
        Self::F32(Vec::new())
    }
}

fn three<T: Copy>(position: &[T; 4], decode: impl Fn(T) -> f32) -> [f32; 3] {
    [decode(position[0]), decode(position[1]), decode(position[2])]
}
