//! Images of the samples that only rasterise.
#![expect(clippy::expect_used, clippy::panic, reason = "a test whose sample cannot render has failed")]

use image::RgbaImage;
use lvk_samples::app::headless;
use lvk_samples::app::sample::{FrameTime, Sample};
use lvk_samples::app::sample_error::SampleError;

/// Size of the images.
pub const SIZE: [u32; 2] = [160, 90];
/// Frames of a round of the animations.
pub const ROUND: u32 = 100;

/// Renders a frame of a sample made for images of [`SIZE`].
///
/// # Panics
/// When rendering fails.
pub fn image_of<S: Sample>(sample: &mut S, frame: u32) -> RgbaImage {
    sample.update(FrameTime::from_frame(frame, ROUND));
    image_now(sample)
}

/// Renders the current state of a sample made for images of [`SIZE`].
///
/// # Panics
/// When rendering fails.
pub fn image_now<S: Sample>(sample: &mut S) -> RgbaImage {
    let rendered = headless::picture(sample);
    let pixels = rendered.expect("the sample renders");
    RgbaImage::from_raw(SIZE[0], SIZE[1], pixels).expect("the image has the size that was asked for")
}

/// Asserts that the animation changes within a round and ends where it began.
///
/// # Panics
/// As said, and when rendering fails.
pub fn assert_loops_without_seam<S: Sample>(sample: &mut S) {
    let first = image_of(sample, 0);
    assert_ne!(image_of(sample, 33), first, "something moves");
    assert_eq!(image_of(sample, ROUND), first);
}

/// Asserts that `make` refuses image sizes that no device supports.
///
/// # Panics
/// When it does not.
pub fn assert_refuses_impossible_sizes<S>(make: impl Fn([u32; 2]) -> Result<S, SampleError>) {
    for size in [[0, 8], [8, 0], [1 << 30, 8], [8, u32::MAX]] {
        match make(size).err() {
            Some(SampleError::BadSize { width, height, .. }) => assert_eq!([width, height], size),
            other => panic!("{size:?}: {other:?}"),
        }
    }
}
