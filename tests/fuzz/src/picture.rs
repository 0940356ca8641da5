//! The target `image`: image files, and the texels that they state.

use std::io::Cursor;

use image::{ImageDecoder as _, ImageFormat, ImageReader};
use lvk_samples::picture::{self, Bounds};

use crate::files::with_files;
use crate::input::Input;

/// Most bytes that a decoder makes of a whole image. Programs allow more; the code is the same.
const MAX_DECODED_BYTES: u64 = 8 << 20;
/// Most texels of a picture.
const MAX_TEXELS: u64 = 1 << 20;
/// Bytes beside the texels for each row and column: a row and the one before it with 8 bytes a texel, and the weights of a filter.
const SIDE_BYTES: u64 = 64;

/// Names, which decide the format where the contents do not.
const NAMES: [&str; 6] = ["a.png", "a.jpg", "a.bmp", "a.tga", "a", "a.gif"];

/// Takes the name and the bounds from the first byte of an input.
fn parts_of(bytes: &[u8]) -> (&'static str, Bounds, &[u8]) {
    let mut input = Input::new(bytes);
    let choice = input.byte();
    let name = NAMES[usize::from(choice & 0x3f) % NAMES.len()];
    let usual = Bounds { max_texels: MAX_TEXELS, max_decoded_bytes: MAX_DECODED_BYTES, ..Bounds::default() };
    let small = Bounds { max_side: 40, max_texels: 1_000, max_decoded_bytes: 1 << 20, ..usual };
    (name, if choice & 0x80 == 0 { usual } else { small }, input.rest())
}

/// An image file. The first byte chooses its name and the bounds.
pub(crate) fn read_image(bytes: &[u8]) -> bool {
    let (name, bounds, file) = parts_of(bytes);
    with_files(&[(name, file)], |folder| match picture::read(&folder.join(name), &bounds) {
        Ok(picture) => {
            let texels = picture.width as usize * picture.height as usize;
            assert!(texels > 0 && picture.rgba.len() == 4 * texels);
            assert!(picture.width <= bounds.max_side && picture.height <= bounds.max_side);
            assert!(texels as u64 <= bounds.max_texels);
            true
        }
        Err(error) => error.to_string().is_empty(),
    })
}

/// Returns the bytes that may be made of an image: those of the decoder where it gives whole images, those of the picture, and
/// those of rows and columns. 0 if the header states more than is read, or cannot be read.
pub(crate) fn decoded_image_bytes(bytes: &[u8]) -> usize {
    let (name, bounds, file) = parts_of(bytes);
    let Some(([width, height], decoded)) = stated_size(name, file) else { return 0 };
    let texels = u64::from(width) * u64::from(height);
    if texels > picture::MAX_TEXELS_PER_BYTE * file.len() as u64 || decoded > bounds.max_decoded_bytes {
        return 0;
    }
    let sides = SIDE_BYTES * (u64::from(width) + u64::from(height));
    (decoded + 4 * texels.min(bounds.max_texels) + sides) as usize
}

/// Returns the width, the height and the bytes of the decoder of a whole image: none for a PNG without interlacing.
fn stated_size(name: &str, file: &[u8]) -> Option<([u32; 2], u64)> {
    let mut reader = ImageReader::new(Cursor::new(file));
    if let Ok(format) = ImageFormat::from_path(name) {
        reader.set_format(format);
    }
    let reader = reader.with_guessed_format().ok()?;
    // The decoder of `image` refuses some files that are read here, a row at a time.
    if reader.format() == Some(ImageFormat::Png)
        && let Some(header) = file.get(16..29)
        && header[12] == 0
    {
        let side = |at: usize| Some(u32::from_be_bytes(*header.get(at..)?.first_chunk()?));
        return Some(([side(0)?, side(4)?], 0));
    }
    let decoder = reader.into_decoder().ok()?;
    let (width, height) = decoder.dimensions();
    Some(([width, height], decoder.total_bytes()))
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test")]
mod tests {
    use super::*;

    #[test]
    fn headers_state_what_is_decoded() {
        let stated = |input: &[u8]| stated_size(parts_of(input).0, parts_of(input).2);
        let rows = include_bytes!("../corpus/image/rgba.png");
        assert_eq!(stated(rows), Some(([45, 7], 0)));
        assert_eq!(decoded_image_bytes(rows), 4 * 45 * 7 + 64 * (45 + 7));
        let whole = include_bytes!("../corpus/image/rgb.jpg");
        assert_eq!(stated(whole), Some(([45, 7], 3 * 45 * 7)));
        assert_eq!(decoded_image_bytes(whole), 7 * 45 * 7 + 64 * (45 + 7));
        assert_eq!(stated(include_bytes!("../corpus/image/rgba.tga")), Some(([45, 7], 4 * 45 * 7)));
        assert_eq!(decoded_image_bytes(b"no image"), 0);
    }

    /// A header of 71 bytes that states a size is no reason to take memory for it.
    #[test]
    fn sizes_that_must_be_refused_allow_no_memory() {
        let mut png = include_bytes!("../corpus/image/rgba.png").to_vec();
        png[1 + 16..][..8].copy_from_slice(&[0, 0, 0x40, 0, 0, 0, 0x40, 0]);
        assert_eq!(stated_size("a.png", &png[1..]), Some(([16_384; 2], 0)));
        assert_eq!(decoded_image_bytes(&png), 0);
    }
}
