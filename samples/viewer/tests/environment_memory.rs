//! Memory that the reading of an environment file takes. The heap is counted, so this program has one test.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk_viewer::light::{Environment, EnvironmentError};
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

fn header(attributes: &str, width: usize) -> Vec<u8> {
    format!("#?RADIANCE\n{attributes}\n-Y {} +X {width}\n", width / 2).into_bytes()
}

#[test]
fn memory_is_in_proportion_to_the_file_and_bounded_by_the_map() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("sky.hdr");
    let read = |bytes: &[u8]| {
        std::fs::write(&path, bytes).unwrap();
        most_bytes(|| Environment::from_hdr(&path, 0.0))
    };

    // A header and little more: 402 MB of texels if it were believed.
    let mut short = header("FORMAT=32-bit_rle_rgbe\n", 8192);
    short.resize(60, 7);
    let (result, most) = read(&short);
    let error = result.unwrap_err();
    let stated =
        matches!(error, EnvironmentError::TooFewBytes { width: 8192, height: 4096, least: 49_152, .. });
    assert!(stated && error.to_string().contains("sky.hdr"), "{error}");
    assert!(most < 64 << 10, "{most} bytes");

    // The densest whole file of that size: each row is a texel, and two markers that repeat it 255 and 31 * 256 times.
    let row = [64, 32, 16, 129, 1, 1, 1, 255, 1, 1, 1, 31];
    let dense = [header("", 8192), row.repeat(4096)].concat();
    let (result, most) = read(&dense);
    let sky = result.unwrap().sky;
    assert_eq!((sky.width, sky.height, sky.texels.len()), (2048, 1024, 2048 * 1024));
    assert!(sky.texels.iter().all(|texel| *texel == [0.5, 0.25, 0.125]));
    let map = size_of_val(&sky.texels[..]);
    assert!((map..map + (1 << 20)).contains(&most), "{most} bytes for a map of {map}");

    // A header of many lines.
    let lines = [header(&"a\n".repeat(500_000), 2), [9; 8].to_vec()].concat();
    let (result, most) = read(&lines);
    assert_eq!(result.unwrap().sky.texels.len(), 2);
    assert!(most < lines.len() + (64 << 10), "{most} bytes for {}", lines.len());
}
