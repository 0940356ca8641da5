//! Images of the model, and places in them.

use lvk::{Format, TextureRegion};

use super::cell::Cell;

/// An image: the texels of each mip, layer by layer, row by row.
#[derive(Debug, Clone)]
pub struct Image {
    /// Format of the texels.
    pub format: Format,
    /// Width and height of mip 0.
    pub extent: [u32; 2],
    mips: Vec<Vec<Cell>>,
}

/// A rectangle of one mip of some layers, all in the numbering of the image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Place {
    /// Number of the image in the memory.
    pub image: usize,
    /// Mip.
    pub mip: u32,
    /// First layer.
    pub layer: u32,
    /// Number of layers.
    pub layers: u32,
    /// First column and row.
    pub offset: [u32; 2],
    /// Width and height.
    pub extent: [u32; 2],
}

/// The part of an image that a texture covers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Part {
    /// Number of the image in the memory.
    pub image: usize,
    /// First mip.
    pub base_mip: u32,
    /// Number of mips.
    pub mips: u32,
    /// First layer.
    pub base_layer: u32,
    /// Number of layers.
    pub layers: u32,
    /// Width and height of mip 0 of the image.
    pub extent: [u32; 2],
}

/// Returns width and height of a mip.
pub fn mip_extent(extent: [u32; 2], mip: u32) -> [u32; 2] {
    extent.map(|side| (side >> mip.min(31)).max(1))
}

/// Returns the bytes of a texel.
pub fn texel_bytes(format: Format) -> usize {
    if format == Format::R8Uint { 1 } else { 4 }
}

impl Image {
    /// Returns an image of unknown contents.
    pub fn new(format: Format, extent: [u32; 2], layers: u32, mips: u32) -> Self {
        let cells = |mip| {
            let [width, height] = mip_extent(extent, mip);
            vec![Cell::UNKNOWN; width as usize * height as usize * layers as usize * texel_bytes(format)]
        };
        Self { format, extent, mips: (0..mips).map(cells).collect() }
    }

    /// Returns the start of each row of a place, in cells, and the cells of a row.
    fn rows(&self, place: &Place) -> (Vec<usize>, usize) {
        let [width, height] = mip_extent(self.extent, place.mip);
        let bytes = texel_bytes(self.format);
        let row = |layer: u32, y: u32| ((layer * height + y) * width + place.offset[0]) as usize * bytes;
        let rows = (place.layer..place.layer + place.layers).flat_map(|layer| {
            (place.offset[1]..place.offset[1] + place.extent[1]).map(move |y| row(layer, y))
        });
        (rows.collect(), place.extent[0] as usize * bytes)
    }

    /// Returns the texels of a place, packed.
    pub fn read(&self, place: &Place) -> Vec<Cell> {
        let (rows, length) = self.rows(place);
        let mip = &self.mips[place.mip as usize];
        rows.into_iter().flat_map(|start| mip[start..start + length].iter().copied()).collect()
    }

    /// Replaces the texels of a place by packed ones.
    pub fn write(&mut self, place: &Place, cells: &[Cell]) {
        let (rows, length) = self.rows(place);
        let mip = &mut self.mips[place.mip as usize];
        for (start, row) in rows.into_iter().zip(cells.chunks(length.max(1))) {
            mip[start..start + length].copy_from_slice(row);
        }
    }
}

impl Place {
    /// Number of texels.
    pub fn texels(&self) -> usize {
        self.extent[0] as usize * self.extent[1] as usize * self.layers as usize
    }

    /// True if both places have a mip of a layer in common.
    pub fn meets(&self, other: &Self) -> bool {
        self.image == other.image
            && self.mip == other.mip
            && self.layer < other.layer + other.layers
            && other.layer < self.layer + self.layers
    }
}

impl Part {
    /// Returns the place of a region, or `None` if it does not lie inside.
    pub fn place(&self, region: &TextureRegion) -> Option<Place> {
        let whole = mip_extent(self.extent, self.base_mip.checked_add(region.mip)?);
        let layers = count(region.layer, region.layers, self.layers)?;
        if region.mip >= self.mips || (region.extent[0] == 0) != (region.extent[1] == 0) {
            return None;
        }
        let mut extent = [0; 2];
        for axis in 0..2 {
            extent[axis] = count(region.offset[axis], region.extent[axis], whole[axis])?;
        }
        Some(Place {
            image: self.image,
            mip: self.base_mip + region.mip,
            layer: self.base_layer + region.layer,
            layers,
            offset: region.offset,
            extent,
        })
    }

    /// Returns all of a mip, which must exist.
    pub fn whole(&self, mip: u32) -> Place {
        Place {
            image: self.image,
            mip: self.base_mip + mip,
            layer: self.base_layer,
            layers: self.layers,
            offset: [0, 0],
            extent: mip_extent(self.extent, self.base_mip + mip),
        }
    }
}

/// Returns the number of elements from `first` on; a `wanted` of 0 is all. `None` if they do not exist.
pub fn count(first: u32, wanted: u32, whole: u32) -> Option<u32> {
    let rest = whole.checked_sub(first).filter(|rest| *rest > 0)?;
    if wanted == 0 { Some(rest) } else { (wanted <= rest).then_some(wanted) }
}

#[test]
fn places_are_read_as_they_were_written() {
    let mut image = Image::new(Format::R32Uint, [5, 3], 2, 2);
    let part = Part { image: 0, base_mip: 0, mips: 2, base_layer: 1, layers: 1, extent: [5, 3] };
    let region = TextureRegion { offset: [1, 1], extent: [2, 2], ..Default::default() };
    let place = part.place(&region).unwrap();
    let cells: Vec<_> = (0..16).map(Cell::known).collect();
    image.write(&place, &cells);
    assert_eq!(image.read(&place), cells);
    let all = image.read(&part.whole(0));
    assert_eq!(all.iter().filter(|cell| cell.is_known()).count(), 16);
    assert_eq!(all[6 * 4], Cell::known(0));
    assert!(part.place(&TextureRegion { extent: [5, 3], ..region }).is_none());
    assert!(part.place(&TextureRegion { mip: 2, ..Default::default() }).is_none());
}
