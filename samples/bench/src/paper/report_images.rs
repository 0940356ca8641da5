//! The images of the report: both methods and their differences, as in the paper's Figures 8 to 10.

use std::path::{Path, PathBuf};

use image::RgbaImage;
use image::imageops::{self, FilterType};

use super::error::PaperError;
use super::trace_path::TracePath;
use lvk_samples::app::png;

/// Factor by which the paper multiplies differences.
const GAIN: u8 = 32;
/// Maximum width of an image in a sheet, in pixels.
const SHEET_WIDTH: u32 = 426;
/// Pixels between images in a sheet.
const GAP: u32 = 4;
/// Colour of the border around difference images, which are mostly white.
const BORDER: image::Rgba<u8> = image::Rgba([128, 128, 128, 255]);

/// A folder for images of one size.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ReportImages {
    folder: PathBuf,
    size: [u32; 2],
}

impl ReportImages {
    /// Creates `folder` for images of `size` pixels.
    ///
    /// # Errors
    /// [`PaperError::Write`] if the folder cannot be created.
    pub fn new(folder: &Path, size: [u32; 2]) -> Result<Self, PaperError> {
        std::fs::create_dir_all(folder).map_err(PaperError::write(folder))?;
        Ok(Self { folder: folder.to_owned(), size })
    }

    /// Writes the images of a camera by both methods, and their difference.
    pub(super) fn write(
        &self,
        scene: &str,
        path: TracePath,
        camera: usize,
        [standalone, hybrid]: &[Vec<u8>; 2],
    ) -> Result<(), PaperError> {
        let [width, height] = self.size;
        let file = |what: &str| {
            let name = format!("{scene}_{}_cam{}_{what}.png", path.file_name(), camera + 1);
            self.folder.join(name)
        };
        png::write(&file("standalone"), width, height, standalone)?;
        png::write(&file("hybrid"), width, height, hybrid)?;
        if let Some(difference) = RgbaImage::from_raw(width, height, difference(standalone, hybrid)) {
            let with_border = with_border(&difference);
            png::write(&file("difference"), with_border.width(), with_border.height(), with_border.as_raw())?;
        }
        Ok(())
    }

    /// Writes all cameras on one sheet: stand-alone, hybrid, difference from left to right.
    pub(super) fn write_sheet(
        &self,
        scene: &str,
        path: TracePath,
        cameras: &[[Vec<u8>; 2]],
    ) -> Result<(), PaperError> {
        let [width, height] = self.size;
        let small = [width.min(SHEET_WIDTH), (height * width.min(SHEET_WIDTH) / width).max(1)];
        let rows = cameras.len() as u32;
        let sheet_size = [3 * small[0] + 2 * GAP, rows * small[1] + rows.saturating_sub(1) * GAP];
        let mut sheet = RgbaImage::from_pixel(sheet_size[0], sheet_size[1], image::Rgba([255; 4]));
        for (row, [standalone, hybrid]) in (0_u32..).zip(cameras) {
            let images = [standalone.clone(), hybrid.clone(), difference(standalone, hybrid)];
            for (column, picture) in (0_u32..).zip(images) {
                let Some(picture) = RgbaImage::from_raw(width, height, picture) else { continue };
                let picture = match column {
                    2 => with_border(&downscale_minimum(
                        &picture,
                        small.map(|side| side.saturating_sub(2).max(1)),
                    )),
                    _ => imageops::resize(&picture, small[0], small[1], FilterType::Triangle),
                };
                let [x, y] = [column * (small[0] + GAP), row * (small[1] + GAP)];
                imageops::replace(&mut sheet, &picture, i64::from(x), i64::from(y));
            }
        }
        let file = self.folder.join(sheet_name(scene, path));
        Ok(png::write(&file, sheet_size[0], sheet_size[1], sheet.as_raw())?)
    }
}

/// Returns the file name of the sheet of a scene.
pub(super) fn sheet_name(scene: &str, path: TracePath) -> String {
    format!("{scene}_{}.png", path.file_name())
}

/// Returns an image that is white where both images are equal, and darker by 32 times the difference per channel.
fn difference(first: &[u8], second: &[u8]) -> Vec<u8> {
    let channel = |(index, (a, b)): (usize, (&u8, &u8))| match index % 4 {
        3 => 255,
        _ => 255 - a.abs_diff(*b).saturating_mul(GAIN),
    };
    first.iter().zip(second).enumerate().map(channel).collect()
}

/// Returns the image with a border of one pixel.
fn with_border(picture: &RgbaImage) -> RgbaImage {
    let mut with_border = RgbaImage::from_pixel(picture.width() + 2, picture.height() + 2, BORDER);
    imageops::replace(&mut with_border, picture, 1, 1);
    with_border
}

/// Downscales an image to the minimum per channel, so that a single differing pixel stays visible.
fn downscale_minimum(picture: &RgbaImage, size: [u32; 2]) -> RgbaImage {
    let mut shrunk = RgbaImage::from_pixel(size[0], size[1], image::Rgba([255; 4]));
    let scale = |at: u32, from: u32, to: u32| (u64::from(at) * u64::from(to) / u64::from(from)) as u32;
    for (x, y, pixel) in picture.enumerate_pixels() {
        let at = [scale(x, picture.width(), size[0]), scale(y, picture.height(), size[1])];
        let kept = shrunk.get_pixel_mut(at[0], at[1]);
        kept.0 = std::array::from_fn(|channel| kept.0[channel].min(pixel.0[channel]));
    }
    shrunk
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_are_inverted_and_multiplied() {
        let found = difference(&[10, 20, 30, 255, 0, 0, 0, 0], &[10, 21, 22, 255, 255, 0, 3, 0]);
        assert_eq!(found, [255, 223, 0, 255, 0, 255, 159, 255]);
    }

    #[test]
    fn a_single_pixel_survives_downscaling() {
        let mut picture = RgbaImage::from_pixel(90, 60, image::Rgba([255; 4]));
        picture.put_pixel(88, 31, image::Rgba([255, 0, 255, 255]));
        let shrunk = downscale_minimum(&picture, [9, 6]);
        assert_eq!(shrunk.get_pixel(8, 3).0, [255, 0, 255, 255]);
        assert_eq!(shrunk.pixels().filter(|pixel| pixel.0 != [255; 4]).count(), 1);
    }

    #[test]
    fn a_sheet_has_a_line_for_each_camera() {
        let folder = tempfile::tempdir().unwrap();
        let images = ReportImages::new(folder.path(), [8, 4]).unwrap();
        let pair = || [vec![7; 128], vec![9; 128]];
        images.write_sheet("a", TracePath::Query, &[pair(), pair()]).unwrap();
        images.write("a", TracePath::Query, 1, &pair()).unwrap();
        let sheet = image::open(folder.path().join("a_query.png")).unwrap().into_rgba8();
        assert_eq!(sheet.dimensions(), (3 * 8 + 8, 2 * 4 + 4));
        assert_eq!(sheet.get_pixel(0, 0).0[0], 7);
        assert_eq!((*sheet.get_pixel(24, 8), sheet.get_pixel(25, 9).0[0]), (BORDER, 255 - 64));
        assert!(folder.path().join("a_query_cam2_difference.png").is_file());
    }
}
