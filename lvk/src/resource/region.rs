//! Regions of textures: the caller's descriptions, checked against the texture and resolved to exact sizes.

use ash::vk;

use crate::barrier::Subresources;
use crate::format::{Aspect, CopyAspect};

/// Part of a texture: a rectangle of one mip of some layers, or a 3D region of one mip of a volume.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct TextureRegion {
    /// Mip level; in a view, relative to its first mip. Default: 0.
    pub mip: u32,
    /// First layer or cube face; in a view, relative to its first layer. Default: 0.
    pub layer: u32,
    /// Number of layers; 0 is all from `layer` on. The texels of consecutive layers follow each other. Default: 1.
    pub layers: u32,
    /// First column and row, in texels. Must be multiples of the [block](crate::Format::block_extent).
    /// Default: `[0, 0]`.
    pub offset: [u32; 2],
    /// Width and height in texels; `[0, 0]` is all from `offset` on. Must be multiples of the block, or end at the
    /// edge. Default: `[0, 0]`.
    pub extent: [u32; 2],
    /// First slice of a volume; 0 for all other kinds. Default: 0.
    pub z: u32,
    /// Number of slices; 0 is all from `z` on. Must be 0 or 1 for all kinds but volumes. Default: 0.
    pub depth: u32,
    /// Aspect of each texel. Default: [`Aspect::Main`].
    pub aspect: Aspect,
}

impl Default for TextureRegion {
    /// Returns the first mip of the first layer.
    fn default() -> Self {
        Self {
            mip: 0,
            layer: 0,
            layers: 1,
            offset: [0, 0],
            extent: [0, 0],
            z: 0,
            depth: 0,
            aspect: Aspect::Main,
        }
    }
}

/// Mips and layers of a texture; the default is all of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct TextureRange {
    /// First mip. Default: 0.
    pub base_mip: u32,
    /// Number of mips; 0 is all from `base_mip` on. Default: 0.
    pub mips: u32,
    /// First layer. Default: 0.
    pub base_layer: u32,
    /// Number of layers; 0 is all from `base_layer` on. Default: 0.
    pub layers: u32,
}

/// Bounds of the regions of a texture: the part of the image that the texture covers.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TextureBounds {
    /// Mips and layers, in the numbering of the image.
    pub(crate) view_range: Subresources,
    /// Width, height and slices of mip 0 of the image.
    pub(crate) extent: [u32; 3],
}

/// A checked region with all sizes resolved. Mips and layers are in the numbering of the image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Region {
    pub(crate) mip: u32,
    pub(crate) layer: u32,
    pub(crate) layers: u32,
    pub(crate) offset: [u32; 3],
    pub(crate) extent: [u32; 3],
    pub(crate) part: CopyAspect,
}

impl TextureBounds {
    /// Returns width, height and slices of a mip, relative to the first mip of the texture.
    pub(crate) fn mip_extent(&self, mip: u32) -> [u32; 3] {
        let mip = self.view_range.base_mip.saturating_add(mip).min(31);
        self.extent.map(|side| (side >> mip).max(1))
    }

    /// Checks a region of the aspect `part` and resolves its sizes. The error is a message.
    pub(crate) fn resolve(&self, region: &TextureRegion, part: CopyAspect) -> Result<Region, String> {
        let view_range = self.view_range;
        let layers = resolve_count(region.layer, region.layers, view_range.layer_count);
        let (Some(layers), true) = (layers, region.mip < view_range.mip_count) else {
            return Err(missing_message(region.mip, region.layer, region.layers, view_range));
        };
        let whole @ [width, height, slices] = part.aspect_extent(self.mip_extent(region.mip));
        let outside = || {
            format!("region {region:?} does not lie inside the mip's {width} x {height} x {slices} texels")
        };
        if (region.extent[0] == 0) != (region.extent[1] == 0) {
            return Err(outside());
        }
        let offset = [region.offset[0], region.offset[1], region.z];
        let wanted = [region.extent[0], region.extent[1], region.depth];
        let mut extent = [0; 3];
        for axis in 0..3 {
            extent[axis] = resolve_count(offset[axis], wanted[axis], whole[axis]).ok_or_else(outside)?;
        }
        let in_blocks = (0..2).all(|axis| {
            let (block, end) = (part.block[axis], offset[axis] + extent[axis]);
            offset[axis].is_multiple_of(block) && (end.is_multiple_of(block) || end == whole[axis])
        });
        if !in_blocks {
            let [columns, rows] = part.block;
            return Err(format!("region {region:?} cuts through blocks of {columns} x {rows} texels"));
        }
        let (mip, layer) = (view_range.base_mip + region.mip, view_range.base_layer + region.layer);
        Ok(Region { mip, layer, layers, offset, extent, part })
    }

    /// Checks a range and resolves its counts, in the numbering of the image.
    pub(crate) fn resolve_range(&self, range: &TextureRange) -> Result<Subresources, String> {
        let view_range = self.view_range;
        let mips = resolve_count(range.base_mip, range.mips, view_range.mip_count);
        let layers = resolve_count(range.base_layer, range.layers, view_range.layer_count);
        let Some((mip_count, layer_count)) = mips.zip(layers) else {
            let (mips, layers) = (view_range.mip_count, view_range.layer_count);
            return Err(format!("{range:?} does not exist: the texture has {mips} mips and {layers} layers"));
        };
        let (base_mip, base_layer) =
            (view_range.base_mip + range.base_mip, view_range.base_layer + range.base_layer);
        Ok(Subresources { base_mip, mip_count, base_layer, layer_count })
    }
}

impl Region {
    /// Returns the size of the texels in bytes, tightly packed.
    pub(crate) fn bytes(&self) -> u64 {
        self.part.bytes(self.extent).saturating_mul(self.layers.into())
    }

    /// Returns a region at the position of `other` with the size of this one.
    pub(crate) fn sized_like(&self, other: &TextureRegion) -> TextureRegion {
        let [width, height, depth] = self.extent;
        TextureRegion { extent: [width, height], depth, layers: self.layers, ..*other }
    }

    /// Returns the mip and the layers for barriers.
    pub(crate) fn subresources(&self) -> Subresources {
        let Self { mip: base_mip, layer: base_layer, layers: layer_count, .. } = *self;
        Subresources { base_mip, mip_count: 1, base_layer, layer_count }
    }

    /// Returns the mip and the layers for copies and blits.
    pub(crate) fn raw_layers(&self) -> vk::ImageSubresourceLayers {
        vk::ImageSubresourceLayers {
            aspect_mask: self.part.aspect,
            mip_level: self.mip,
            base_array_layer: self.layer,
            layer_count: self.layers,
        }
    }

    /// Returns the offset of the first texel.
    pub(crate) fn raw_offset(&self) -> vk::Offset3D {
        let [x, y, z] = self.offset.map(|place| place as i32);
        vk::Offset3D { x, y, z }
    }

    /// Returns the size of the region.
    pub(crate) fn raw_extent(&self) -> vk::Extent3D {
        let [width, height, depth] = self.extent;
        vk::Extent3D { width, height, depth }
    }

    /// Returns the offset of the first texel and the offset past the last texel, for blits.
    pub(crate) fn raw_corners(&self) -> [vk::Offset3D; 2] {
        let [x, y, z] = [0, 1, 2].map(|axis| (self.offset[axis] + self.extent[axis]) as i32);
        [self.raw_offset(), vk::Offset3D { x, y, z }]
    }

    /// Returns the copy from or to a buffer in which the bytes start at `buffer_offset`, tightly packed.
    pub(crate) fn buffer_copy(&self, buffer_offset: u64) -> vk::BufferImageCopy {
        vk::BufferImageCopy {
            buffer_offset,
            buffer_row_length: 0,
            buffer_image_height: 0,
            image_subresource: self.raw_layers(),
            image_offset: self.raw_offset(),
            image_extent: self.raw_extent(),
        }
    }
}

/// Returns the number of elements from `first` on in an array of `whole` elements. A `count` of 0 means all of them.
/// `None` if the elements do not exist.
fn resolve_count(first: u32, count: u32, whole: u32) -> Option<u32> {
    let rest = whole.checked_sub(first).filter(|rest| *rest > 0)?;
    match count {
        0 => Some(rest),
        count => (count <= rest).then_some(count),
    }
}

fn missing_message(mip: u32, layer: u32, count: u32, view_range: Subresources) -> String {
    let (mips, layers) = (view_range.mip_count, view_range.layer_count);
    let which = match count {
        0 | 1 => format!("layer {layer}"),
        count => format!("{count} layers from {layer} on"),
    };
    format!("mip {mip} of {which} does not exist: the texture has {mips} mips and {layers} layers")
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::format::Format;

    fn bounds() -> impl Strategy<Value = (TextureBounds, Format)> {
        let formats = [Format::R8Unorm, Format::Bc1RgbUnorm, Format::Astc10x6Srgb, Format::D32FloatS8];
        (1..70_u32, 1..70_u32, 1..9_u32, 1..9_u32, 0..3_u32, 0..3_u32, 0..4_usize).prop_map(
            move |(width, height, slices, layers, base_mip, base_layer, format)| {
                let view_range = Subresources { base_mip, mip_count: 3, base_layer, layer_count: layers };
                (TextureBounds { view_range, extent: [width, height, slices] }, formats[format])
            },
        )
    }

    fn region() -> impl Strategy<Value = TextureRegion> {
        let side = || prop_oneof![8 => 0..40_u32, 1 => Just(u32::MAX)];
        (0..4_u32, 0..10_u32, 0..10_u32, [side(), side()], [side(), side()], 0..9_u32, 0..9_u32).prop_map(
            |(mip, layer, layers, offset, extent, z, depth)| TextureRegion {
                mip,
                layer,
                layers,
                offset,
                extent,
                z,
                depth,
                aspect: Aspect::Main,
            },
        )
    }

    proptest! {
        #[test]
        fn resolved_regions_lie_inside_in_whole_blocks((bounds, format) in bounds(), region in region()) {
            let part = format.copy_aspect(Aspect::Main).unwrap();
            let Ok(found) = bounds.resolve(&region, part) else { return Ok(()) };
            let whole = bounds.mip_extent(region.mip);
            let view_range = bounds.view_range;
            prop_assert!(found.mip >= view_range.base_mip && found.mip < view_range.base_mip + view_range.mip_count);
            prop_assert!(found.layer >= view_range.base_layer && found.layers > 0);
            prop_assert!(found.layer + found.layers <= view_range.base_layer + view_range.layer_count);
            for (axis, side) in whole.into_iter().enumerate() {
                prop_assert!(found.extent[axis] > 0);
                prop_assert!(found.offset[axis] + found.extent[axis] <= side);
            }
            let blocks = part.block_count([found.extent[0], found.extent[1]]);
            let count = u64::from(blocks[0]) * u64::from(blocks[1]) * u64::from(found.extent[2] * found.layers);
            prop_assert_eq!(found.bytes(), count * u64::from(part.block_bytes));
        }

        /// The whole of a mip always exists, and explicit sizes are equal to omitted sizes.
        #[test]
        fn zero_is_all_there_is((bounds, format) in bounds(), mip in 0..3_u32) {
            let part = format.copy_aspect(Aspect::Main).unwrap();
            let open = TextureRegion { mip, layers: 0, ..Default::default() };
            let [width, height, depth] = bounds.mip_extent(mip);
            let layers = bounds.view_range.layer_count;
            let named = TextureRegion { layers, extent: [width, height], depth, ..open };
            prop_assert_eq!(bounds.resolve(&open, part).unwrap(), bounds.resolve(&named, part).unwrap());
            let more = TextureRegion { layers: layers + 1, ..open };
            prop_assert!(bounds.resolve(&more, part).is_err());
        }
    }
}
