//! Texels of KTX2 images.

use std::io::Read as _;

use ktx2::{Format, Header, LevelIndex, SupercompressionScheme};

use super::budget::Budget;
use super::images::MOST_SIDE;
use crate::{ImageData, MipLevel, Problem, TexelFormat};

/// What texels of a format become.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Layout {
    /// They stay as they are.
    Kept(TexelFormat),
    /// This number of bytes a texel becomes four: missing colours are 0, missing alpha is 255.
    Expanded(usize),
}

/// Reads the mip levels of an image in two dimensions. Only header and index of levels are read by the crate `ktx2`, whose
/// reader of format descriptors overflows on damaged ones.
pub(super) fn decode(bytes: &[u8], budget: &Budget, place: &str) -> Result<ImageData, Problem> {
    let refuse = |why: String| Problem::Image { place: place.into(), why };
    let cut_off = || refuse("the KTX2 is cut off; export it again".into());
    let (header, rest) = bytes.split_first_chunk().ok_or_else(cut_off)?;
    let header =
        Header::from_bytes(header).map_err(|error| refuse(format!("the KTX2 is damaged ({error})")))?;
    let layout = check(&header).map_err(refuse)?;
    let mut index = rest;
    let mut mips = Vec::new();
    for number in 0..header.level_count.max(1) {
        let (level, rest) = index.split_first_chunk().ok_or_else(cut_off)?;
        index = rest;
        let level = LevelIndex::from_bytes(level);
        let range = level
            .byte_offset
            .checked_add(level.byte_length)
            .and_then(|end| Some(usize::try_from(level.byte_offset).ok()?..usize::try_from(end).ok()?));
        let data = range.and_then(|range| bytes.get(range)).ok_or_else(cut_off)?;
        let (width, height) = ((header.pixel_width >> number).max(1), (header.pixel_height >> number).max(1));
        let bytes = unpack(data, header.supercompression_scheme, size(layout, width, height), budget, place)?;
        let bytes = match layout {
            Layout::Expanded(components) => expand(&bytes, components, budget, place)?,
            Layout::Kept(_) => bytes,
        };
        mips.push(MipLevel { width, height, bytes });
    }
    let format = if let Layout::Kept(format) = layout { format } else { TexelFormat::Rgba8 };
    Ok(ImageData { format, mips })
}

/// Checks what a header states, and returns what its texels become.
fn check(header: &Header) -> Result<Layout, String> {
    let Some(format) = header.format else {
        let why =
            "it is Basis Universal, which is not decoded; convert it to a KTX2 of BC7 or ASTC, or to PNG";
        return Err(why.into());
    };
    let unknown = "which is not read; use RGBA with 8 bits, BC, ETC2 or ASTC";
    let layout = layout(format).ok_or_else(|| format!("the KTX2 has the format {format:?}, {unknown}"))?;
    let (width, height) = (header.pixel_width, header.pixel_height);
    let is_flat = header.pixel_depth == 0 && header.layer_count <= 1 && header.face_count == 1;
    if !is_flat || width == 0 || height == 0 {
        return Err("the KTX2 is no image in two dimensions; export it again".into());
    }
    if width > MOST_SIDE || height > MOST_SIDE {
        return Err(format!("it has {width}x{height} texels, but at most {MOST_SIDE} a side are read"));
    }
    let most_levels = width.max(height).ilog2() + 1;
    if header.level_count > most_levels {
        return Err(format!("the KTX2 has {} mip levels, more than {most_levels}", header.level_count));
    }
    Ok(layout)
}

fn size(layout: Layout, width: u32, height: u32) -> u64 {
    match layout {
        Layout::Kept(format) => format.level_bytes(width, height),
        Layout::Expanded(components) => u64::from(width) * u64::from(height) * components as u64,
    }
}

/// Returns the bytes of a level, which must be this many.
fn unpack(
    data: &[u8],
    scheme: Option<SupercompressionScheme>,
    size: u64,
    budget: &Budget,
    place: &str,
) -> Result<Vec<u8>, Problem> {
    let refuse = |why: &str| Problem::Image { place: place.into(), why: why.into() };
    const SIZE: &str = "a level of the KTX2 has not the size that its format demands; export it again";
    match scheme {
        None if data.len() as u64 == size => {
            let mut bytes = budget.list(size, || place.into())?;
            bytes.extend_from_slice(data);
            Ok(bytes)
        }
        None => Err(refuse(SIZE)),
        Some(SupercompressionScheme::Zstandard) => {
            let damaged = |_| refuse("the Zstandard data of the KTX2 is damaged; export it again");
            // The decoder keeps what it has decoded, in a buffer that grows by doubling, and tables.
            budget.charge(size.saturating_mul(4).saturating_add(1 << 20), || place.into())?;
            let mut bytes = budget.list(size, || place.into())?;
            let decoder = ruzstd::StreamingDecoder::new(data);
            let mut decoder = decoder.map_err(|_| damaged(std::io::ErrorKind::InvalidData.into()))?;
            decoder.by_ref().take(size).read_to_end(&mut bytes).map_err(damaged)?;
            let more = decoder.read(&mut [0]).map_err(damaged)?;
            if bytes.len() as u64 == size && more == 0 { Ok(bytes) } else { Err(refuse(SIZE)) }
        }
        Some(scheme) => {
            let why = format!("the KTX2 is compressed by {scheme:?}; compress it by Zstandard or not at all");
            Err(refuse(&why))
        }
    }
}

fn expand(texels: &[u8], components: usize, budget: &Budget, place: &str) -> Result<Vec<u8>, Problem> {
    let mut rgba = budget.list((texels.len() / components * 4) as u64, || place.into())?;
    for texel in texels.chunks_exact(components) {
        let component = |index: usize, missing: u8| texel.get(index).copied().unwrap_or(missing);
        rgba.extend([component(0, 0), component(1, 0), component(2, 0), component(3, 255)]);
    }
    Ok(rgba)
}

fn layout(format: Format) -> Option<Layout> {
    use TexelFormat::{Bc1Rgb, Bc1Rgba, Bc2, Bc3, Bc4, Bc5, Bc7, Etc2Rgb, Etc2Rgba, Rgba8};
    let kept = match format {
        Format::R8_UNORM | Format::R8_SRGB => return Some(Layout::Expanded(1)),
        Format::R8G8_UNORM | Format::R8G8_SRGB => return Some(Layout::Expanded(2)),
        Format::R8G8B8_UNORM | Format::R8G8B8_SRGB => return Some(Layout::Expanded(3)),
        Format::R8G8B8A8_UNORM | Format::R8G8B8A8_SRGB => Rgba8,
        Format::BC1_RGB_UNORM_BLOCK | Format::BC1_RGB_SRGB_BLOCK => Bc1Rgb,
        Format::BC1_RGBA_UNORM_BLOCK | Format::BC1_RGBA_SRGB_BLOCK => Bc1Rgba,
        Format::BC2_UNORM_BLOCK | Format::BC2_SRGB_BLOCK => Bc2,
        Format::BC3_UNORM_BLOCK | Format::BC3_SRGB_BLOCK => Bc3,
        Format::BC4_UNORM_BLOCK => Bc4,
        Format::BC5_UNORM_BLOCK => Bc5,
        Format::BC7_UNORM_BLOCK | Format::BC7_SRGB_BLOCK => Bc7,
        Format::ETC2_R8G8B8_UNORM_BLOCK | Format::ETC2_R8G8B8_SRGB_BLOCK => Etc2Rgb,
        Format::ETC2_R8G8B8A8_UNORM_BLOCK | Format::ETC2_R8G8B8A8_SRGB_BLOCK => Etc2Rgba,
        other => TexelFormat::Astc(astc_block(other.value())?),
    };
    Some(Layout::Kept(kept))
}

/// Returns width and height of the blocks of `VK_FORMAT_ASTC_*_UNORM_BLOCK` and `*_SRGB_BLOCK`, whose numbers follow each
/// other.
fn astc_block(vk_format: u32) -> Option<[u8; 2]> {
    const FIRST: u32 = 157;
    const BLOCKS: [[u8; 2]; 14] = [
        [4, 4],
        [5, 4],
        [5, 5],
        [6, 5],
        [6, 6],
        [8, 5],
        [8, 6],
        [8, 8],
        [10, 5],
        [10, 6],
        [10, 8],
        [10, 10],
        [12, 10],
        [12, 12],
    ];
    BLOCKS.get(vk_format.checked_sub(FIRST)? as usize / 2).copied()
}
