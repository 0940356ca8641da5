//! Images on surfaces.

use std::path::{Path, PathBuf};

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

impl Texture {
    /// Reads an image file.
    ///
    /// # Errors
    /// Describes the error in the file, as text for a warning.
    pub(super) fn read(path: &Path) -> Result<Self, String> {
        let decoded = image::ImageReader::open(path)
            .and_then(|reader| reader.with_guessed_format())
            .map_err(|error| error.to_string())?
            .decode()
            .map_err(|error| error.to_string())?
            .into_rgba8();
        let (width, height) = decoded.dimensions();
        if width == 0 || height == 0 {
            return Err("the image has no pixels".to_owned());
        }
        Ok(Self { name: path.display().to_string(), width, height, pixels: decoded.into_raw() })
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

/// Finds the file that an MTL means by `name`, seen from `folder`: as written (backslashes are separators),
/// with other capitals, or, if the folders of the name do not exist on this machine, by its last part
/// in `folder` or in `folder/textures`.
pub(super) fn find_image(folder: &Path, name: &str) -> Option<PathBuf> {
    let name = name.replace('\\', "/");
    let last = name.rsplit('/').next().unwrap_or_default();
    let candidates = [folder.join(&name), folder.join(last), folder.join("textures").join(last)];
    let exact = candidates.iter().find(|path| path.is_file()).cloned();
    exact.or_else(|| candidates.iter().find_map(|path| with_other_capitals(path)))
}

fn with_other_capitals(path: &Path) -> Option<PathBuf> {
    let wanted = path.file_name()?.to_str()?.to_lowercase();
    let entries = std::fs::read_dir(path.parent()?).ok()?.flatten();
    let matching = entries.filter(|entry| entry.file_name().to_string_lossy().to_lowercase() == wanted);
    matching.map(|entry| entry.path()).filter(|path| path.is_file()).min()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_are_opened_by_foreign_paths_and_capitals() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("textures")).unwrap();
        std::fs::write(folder.path().join("textures/Wood.PNG"), b"").unwrap();
        let wood = folder.path().join("textures/Wood.PNG").canonicalize().unwrap();
        for name in
            ["textures/Wood.PNG", "textures\\Wood.PNG", "C:\\art\\Wood.PNG", "wood.png", "Textures/wood.png"]
        {
            let found = find_image(folder.path(), name).unwrap();
            assert_eq!(found.canonicalize().unwrap(), wood, "{name}");
        }
        assert_eq!(find_image(folder.path(), "stone.png"), None);
    }

    #[test]
    fn a_broken_image_is_an_error_and_not_a_panic() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("broken.png");
        std::fs::write(&path, b"\x89PNG\r\n\x1a\nnothing").unwrap();
        assert!(Texture::read(&path).is_err());
        assert!(Texture::read(&folder.path().join("absent.png")).is_err());
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
