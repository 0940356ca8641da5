//! Memory that the decoding of large pictures takes. The heap is counted, so this program has one test.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk_samples::picture::{self, Bounds};
use peak_alloc::PeakAlloc;

#[global_allocator]
static HEAP: PeakAlloc = PeakAlloc;

/// Most bytes in use during `work`, beyond those before it.
fn most_bytes<R>(work: impl FnOnce() -> R) -> (R, usize) {
    let before = HEAP.current_usage();
    HEAP.reset_peak_usage();
    let result = work();
    (result, HEAP.peak_usage() - before)
}

/// A PNG of black texels with one bit each.
fn black_png(side: u32) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, side, side);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::One);
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(&vec![0; (side as usize).div_ceil(8) * side as usize]).unwrap();
    writer.finish().unwrap();
    bytes
}

#[test]
fn a_png_takes_little_more_than_its_final_texels() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("black.png");
    std::fs::write(&path, black_png(4_000)).unwrap();
    for (bounds, side) in [
        (Bounds { max_texels: 1 << 20, ..Bounds::default() }, 1_024),
        (Bounds { max_side: 3_000, ..Bounds::default() }, 3_000),
        (Bounds::default(), 4_000),
    ] {
        let (picture, most) = most_bytes(|| picture::read(&path, &bounds).unwrap());
        assert_eq!([picture.width, picture.height], [side, side]);
        let with_mips = picture.rgba.len() / 3 * 4;
        assert!(most < with_mips * 3 / 2, "{most} bytes for {with_mips}");
    }

    let mut rgba = vec![7; 4 * 2_000 * 2_000];
    let ((), most) = most_bytes(|| picture::shrink::shrink_in_place(&mut rgba, [2_000; 2], [500; 2]));
    assert_eq!(rgba.len(), 4 * 500 * 500);
    assert!(most < 4 * 500 * 500 * 3 / 2, "{most} bytes beside the image");
}
