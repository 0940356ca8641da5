//! The pictures of the report: both methods and their differences, as in the paper's Figures 8 to 10.

use std::path::{Path, PathBuf};

use image::RgbaImage;
use image::imageops::{self, FilterType};

use super::super::setup::path_name;
use super::error::PaperError;
use crate::app::png;
use crate::hybrid::RayPath;

/// By what the paper multiplies differences to make them visible.
const GAIN: u8 = 32;
/// Width of a picture in a sheet, in pixels, at most.
const SHEET_WIDTH: u32 = 426;
/// Pixels between pictures in a sheet.
const GAP: u32 = 4;

/// A folder for pictures of one size.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pictures {
    folder: PathBuf,
    size: [u32; 2],
}

impl Pictures {
    /// Pictures of `size` pixels in `folder`, which is made.
    ///
    /// # Errors
    /// [`PaperError::Write`].
    pub fn new(folder: &Path, size: [u32; 2]) -> Result<Self, PaperError> {
        std::fs::create_dir_all(folder).map_err(PaperError::write(folder))?;
        Ok(Self { folder: folder.to_owned(), size })
    }

    /// Writes a camera's picture by both methods, and their difference.
    pub(super) fn write(
        &self,
        scene: &str,
        path: RayPath,
        camera: usize,
        [standalone, hybrid]: &[Vec<u8>; 2],
    ) -> Result<(), PaperError> {
        let difference = difference(standalone, hybrid);
        for (what, picture) in [("standalone", standalone), ("hybrid", hybrid), ("difference", &difference)] {
            let name = format!("{scene}_{}_cam{}_{what}.png", path_name(path), camera + 1);
            png::write(&self.folder.join(name), self.size[0], self.size[1], picture)?;
        }
        Ok(())
    }

    /// Writes all cameras on one sheet: stand-alone, hybrid, difference from left to right.
    pub(super) fn write_sheet(
        &self,
        scene: &str,
        path: RayPath,
        cameras: &[[Vec<u8>; 2]],
    ) -> Result<(), PaperError> {
        let [width, height] = self.size;
        let small = [width.min(SHEET_WIDTH), (height * width.min(SHEET_WIDTH) / width).max(1)];
        let rows = cameras.len() as u32;
        let sheet_size = [3 * small[0] + 2 * GAP, rows * small[1] + rows.saturating_sub(1) * GAP];
        let mut sheet = RgbaImage::from_pixel(sheet_size[0], sheet_size[1], image::Rgba([255; 4]));
        for (row, [standalone, hybrid]) in (0_u32..).zip(cameras) {
            let pictures = [standalone.clone(), hybrid.clone(), difference(standalone, hybrid)];
            for (column, picture) in (0_u32..).zip(pictures) {
                let Some(picture) = RgbaImage::from_raw(width, height, picture) else { continue };
                let picture = imageops::resize(&picture, small[0], small[1], FilterType::Triangle);
                let [x, y] = [column * (small[0] + GAP), row * (small[1] + GAP)];
                imageops::replace(&mut sheet, &picture, i64::from(x), i64::from(y));
            }
        }
        let file = self.folder.join(sheet_name(scene, path));
        Ok(png::write(&file, sheet_size[0], sheet_size[1], sheet.as_raw())?)
    }
}

/// Name of the sheet of a scene.
pub(super) fn sheet_name(scene: &str, path: RayPath) -> String {
    format!("{scene}_{}.png", path_name(path))
}

/// White where two pictures are equal, darker by 32 times their difference in each channel.
fn difference(first: &[u8], second: &[u8]) -> Vec<u8> {
    let channel = |(index, (a, b)): (usize, (&u8, &u8))| match index % 4 {
        3 => 255,
        _ => 255 - a.abs_diff(*b).saturating_mul(GAIN),
    };
    first.iter().zip(second).enumerate().map(channel).collect()
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
    fn a_sheet_has_a_row_for_each_camera() {
        let folder = tempfile::tempdir().unwrap();
        let pictures = Pictures::new(folder.path(), [8, 4]).unwrap();
        let pair = || [vec![7; 128], vec![9; 128]];
        pictures.write_sheet("a", RayPath::Query, &[pair(), pair()]).unwrap();
        pictures.write("a", RayPath::Query, 1, &pair()).unwrap();
        let sheet = image::open(folder.path().join("a_query.png")).unwrap().into_rgba8();
        assert_eq!(sheet.dimensions(), (3 * 8 + 8, 2 * 4 + 4));
        assert_eq!(sheet.get_pixel(0, 0).0[0], 7);
        assert_eq!(sheet.get_pixel(24, 8).0[0], 255 - 64);
        assert!(folder.path().join("a_query_cam2_difference.png").is_file());
    }
}
