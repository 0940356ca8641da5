//! FLIP, a perceptual difference of images (Andersson et al., 2020).

use image::RgbaImage;
use nv_flip::FlipImageRgb8;

/// Returns the error of each pixel, row by row: 0 where the images look the same, 1 for black beside white. The images have the same
/// size.
#[must_use]
pub fn flip_errors(image: &RgbaImage, reference: &RgbaImage) -> Vec<f32> {
    let [image, reference] = [image, reference].map(|picture| {
        let rgb: Vec<u8> = picture.pixels().flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect();
        FlipImageRgb8::with_data(picture.width(), picture.height(), &rgb)
    });
    nv_flip::flip(reference, image, nv_flip::DEFAULT_PIXELS_PER_DEGREE).to_vec()
}
