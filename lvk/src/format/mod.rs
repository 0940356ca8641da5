//! Formats of texels, vertices and indices, with the byte sizes of copies.

mod components;
mod table;
mod vertex;

use ash::vk;

pub use table::Format;
pub use vertex::{IndexFormat, VertexFormat};

use table::CompatibilityClass;

/// Part of the texels that a copy moves or a view accesses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Aspect {
    /// The colour or the depth. For stencil-only formats, the stencil.
    #[default]
    Main,
    /// The stencil, one byte per texel.
    Stencil,
    /// A plane of a Y'CbCr format, counted from 0. The plane has its own texel grid: planes of colour
    /// differences have half the columns and rows.
    Plane(u8),
}

/// Numeric type with which shaders read colours.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum NumericFormat {
    Float,
    Uint,
    Sint,
}

/// One aspect of a format in copies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct CopyAspect {
    pub(crate) aspect: vk::ImageAspectFlags,
    /// Width and height of the smallest copyable block, in texels.
    pub(crate) block: [u32; 2],
    pub(crate) block_bytes: u32,
    /// Number of image texels per aspect texel, along x and y.
    pub(crate) shrink: u32,
}

impl CopyAspect {
    /// Returns the bytes of a region of texels, tightly packed. Partial blocks count as whole blocks.
    pub(crate) fn bytes(&self, [width, height, depth]: [u32; 3]) -> u64 {
        let blocks = self.block_count([width, height]).map(u64::from);
        let layers = [depth.into(), self.block_bytes.into()];
        layers.into_iter().chain(blocks).fold(1, u64::saturating_mul)
    }

    /// Returns the width, height and depth of the aspect in an image of this extent.
    pub(crate) fn aspect_extent(&self, [width, height, depth]: [u32; 3]) -> [u32; 3] {
        [width.div_ceil(self.shrink), height.div_ceil(self.shrink), depth]
    }

    /// Returns the columns and rows of blocks that cover this extent in texels.
    pub(crate) fn block_count(&self, extent: [u32; 2]) -> [u32; 2] {
        [extent[0].div_ceil(self.block[0]), extent[1].div_ceil(self.block[1])]
    }
}

impl Format {
    /// Returns the bytes of a region of width x height x depth texels in uploads and downloads, tightly
    /// packed. They contain the colour, or the depth without its stencil, or all planes one after the other.
    /// Compressed formats round up to whole [blocks](Self::block_extent). Numbers beyond 64 bits become `u64::MAX`.
    pub fn bytes(self, extent: [u32; 3]) -> u64 {
        let Some(main) = self.copy_aspect(Aspect::Main) else {
            let planes = self.planes().map(|plane| plane.bytes(plane.aspect_extent(extent)));
            return planes.fold(0, u64::saturating_add);
        };
        main.bytes(extent)
    }

    /// Returns the width and height of a block in texels: 4 x 4 for BC and ETC2, up to 12 x 12 for ASTC, and
    /// 1 x 1 for uncompressed formats.
    pub fn block_extent(self) -> [u32; 2] {
        self.block().texels
    }

    /// True if texels are compressed in blocks.
    pub fn is_compressed(self) -> bool {
        self.class() == CompatibilityClass::TexelBlock
    }

    /// True if texels are in Y'CbCr, in several planes.
    pub fn is_yuv(self) -> bool {
        matches!(self.class(), CompatibilityClass::TwoPlanes | CompatibilityClass::ThreePlanes)
    }

    /// Returns the format for accessing a single plane. It has 16-bit channels for 10-bit formats. `None` if
    /// the format has no such plane.
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

    /// True if texels hold depth, with or without stencil.
    pub fn is_depth(self) -> bool {
        matches!(self.class(), CompatibilityClass::Depth | CompatibilityClass::DepthStencil)
    }

    /// True if texels hold stencil.
    pub fn has_stencil(self) -> bool {
        matches!(self.class(), CompatibilityClass::Stencil | CompatibilityClass::DepthStencil)
    }

    /// True if texels hold colour: neither depth nor stencil.
    pub fn is_color(self) -> bool {
        !self.is_depth() && !self.has_stencil()
    }

    /// True if shaders read texels as unsigned integers.
    pub fn is_uint(self) -> bool {
        matches!(self.class(), CompatibilityClass::Uint | CompatibilityClass::Stencil)
    }

    /// True if shaders read texels as signed integers.
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

    /// Returns all aspects for barriers.
    pub(crate) fn aspects(self) -> vk::ImageAspectFlags {
        match self.class() {
            CompatibilityClass::Depth => vk::ImageAspectFlags::DEPTH,
            CompatibilityClass::Stencil => vk::ImageAspectFlags::STENCIL,
            CompatibilityClass::DepthStencil => vk::ImageAspectFlags::DEPTH | vk::ImageAspectFlags::STENCIL,
            _ => vk::ImageAspectFlags::COLOR,
        }
    }

    /// Returns an aspect for copies. `None` if the format lacks it.
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

    /// Returns a plane for copies.
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

    /// Returns the aspects that together contain all texels of an upload.
    pub(crate) fn uploaded_aspects(self) -> impl Iterator<Item = Aspect> {
        let planes = (0..3).filter(move |plane| self.plane_format(*plane).is_some()).map(Aspect::Plane);
        (!self.is_yuv()).then_some(Aspect::Main).into_iter().chain(planes)
    }

    /// True if an image of one format can have a view in the other. Colour formats need the same number of
    /// bytes, compressed formats the same compression.
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

    /// Returns the number of the compression. Vulkan numbers the two variants of each compression
    /// consecutively: linear or unsigned, then sRGB or signed.
    fn compression_family(self) -> Option<i32> {
        const FIRST: i32 = vk::Format::BC1_RGB_UNORM_BLOCK.as_raw();
        self.is_compressed().then(|| (self.raw().as_raw() - FIRST) / 2)
    }

    /// True for the alpha-only format, which is a compatibility class of its own.
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
        assert_eq!(Format::Nv12.bytes([u32::MAX; 3]), u64::MAX);
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
