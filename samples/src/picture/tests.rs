//! Tests of whole image files.

use std::path::{Path, PathBuf};

use image::{ExtendedColorType, ImageFormat, RgbaImage};
use png::{BitDepth, ColorType, Encoder};

use super::*;

/// Bytes without a pattern.
fn noise(count: usize) -> Vec<u8> {
    let mut state = 7_u32;
    let next = |_| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 24) as u8
    };
    (0..count).map(next).collect()
}

fn stored(folder: &Path, name: &str, bytes: &[u8]) -> PathBuf {
    let path = folder.join(name);
    std::fs::write(&path, bytes).unwrap();
    path
}

fn png_file([width, height]: [u32; 2], color: ColorType, depth: BitDepth) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, width, height);
    encoder.set_color(color);
    encoder.set_depth(depth);
    let colors = 1 << (depth as usize).min(8);
    if color == ColorType::Indexed {
        encoder.set_palette(noise(3 * colors));
        encoder.set_trns(noise(colors / 2));
    }
    let row_bytes = (width as usize * color.samples() * depth as usize).div_ceil(8);
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(&noise(row_bytes * height as usize)).unwrap();
    writer.finish().unwrap();
    bytes
}

/// An 8x8 grey image whose rows are those of Adam7, as an encoder of the test.
fn interlaced_png() -> Vec<u8> {
    let mut bytes = png_file([8, 8], ColorType::Grayscale, BitDepth::Eight);
    // Seven passes of 8x8 have 1, 1, 2, 4, 8, 16 and 32 texels, in rows that begin with a filter byte each.
    let rows = [(1, 1), (1, 1), (2, 1), (2, 2), (4, 2), (4, 4), (8, 4)];
    let mut raw = Vec::new();
    for (length, count) in rows {
        for row in noise(length * count).chunks(length) {
            raw.push(0);
            raw.extend(row);
        }
    }
    let header = bytes[8 + 8..8 + 8 + 13].to_vec();
    let header = [&header[..12], &[1]].concat();
    bytes.truncate(8);
    for (kind, data) in [(b"IHDR", header), (b"IDAT", stored_zlib(&raw)), (b"IEND", Vec::new())] {
        bytes.extend((data.len() as u32).to_be_bytes());
        let body = [&kind[..], &data].concat();
        bytes.extend(&body);
        bytes.extend(crc32(&body).to_be_bytes());
    }
    bytes
}

fn stored_zlib(raw: &[u8]) -> Vec<u8> {
    let length = (raw.len() as u16).to_le_bytes();
    let inverse = (!(raw.len() as u16)).to_le_bytes();
    let (mut a, mut b) = (1_u32, 0_u32);
    for &byte in raw {
        a = (a + u32::from(byte)) % 65_521;
        b = (b + a) % 65_521;
    }
    [&[0x78, 1, 1], &length[..], &inverse, raw, &(b << 16 | a).to_be_bytes()].concat()
}

fn crc32(bytes: &[u8]) -> u32 {
    let shifted = |sum: u32| (0..8).fold(sum, |sum, _| sum >> 1 ^ if sum & 1 == 1 { 0xedb8_8320 } else { 0 });
    !bytes.iter().fold(u32::MAX, |sum, &byte| shifted(sum ^ u32::from(byte)))
}

const KINDS: [(ColorType, &[BitDepth]); 5] = [
    (
        ColorType::Grayscale,
        &[BitDepth::One, BitDepth::Two, BitDepth::Four, BitDepth::Eight, BitDepth::Sixteen],
    ),
    (ColorType::Indexed, &[BitDepth::One, BitDepth::Two, BitDepth::Four, BitDepth::Eight]),
    (ColorType::GrayscaleAlpha, &[BitDepth::Eight, BitDepth::Sixteen]),
    (ColorType::Rgb, &[BitDepth::Eight, BitDepth::Sixteen]),
    (ColorType::Rgba, &[BitDepth::Eight, BitDepth::Sixteen]),
];

#[test]
fn scanlines_of_every_kind_of_png_are_those_of_whole_images() {
    let folder = tempfile::tempdir().unwrap();
    let mut files: Vec<_> = KINDS
        .iter()
        .flat_map(|&(color, depths)| depths.iter().map(move |&depth| png_file([13, 9], color, depth)))
        .collect();
    files.push(interlaced_png());
    for (number, bytes) in files.iter().enumerate() {
        let path = stored(folder.path(), "a.png", bytes);
        let picture = read(&path, &Bounds::default()).unwrap();
        let expected = image::load_from_memory(bytes).unwrap().into_rgba8();
        assert_eq!([picture.width, picture.height], [expected.width(), expected.height()]);
        assert_eq!(picture.rgba, expected.into_raw(), "kind {number}");
        assert!(picture.warnings.is_empty());
    }
}

/// The same image in each format, by file name.
fn encoded() -> Vec<(&'static str, Vec<u8>)> {
    let (width, height) = (61, 47);
    let smooth = |x: u32, y: u32| image::Rgb([(4 * x) as u8, (5 * y) as u8, (3 * (x + y)) as u8]);
    let rgb = image::RgbImage::from_fn(width, height, smooth);
    let formats = [
        ("a.png", ImageFormat::Png),
        ("a.jpg", ImageFormat::Jpeg),
        ("a.bmp", ImageFormat::Bmp),
        ("a.tga", ImageFormat::Tga),
    ];
    let encode = |(name, format)| {
        let mut bytes = std::io::Cursor::new(Vec::new());
        rgb.write_to(&mut bytes, format).unwrap();
        (name, bytes.into_inner())
    };
    formats.into_iter().map(encode).collect()
}

#[test]
fn images_that_are_too_large_are_shrunk_like_whole_images_in_every_format() {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in encoded() {
        let path = stored(folder.path(), name, &bytes);
        for (bounds, [width, height]) in [
            (Bounds { max_side: 20, ..Bounds::default() }, [20, 15]),
            (Bounds { max_texels: 300, ..Bounds::default() }, [19, 14]),
        ] {
            let picture = read(&path, &bounds).unwrap();
            assert_eq!([picture.width, picture.height], [width, height], "{name}");
            let warning = format!("61x47 texels are more than are taken; shrunk to {width}x{height}");
            assert_eq!(picture.warnings, [warning]);
            let whole = image::open(&path).unwrap().into_rgba8();
            let filter = image::imageops::FilterType::Triangle;
            let expected = image::imageops::resize(&whole, width, height, filter).into_raw();
            for (found, expected) in picture.rgba.iter().zip(&expected) {
                assert!(found.abs_diff(*expected) <= 1, "{name}: {found} and {expected}");
            }
        }
    }
}

#[test]
fn a_truncated_file_is_refused_or_warned_of_in_every_format() {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in encoded() {
        assert!(
            read(&stored(folder.path(), name, &bytes), &Bounds::default()).unwrap().warnings.is_empty(),
            "{name}"
        );
        for share in 1..16 {
            let cut = &bytes[..bytes.len() * share / 16];
            let path = stored(folder.path(), name, cut);
            if let Ok(picture) = read(&path, &Bounds::default()) {
                assert!(name == "a.jpg", "{name} at {share}/16");
                assert!(picture.warnings[0].starts_with("the file is cut off"), "{:?}", picture.warnings);
            }
        }
    }
}

#[test]
fn truncated_run_length_formats_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    // A TGA of 16x16 texels in runs of 16, of which a half is there.
    let mut tga = vec![0, 0, 10, 0, 0, 0, 0, 0, 0, 0, 0, 0, 16, 0, 16, 0, 24, 0];
    (0..8).for_each(|row| tga.extend([0x80 | 15, row, 2, 3]));
    assert!(read(&stored(folder.path(), "a.tga", &tga), &Bounds::default()).is_err());
    (0..8).for_each(|row| tga.extend([0x80 | 15, row, 2, 3]));
    assert!(read(&stored(folder.path(), "a.tga", &tga), &Bounds::default()).is_ok());
    // A BMP of 16x16 texels of 8 bits in runs, of which a half is there.
    let mut bmp =
        b"BM\0\0\0\0\0\0\0\0\x3e\0\0\0\x28\0\0\0\x10\0\0\0\x10\0\0\0\x01\0\x08\0\x01\0\0\0".to_vec();
    bmp.extend([0; 12]);
    bmp.extend([2, 0, 0, 0, 0, 0, 0, 0]);
    bmp.extend([0, 0, 0, 0, 255, 255, 255, 0]);
    (0..8).for_each(|_| bmp.extend([16, 1, 0, 0]));
    assert!(read(&stored(folder.path(), "a.bmp", &bmp), &Bounds::default()).is_err());
    (0..8).for_each(|_| bmp.extend([16, 1, 0, 0]));
    bmp.extend([0, 1]);
    assert!(read(&stored(folder.path(), "a.bmp", &bmp), &Bounds::default()).is_ok());
}

#[test]
fn sizes_beyond_the_bounds_are_refused_before_anything_is_decoded() {
    let folder = tempfile::tempdir().unwrap();
    let mut bytes = png_file([4, 4], ColorType::Grayscale, BitDepth::One);
    bytes[16..24].copy_from_slice(&[40_000_u32, 40_000].map(u32::to_be_bytes).concat());
    let checksum = crc32(&bytes[12..29]);
    bytes[29..33].copy_from_slice(&checksum.to_be_bytes());
    let error = read(&stored(folder.path(), "a.png", &bytes), &Bounds::default()).unwrap_err();
    assert!(matches!(error, PictureError::TooManyTexels { width: 40_000, .. }), "{error}");

    let mut bmp = b"BM\0\0\0\0\0\0\0\0\x36\0\0\0\x28\0\0\0".to_vec();
    bmp.extend([20_000_u32, 20_000].map(u32::to_le_bytes).concat());
    bmp.extend([1, 0, 24, 0]);
    bmp.extend([0; 24]);
    let error = read(&stored(folder.path(), "a.bmp", &bmp), &Bounds::default()).unwrap_err();
    assert!(matches!(error, PictureError::TooManyBytes { bytes: 1_200_000_000, .. }), "{error}");
    assert!(error.to_string().contains("more than the 536870912 that are decoded"), "{error}");
}

#[test]
fn a_file_too_short_for_its_header_is_refused_in_every_format() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |name: &str, bytes: &[u8]| {
        let error = read(&stored(folder.path(), name, bytes), &Bounds::default()).unwrap_err();
        assert!(
            matches!(error, PictureError::TooFewBytes { width: 10_000, height: 10_000, .. }),
            "{name}: {error}"
        );
    };
    let side = 10_000_u32;
    let mut png = png_file([4, 4], ColorType::Grayscale, BitDepth::One);
    for interlaced in [0, 1] {
        png[16..24].copy_from_slice(&[side, side].map(u32::to_be_bytes).concat());
        png[28] = interlaced;
        let checksum = crc32(&png[12..29]);
        png[29..33].copy_from_slice(&checksum.to_be_bytes());
        refused("a.png", &png);
    }
    let short = (side as u16).to_le_bytes();
    let tga = [&[0, 0, 10, 0, 0, 0, 0, 0, 0, 0, 0, 0][..], &short, &short, &[24, 0]].concat();
    refused("a.tga", &tga);
    let mut bmp = b"BM\0\0\0\0\0\0\0\0\x36\0\0\0\x28\0\0\0".to_vec();
    bmp.extend([side, side].map(u32::to_le_bytes).concat());
    bmp.extend([1, 0, 24, 0]);
    bmp.extend([0; 24]);
    refused("a.bmp", &bmp);
    let (_, mut jpeg) = encoded().swap_remove(1);
    let frame = jpeg.windows(2).position(|marker| marker == [0xff, 0xc0]).unwrap();
    jpeg[frame + 5..frame + 9].copy_from_slice(&[side as u16; 2].map(u16::to_be_bytes).concat());
    refused("a.jpg", &jpeg);
}

#[test]
fn files_that_are_no_images_say_so() {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in
        [("a.png", &b"text"[..]), ("a.txt", b"text"), ("a.jpg", b""), ("a", b"\x89PNG\r\n\x1a\n")]
    {
        assert!(read(&stored(folder.path(), name, bytes), &Bounds::default()).is_err(), "{name}");
    }
    // By contents and by name.
    let radiance = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n\x09\x09\x09\x81";
    for (name, bytes) in [("a.png", &radiance[..]), ("a.hdr", b"text")] {
        let error = read(&stored(folder.path(), name, bytes), &Bounds::default()).unwrap_err();
        assert!(matches!(error, PictureError::HighDynamicRange), "{name}: {error}");
    }
    let error = read(folder.path(), &Bounds::default()).unwrap_err();
    assert_eq!(error.to_string(), "it is a directory, no file");
    let huge = folder.path().join("huge.png");
    std::fs::File::create(&huge).unwrap().set_len(1 << 40).unwrap();
    let error = read(&huge, &Bounds::default()).unwrap_err();
    assert!(error.to_string().starts_with("it has 1099511627776 bytes, more than the 1073741824"), "{error}");
}

#[test]
fn a_name_that_lies_about_the_format_does_not_matter() {
    let folder = tempfile::tempdir().unwrap();
    let image = RgbaImage::from_pixel(2, 1, image::Rgba([1, 2, 3, 4]));
    let path = folder.path().join("a.tga");
    image::save_buffer_with_format(&path, &image, 2, 1, ExtendedColorType::Rgba8, ImageFormat::Png).unwrap();
    assert_eq!(read(&path, &Bounds::default()).unwrap().rgba, image.into_raw());
}
