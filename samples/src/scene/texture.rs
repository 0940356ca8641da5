//! Images on surfaces.

use std::path::Path;

use lvk::{readable_line, readable_name};

use crate::picture::{self, Bounds, Picture};

/// An image that repeats over a surface.
#[derive(Debug, Clone, PartialEq)]
pub struct Texture {
    /// File name, or what it shows when it was painted by code.
    pub name: String,
    /// Texels in a row; at least 1.
    pub width: u32,
    /// Rows; at least 1.
    pub height: u32,
    /// Red, green, blue, alpha of each texel, 8 bits each, sRGB, row by row: `width * height * 4` bytes.
    pub pixels: Vec<u8>,
}

/// Texels on an edge of the stand-in for a missing image.
const STAND_IN_SIZE: u32 = 16;

/// Bytes of texels that the pictures of a scene may still have, and warnings on the pictures read.
pub(super) struct PictureBudget {
    bytes_left: u64,
    warnings: Vec<String>,
}

impl Default for PictureBudget {
    fn default() -> Self {
        Self { bytes_left: Bounds::MAX_SCENE_BYTES, warnings: Vec::new() }
    }
}

impl PictureBudget {
    /// Takes back the bytes of a picture that is not kept.
    pub(super) fn give_back(&mut self, texture: &Texture) {
        self.bytes_left += texture.pixels.len() as u64;
    }

    /// The warnings, each with the name of its file.
    pub(super) fn into_warnings(self) -> Vec<String> {
        self.warnings
    }
}

impl Texture {
    /// Reads an image file within the bounds of [`picture::read`]. Its texels and the warnings on it go to `budget`.
    ///
    /// # Errors
    /// Describes the error in the file, as text for a warning.
    pub(super) fn read(path: &Path, budget: &mut PictureBudget) -> Result<Self, String> {
        let bounds = Bounds { bytes_left: budget.bytes_left, ..Bounds::default() };
        let Picture { width, height, rgba, warnings } =
            picture::read(path, &bounds).map_err(|error| readable_line(error.to_string().trim_end()))?;
        let name = readable_name(path);
        budget.bytes_left = budget.bytes_left.saturating_sub(rgba.len() as u64);
        budget.warnings.extend(warnings.iter().map(|warning| format!("picture {name}: {warning}")));
        Ok(Self { name, width, height, pixels: rgba })
    }

    /// The same with holes where `mask`, stretched over it, is dark: its red becomes alpha.
    pub(super) fn masked(mut self, mask: &Self) -> Self {
        let (width, height) = (self.width as usize, self.height as usize);
        let (mask_width, mask_height) = (mask.width as usize, mask.height as usize);
        for (number, texel) in self.pixels.chunks_exact_mut(4).enumerate() {
            let (x, y) = (number % width * mask_width / width, number / width * mask_height / height);
            texel[3] = mask.pixels[4 * (y * mask_width + x)];
        }
        self
    }

    /// The magenta and black checks that stand in for an image that cannot be had.
    pub(super) fn stand_in(name: &str) -> Self {
        let texel = |i: u32| match (i % STAND_IN_SIZE / 4 + i / STAND_IN_SIZE / 4) % 2 {
            0 => [255, 0, 255, 255],
            _ => [0, 0, 0, 255],
        };
        let pixels = (0..STAND_IN_SIZE * STAND_IN_SIZE).flat_map(texel).collect();
        Self { name: name.to_owned(), width: STAND_IN_SIZE, height: STAND_IN_SIZE, pixels }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_broken_image_is_an_error_and_not_a_panic() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("broken.png");
        std::fs::write(&path, b"\x89PNG\r\n\x1a\nnothing").unwrap();
        let mut budget = PictureBudget::default();
        assert!(Texture::read(&path, &mut budget).is_err());
        assert!(Texture::read(&folder.path().join("absent.png"), &mut budget).is_err());
    }

    #[test]
    fn pictures_of_a_scene_share_a_budget() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("wall.png");
        image::RgbaImage::new(4, 2).save(&path).unwrap();
        let mut budget = PictureBudget { bytes_left: 70, warnings: Vec::new() };
        let first = Texture::read(&path, &mut budget).unwrap();
        Texture::read(&path, &mut budget).unwrap();
        let error = Texture::read(&path, &mut budget).unwrap_err();
        assert!(error.starts_with("its 32 bytes of texels are more than the 6 that are left"), "{error}");
        budget.give_back(&first);
        assert!(Texture::read(&path, &mut budget).is_ok());
    }

    #[test]
    fn a_mask_of_another_size_is_stretched() {
        let picture = |width, height, reds: &[u8]| {
            let pixels = reds.iter().flat_map(|&red| [red, 7, 7, 255]).collect();
            Texture { name: String::new(), width, height, pixels }
        };
        let masked = picture(4, 2, &[9; 8]).masked(&picture(2, 1, &[0, 200]));
        let alphas: Vec<_> = masked.pixels.chunks(4).map(|texel| [texel[0], texel[3]]).collect();
        let row = [[9, 0], [9, 0], [9, 200], [9, 200]];
        assert_eq!(alphas, [row, row].concat());
    }

    #[test]
    fn the_stand_in_is_visible_on_any_background() {
        let texture = Texture::stand_in("absent.png");
        assert_eq!(texture.pixels.len(), (texture.width * texture.height * 4) as usize);
        let magenta = texture.pixels.chunks(4).filter(|texel| texel[0] == 255 && texel[1] == 0).count();
        assert_eq!(magenta * 2, (texture.width * texture.height) as usize);
    }
}
