//! Formats: of texels, with the sizes of what copies move, of vertices, and of indices.

mod table;
mod vertex;

use ash::vk;

pub use table::Format;
pub use vertex::{IndexFormat, VertexFormat};

use table::CompatibilityClass;

/// Which part of the texels a transfer moves or a view shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Aspect {
    /// The colour, or the depth; of a format of stencil alone, that.
    #[default]
    Main,
    /// The stencil, one byte a texel.
    Stencil,
    /// A plane of a format in Y'CbCr, from 0 on. Its texels count by themselves: of colour differences there are half as many
    /// columns and rows.
    Plane(u8),
}

/// How shaders read colours.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum NumericFormat {
    Float,
    Uint,
    Sint,
}

/// One aspect of a format, as copies name and pack it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct CopyAspect {
    pub(crate) aspect: vk::ImageAspectFlags,
    /// Width and height of the smallest piece that can be copied, in texels.
    pub(crate) block: [u32; 2],
    pub(crate) block_bytes: u32,
    /// Texels of the image along x and y for one of the aspect.
    pub(crate) shrink: u32,
}

impl CopyAspect {
    /// Bytes of a box of texels, tightly packed; what is not a whole block counts as one.
    pub(crate) fn bytes(&self, [width, height, depth]: [u32; 3]) -> u64 {
        let blocks = self.block_count([width, height]).map(u64::from);
        let layers = [depth.into(), self.block_bytes.into()];
        layers.into_iter().chain(blocks).fold(1, u64::saturating_mul)
    }

    /// Width, height and depth of the aspect where the image has these.
    pub(crate) fn aspect_extent(&self, [width, height, depth]: [u32; 3]) -> [u32; 3] {
        [width.div_ceil(self.shrink), height.div_ceil(self.shrink), depth]
    }

    /// Columns and rows of blocks that cover so many texels.
    pub(crate) fn block_count(&self, extent: [u32; 2]) -> [u32; 2] {
        [extent[0].div_ceil(self.block[0]), extent[1].div_ceil(self.block[1])]
    }
}

impl Format {
    /// Bytes of a box of texels, width x height x depth, as uploads and downloads move it, tightly packed: the colour, or
    /// the depth without its stencil, or all planes one after the other. Compressed formats round up to whole [blocks](Self::block_extent).
    pub fn bytes(self, extent: [u32; 3]) -> u64 {
        let Some(main) = self.copy_aspect(Aspect::Main) else {
            return self.planes().map(|plane| plane.bytes(plane.aspect_extent(extent))).sum();
        };
        main.bytes(extent)
    }

    /// Width and height of a block in texels: 4 x 4 of BC and ETC2, up to 12 x 12 of ASTC, and 1 x 1 of everything that is
    /// not compressed.
    pub fn block_extent(self) -> [u32; 2] {
        self.block().texels
    }

    /// Whether texels are compressed in blocks.
    pub fn is_compressed(self) -> bool {
        self.class() == CompatibilityClass::TexelBlock
    }

    /// Whether texels are in Y'CbCr, in several planes.
    pub fn is_yuv(self) -> bool {
        matches!(self.class(), CompatibilityClass::TwoPlanes | CompatibilityClass::ThreePlanes)
    }

    /// The format in which a plane is seen by itself: numbers of 16 bits where 10 of them count. `None` where there is no such
    /// plane.
    pub fn plane_format(self, plane: u8) -> Option<Self> {
        let wide = self.block().bytes == 2;
        match (self.class(), plane) {
            (CompatibilityClass::TwoPlanes | CompatibilityClass::ThreePlanes, 0)
            | (CompatibilityClass::ThreePlanes, 1 | 2) => {
                Some(if wide { Self::R16Unorm } else { Self::R8Unorm })
            }
            (CompatibilityClass::TwoPlanes, 1) => Some(if wide { Self::Rg16Unorm } else { Self::Rg8Unorm }),
            _ => None,
        }
    }

    /// Whether texels hold depth, with or without stencil.
    pub fn is_depth(self) -> bool {
        matches!(self.class(), CompatibilityClass::Depth | CompatibilityClass::DepthStencil)
    }

    /// Whether texels hold stencil.
    pub fn has_stencil(self) -> bool {
        matches!(self.class(), CompatibilityClass::Stencil | CompatibilityClass::DepthStencil)
    }

    /// Whether texels hold colour: neither depth nor stencil.
    pub fn is_color(self) -> bool {
        !self.is_depth() && !self.has_stencil()
    }

    /// Whether shaders read texels as unsigned integers.
    pub fn is_uint(self) -> bool {
        matches!(self.class(), CompatibilityClass::Uint | CompatibilityClass::Stencil)
    }

    /// Whether shaders read texels as signed integers.
    pub fn is_sint(self) -> bool {
        self.class() == CompatibilityClass::Sint
    }

    pub(crate) fn numeric_format(self) -> NumericFormat {
        match self.class() {
            CompatibilityClass::Uint | CompatibilityClass::Stencil => NumericFormat::Uint,
            CompatibilityClass::Sint => NumericFormat::Sint,
            _ => NumericFormat::Float,
        }
    }

    /// All aspects, as barriers name them.
    pub(crate) fn aspects(self) -> vk::ImageAspectFlags {
        match self.class() {
            CompatibilityClass::Depth => vk::ImageAspectFlags::DEPTH,
            CompatibilityClass::Stencil => vk::ImageAspectFlags::STENCIL,
            CompatibilityClass::DepthStencil => vk::ImageAspectFlags::DEPTH | vk::ImageAspectFlags::STENCIL,
            _ => vk::ImageAspectFlags::COLOR,
        }
    }

    /// An aspect as copies move it, `None` where the format lacks it.
    pub(crate) fn copy_aspect(self, aspect: Aspect) -> Option<CopyAspect> {
        match aspect {
            Aspect::Main => (!self.is_yuv()).then(|| self.main_aspect()),
            Aspect::Plane(plane) => self.plane(plane),
            Aspect::Stencil => self.has_stencil().then_some(CopyAspect {
                aspect: vk::ImageAspectFlags::STENCIL,
                block: [1, 1],
                block_bytes: 1,
                shrink: 1,
            }),
        }
    }

    fn main_aspect(self) -> CopyAspect {
        let block = self.block();
        let depth = vk::ImageAspectFlags::DEPTH;
        let aspect = if self.is_depth() { depth } else { self.aspects() };
        CopyAspect { aspect, block: block.texels, block_bytes: block.bytes, shrink: 1 }
    }

    /// A plane as copies name it.
    fn plane(self, plane: u8) -> Option<CopyAspect> {
        const ASPECTS: [vk::ImageAspectFlags; 3] =
            [vk::ImageAspectFlags::PLANE_0, vk::ImageAspectFlags::PLANE_1, vk::ImageAspectFlags::PLANE_2];
        let seen = self.plane_format(plane)?;
        let aspect = *ASPECTS.get(usize::from(plane))?;
        let shrink = if plane == 0 { 1 } else { 2 };
        Some(CopyAspect { aspect, block: [1, 1], block_bytes: seen.block().bytes, shrink })
    }

    fn planes(self) -> impl Iterator<Item = CopyAspect> {
        (0..3).filter_map(move |plane| self.plane(plane))
    }

    /// The aspects that together are all of the texels that uploads move.
    pub(crate) fn uploaded_aspects(self) -> impl Iterator<Item = Aspect> {
        let planes = (0..3).filter(move |plane| self.plane_format(*plane).is_some()).map(Aspect::Plane);
        (!self.is_yuv()).then_some(Aspect::Main).into_iter().chain(planes)
    }

    /// Whether images of one format may be seen in the other: colours of the same number of bytes, and of compressed
    /// ones the same compression.
    pub(crate) fn is_viewable_as(self, other: Self) -> bool {
        if self.is_compressed() || other.is_compressed() {
            return self == other
                || self.compression_family().is_some_and(|own| other.compression_family() == Some(own));
        }
        self.is_color()
            && other.is_color()
            && self.block() == other.block()
            && !self.is_alpha()
            && !other.is_alpha()
            || self == other
    }

    /// Vulkan counts the two forms of each compression, linear or unsigned and the other, one after the other.
    fn compression_family(self) -> Option<i32> {
        const FIRST: i32 = vk::Format::BC1_RGB_UNORM_BLOCK.as_raw();
        self.is_compressed().then(|| (self.raw().as_raw() - FIRST) / 2)
    }

    /// Alpha alone is a class of its own.
    fn is_alpha(self) -> bool {
        self == Self::A8Unorm
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_of_blocks_round_up() {
        assert_eq!(Format::Rgba8Unorm.bytes([5, 3, 2]), 120);
        assert_eq!(Format::Bc1RgbaUnorm.bytes([5, 3, 1]), 16);
        assert_eq!(Format::Bc7Srgb.bytes([1, 1, 3]), 48);
        assert_eq!(Format::Astc10x6Unorm.bytes([20, 13, 1]), 2 * 3 * 16);
        assert_eq!(Format::D32FloatS8.bytes([2, 2, 1]), 16);
        assert_eq!(
            Format::D32FloatS8.copy_aspect(Aspect::Stencil).map(|part| part.bytes([2, 2, 1])),
            Some(4)
        );
        assert_eq!(Format::D32Float.copy_aspect(Aspect::Stencil), None);
        assert_eq!(Format::S8Uint.copy_aspect(Aspect::Main), Format::S8Uint.copy_aspect(Aspect::Stencil));
        assert_eq!(Format::Rgba32Float.bytes([u32::MAX; 3]), u64::MAX);
    }

    #[test]
    fn planes_of_differences_are_a_quarter_each() {
        assert_eq!(Format::Nv12.bytes([8, 4, 1]), 32 + 16);
        assert_eq!(Format::Yuv420p10.bytes([8, 4, 1]), 2 * (32 + 8 + 8));
        assert_eq!(
            Format::P010.copy_aspect(Aspect::Plane(1)).map(|part| (part.block_bytes, part.shrink)),
            Some((4, 2))
        );
        assert_eq!(Format::Nv12.copy_aspect(Aspect::Plane(2)), None);
        assert_eq!(Format::Nv12.copy_aspect(Aspect::Main), None);
        assert_eq!(Format::Rgba8Unorm.copy_aspect(Aspect::Plane(0)), None);
        assert_eq!(Format::Yuv420p8.uploaded_aspects().count(), 3);
        assert_eq!(Format::D32FloatS8.uploaded_aspects().collect::<Vec<_>>(), [Aspect::Main]);
    }

    #[test]
    fn compressions_pair_up() {
        let pairs = [
            (Format::Bc1RgbUnorm, Format::Bc1RgbSrgb),
            (Format::Bc4Unorm, Format::Bc4Snorm),
            (Format::Bc6hUfloat, Format::Bc6hFloat),
            (Format::Bc7Unorm, Format::Bc7Srgb),
            (Format::Etc2Rgba8Unorm, Format::Etc2Rgba8Srgb),
            (Format::EacRg11Unorm, Format::EacRg11Snorm),
            (Format::Astc12x12Unorm, Format::Astc12x12Srgb),
        ];
        assert!(pairs.iter().all(|(a, b)| a.is_viewable_as(*b) && b.is_viewable_as(*a)));
        for format in Format::ALL.iter().filter(|format| format.is_compressed()) {
            let others = Format::ALL.iter().filter(|other| format.is_viewable_as(**other));
            assert_eq!(others.count(), 2, "{format:?}");
        }
        assert!(!Format::Bc1RgbUnorm.is_viewable_as(Format::Bc1RgbaUnorm));
        assert!(!Format::Bc1RgbaUnorm.is_viewable_as(Format::Rg32Uint));
        assert!(Format::Rgba8Unorm.is_viewable_as(Format::R32Float));
        assert!(!Format::D32Float.is_viewable_as(Format::R32Float));
        assert!(!Format::A8Unorm.is_viewable_as(Format::R8Unorm));
    }

    #[test]
    fn every_format_is_of_one_kind() {
        for format in Format::ALL {
            assert_eq!(format.block_extent() != [1, 1], format.is_compressed(), "{format:?}");
            let aspects = usize::from(format.is_color())
                + usize::from(format.is_depth())
                + usize::from(format.has_stencil());
            assert_eq!(format.aspects().as_raw().count_ones() as usize, aspects, "{format:?}");
        }
    }
}
