//! Pictures of the samples that only rasterise.
#![expect(clippy::expect_used, clippy::panic, reason = "a test whose sample cannot render has failed")]

use image::RgbaImage;
use lvk_samples::app::headless;
use lvk_samples::app::run_error::RunError;
use lvk_samples::app::sample::{FrameTime, Sample};
use lvk_samples::app::sample_error::SampleError;

/// Size of their pictures in tests.
pub const SIZE: [u32; 2] = [160, 90];
/// Frames of a round of their animations in tests.
pub const ROUND: u32 = 100;

/// What `sample`, made for pictures of [`SIZE`], shows in a frame.
///
/// # Panics
/// When it fails.
pub fn picture_of<S: Sample>(sample: &mut S, frame: u32) -> RgbaImage {
    let moved = sample.update(FrameTime::from_frame(frame, ROUND));
    moved.map_err(|error| -> RunError { error.into() }).expect("the sample has that moment");
    picture_now(sample)
}

/// What `sample`, made for pictures of [`SIZE`], shows as it is.
///
/// # Panics
/// When it fails.
pub fn picture_now<S: Sample>(sample: &mut S) -> RgbaImage {
    let rendered = headless::picture(sample);
    let pixels = rendered.map_err(|error| -> RunError { error.into() }).expect("the sample renders");
    RgbaImage::from_raw(SIZE[0], SIZE[1], pixels).expect("the picture has the size that was asked for")
}

/// Asks `make` for pictures of sizes that no device has.
///
/// # Panics
/// When it does not refuse them as it should.
pub fn assert_refuses_impossible_sizes<S>(make: impl Fn([u32; 2]) -> Result<S, SampleError>) {
    for size in [[0, 8], [8, 0], [1 << 30, 8], [8, u32::MAX]] {
        match make(size).err() {
            Some(SampleError::BadSize { width, height, .. }) => assert_eq!([width, height], size),
            other => panic!("{size:?}: {other:?}"),
        }
    }
}
