//! Comparison of rendered images, and files that show where they differ.
#![expect(clippy::expect_used, reason = "a test that cannot compare pictures has failed")]

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use image::RgbaImage;
use lvk::{Context, RayQueryRequest};
use lvk_bench::flip::flip_errors;
use lvk_samples::app::metrics::{self, Difference};

use crate::device_with;
use crate::subprocess::on_swiftshader;

/// Largest difference of two images; the default allows any.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tolerance {
    /// Least peak signal-to-noise ratio in dB.
    pub psnr: f64,
    /// Least structural similarity.
    pub ssim: f64,
    /// Largest share of pixels that differ by more than 1 of 255, 0 to 1.
    pub differing_share: f64,
    /// Largest mean of NVIDIA's FLIP error, 0 to 1.
    pub flip: f32,
}

impl Tolerance {
    /// An image and its reference by another driver.
    pub const ACROSS_DRIVERS: Self = Self { psnr: 46.0, ssim: 0.995, differing_share: 0.03, flip: 0.012 };
}

impl Default for Tolerance {
    fn default() -> Self {
        Self { psnr: 0.0, ssim: -1.0, differing_share: 1.0, flip: 1.0 }
    }
}

/// Measured similarity of two images.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImageSimilarity {
    /// Pixel by pixel.
    pub difference: Difference,
    /// Mean of NVIDIA's FLIP error: 0 for images that look the same, 1 for black beside white.
    pub flip: f32,
}

impl ImageSimilarity {
    /// Measures two images.
    ///
    /// # Panics
    /// When their sizes differ.
    pub fn measure(actual: &RgbaImage, expected: &RgbaImage) -> Self {
        assert_eq!(actual.dimensions(), expected.dimensions(), "pictures of different sizes");
        let (width, height) = actual.dimensions();
        let difference = metrics::compare(actual.as_raw(), expected.as_raw(), width, height);
        let difference = difference.expect("both pictures have four bytes a pixel");
        let errors = flip_errors(actual, expected);
        Self { difference, flip: errors.iter().sum::<f32>() / errors.len() as f32 }
    }

    /// True if the images are within `tolerance`.
    pub fn is_within(&self, tolerance: &Tolerance) -> bool {
        self.difference.psnr >= tolerance.psnr
            && self.difference.ssim >= tolerance.ssim
            && self.difference.differing_share <= tolerance.differing_share
            && self.flip <= tolerance.flip
    }
}

impl std::fmt::Display for ImageSimilarity {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}, mean FLIP error {:.5}", self.difference, self.flip)
    }
}

/// Asserts that two images are within `tolerance`. If not, both and their difference are written to
/// `target/test-images`, under names that begin with `what`.
///
/// # Panics
/// As said.
pub fn assert_similar(what: &str, actual: &RgbaImage, expected: &RgbaImage, tolerance: &Tolerance) {
    let similarity = ImageSimilarity::measure(actual, expected);
    eprintln!("{what}: {similarity}");
    if similarity.is_within(tolerance) {
        return;
    }
    let files = [
        write_test_image(&format!("{what} actual"), actual),
        write_test_image(&format!("{what} expected"), expected),
        write_test_image(&format!("{what} difference"), &difference_image(actual, expected)),
    ];
    let files = files.map(|path| path.display().to_string()).join("\n  ");
    assert!(similarity.is_within(tolerance), "{what}: {similarity}; wanted {tolerance:?}; see\n  {files}");
}

/// Writes an image to `target/test-images` and returns its path.
///
/// # Panics
/// When it cannot be written.
pub fn write_test_image(name: &str, picture: &RgbaImage) -> PathBuf {
    let project = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the package lies in the project");
    let folder = project.join("target/test-images");
    std::fs::create_dir_all(&folder).expect("the folder for test images can be made");
    let path = folder.join(format!("{}.png", name.replace([' ', '/'], "_")));
    picture.save(&path).expect("test images can be written");
    path
}

/// Returns the image of that name in `tests/reference`.
///
/// # Panics
/// When it cannot be read.
pub fn reference_image(name: &str) -> RgbaImage {
    image::open(reference_path(name)).expect("the reference picture can be read").into_rgba8()
}

/// Asserts that an image is similar to the one of that name in `tests/reference`. After an intended change, look at
/// the new image and copy it there.
///
/// # Panics
/// As said.
pub fn assert_matches_reference(name: &str, picture: &RgbaImage) {
    let path = reference_path(name);
    let kept = (!path.is_file()).then(|| write_test_image(&format!("{name} actual"), picture));
    assert_eq!(kept, None, "{} is not there", path.display());
    assert_similar(name, picture, &reference_image(name), &Tolerance::ACROSS_DRIVERS);
}

/// Renders an image on SwiftShader, in a process of its own that `test` starts, and asserts that it is similar to the
/// one of that name in `tests/reference`. The context queries rays in software.
///
/// # Panics
/// As [`on_swiftshader`] and [`assert_similar`].
pub fn assert_swiftshader_matches(
    test: impl Fn(),
    name: &str,
    tolerance: &Tolerance,
    render: impl FnOnce(&Context) -> RgbaImage,
) {
    on_swiftshader(test, || {
        let Some(ctx) = device_with(|desc| desc.ray_query = RayQueryRequest::Auto) else { return };
        assert_similar(&format!("SwiftShader {name}"), &render(&ctx), &reference_image(name), tolerance);
    });
}

/// Asserts that a rendered image has more than `most` colours and no pixel that nothing was drawn to: two empty images would
/// be similar too.
///
/// # Panics
/// As said.
pub fn assert_not_empty(image: &RgbaImage, most: usize) {
    let colors: HashSet<[u8; 4]> = image.pixels().map(|pixel| pixel.0).collect();
    assert!(colors.len() > most, "{} colours", colors.len());
    assert!(image.pixels().all(|pixel| pixel[3] == 255), "a pixel was left out");
}

fn reference_path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("reference/{name}.png"))
}

/// Returns FLIP's error of each pixel, from black over purple to light yellow.
fn difference_image(actual: &RgbaImage, expected: &RgbaImage) -> RgbaImage {
    let (width, height) = actual.dimensions();
    let colors = nv_flip::FlipImageFloat::with_data(width, height, &flip_errors(actual, expected))
        .apply_color_lut(&nv_flip::magma_lut())
        .to_vec();
    let rgb = image::RgbImage::from_raw(width, height, colors).expect("FLIP keeps the size");
    image::DynamicImage::from(rgb).into_rgba8()
}

#[cfg(test)]
mod tests {
    use image::Rgba;

    use super::*;

    fn ramp(step: u8) -> RgbaImage {
        RgbaImage::from_fn(32, 16, |x, y| Rgba([(x * 7) as u8, (y * 9) as u8, step, 255]))
    }

    #[test]
    fn equal_images_have_the_greatest_similarity() {
        let similarity = ImageSimilarity::measure(&ramp(9), &ramp(9));
        assert_eq!((similarity.flip, similarity.difference.max_difference), (0.0, 0));
        assert!(similarity.is_within(&Tolerance {
            psnr: f64::INFINITY,
            ssim: 0.9999,
            differing_share: 0.0,
            flip: 0.0
        }));
    }

    #[test]
    fn every_measure_can_refuse() {
        let similarity = ImageSimilarity::measure(&ramp(0), &ramp(200));
        assert!(similarity.is_within(&Tolerance::default()), "{similarity}");
        for tolerance in [
            Tolerance { psnr: 30.0, ..Tolerance::default() },
            Tolerance { ssim: 0.9999, ..Tolerance::default() },
            Tolerance { differing_share: 0.5, ..Tolerance::default() },
            Tolerance { flip: 0.1, ..Tolerance::default() },
        ] {
            assert!(!similarity.is_within(&tolerance), "{similarity} within {tolerance:?}");
        }
    }

    #[test]
    #[should_panic(expected = "a_test_of_the_harness_actual.png")]
    fn images_that_differ_are_written() {
        assert_similar(
            "a test of the harness",
            &ramp(0),
            &ramp(200),
            &Tolerance { flip: 0.1, ..Tolerance::default() },
        );
    }
}
