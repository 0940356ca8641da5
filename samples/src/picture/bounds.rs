//! Sizes of images that are read, and sizes that they are shrunk to.

use super::PictureError;

/// Most texels along a side of an image that is read.
pub const MAX_SOURCE_SIDE: u32 = 1 << 17;
/// Most texels of an image that is read: 32,768 x 32,768. The most take some seconds.
pub const MAX_SOURCE_TEXELS: u64 = 1 << 30;
/// Most bytes that a decoder of whole images makes of a file, without other bounds.
pub const MAX_DECODED_BYTES: u64 = 512 << 20;
/// Most texels for each byte of a file. A header can state any size, and readers reserve memory for it. No format packs as many
/// texels: PNG has 8,256 at most, where one bit is a texel.
pub const MAX_TEXELS_PER_BYTE: u64 = 1 << 14;

/// Sizes beyond which images are shrunk or refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Bounds {
    /// Most texels along a side; at least 1.
    pub max_side: u32,
    /// Most texels; at least 1.
    pub max_texels: u64,
    /// Most bytes that a decoder of whole images makes of the file: most decoders, but not that of PNG without interlacing.
    pub max_decoded_bytes: u64,
    /// Bytes of texels that are left for this image of all that a scene may have.
    pub bytes_left: u64,
}

impl Default for Bounds {
    /// Returns the bounds of an image on a surface: 16,384 texels a side, 134,217,728 texels (512 MiB), as 16,384 x 8,192.
    fn default() -> Self {
        Self {
            max_side: 16_384,
            max_texels: 1 << 27,
            max_decoded_bytes: MAX_DECODED_BYTES,
            bytes_left: Self::MAX_SCENE_BYTES,
        }
    }
}

impl Bounds {
    /// Most bytes of all images of a scene.
    pub const MAX_SCENE_BYTES: u64 = 8 << 30;

    /// Returns bounds that shrink nothing.
    #[must_use]
    pub fn unshrunk() -> Self {
        Self { max_side: MAX_SOURCE_SIDE, max_texels: MAX_SOURCE_TEXELS, ..Self::default() }
    }

    /// Returns the size that an image of this size is shrunk to; the same size if it fits.
    ///
    /// # Errors
    /// [`PictureError::Empty`], [`PictureError::TooManyTexels`], [`PictureError::OverBudget`].
    pub(super) fn fit(&self, size: [u32; 2]) -> Result<[u32; 2], PictureError> {
        let [width, height] = size;
        if width == 0 || height == 0 {
            return Err(PictureError::Empty);
        }
        if width.max(height) > MAX_SOURCE_SIDE || texels(size) > MAX_SOURCE_TEXELS {
            return Err(PictureError::TooManyTexels { width, height });
        }
        let by_texels = (self.max_texels as f64 / texels(size) as f64).sqrt();
        let side = (f64::from(width.max(height)) * by_texels) as u32;
        let fitted = shrunk_size(size, side.min(self.max_side)).unwrap_or(size);
        let bytes = 4 * texels(fitted);
        if bytes > self.bytes_left {
            let (left, all) = (self.bytes_left, Self::MAX_SCENE_BYTES);
            return Err(PictureError::OverBudget { bytes, left, all });
        }
        Ok(fitted)
    }
}

/// Checks that a file of `file_bytes` bytes can have as many texels as its header states.
///
/// # Errors
/// [`PictureError::TooFewBytes`].
pub(super) fn check_file_bytes([width, height]: [u32; 2], file_bytes: u64) -> Result<(), PictureError> {
    match texels([width, height]) <= file_bytes.saturating_mul(MAX_TEXELS_PER_BYTE) {
        true => Ok(()),
        false => Err(PictureError::TooFewBytes { width, height, bytes: file_bytes }),
    }
}

/// Returns the number of texels of an image.
pub(super) fn texels([width, height]: [u32; 2]) -> u64 {
    u64::from(width) * u64::from(height)
}

/// Returns the largest size of the same shape with no side above `side`; `None` for a size that fits.
pub(crate) fn shrunk_size([width, height]: [u32; 2], side: u32) -> Option<[u32; 2]> {
    let longest = width.max(height);
    let shrunk =
        |length: u32| (u64::from(length) * u64::from(side) / u64::from(longest.max(1))).max(1) as u32;
    (longest > side).then(|| [shrunk(width), shrunk(height)])
}

/// Returns the warning on an image that was shrunk; `None` for one of the same size.
pub(super) fn shrunk_warning(from: [u32; 2], to: [u32; 2]) -> Option<String> {
    let [[width, height], [new_width, new_height]] = [from, to];
    let text =
        || format!("{width}x{height} texels are more than are taken; shrunk to {new_width}x{new_height}");
    (from != to).then(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_sizes_beyond_the_limit_shrink_and_keep_their_shape() {
        assert_eq!(shrunk_size([64, 64], 64), None);
        assert_eq!(shrunk_size([65, 1], 64), Some([64, 1]));
        assert_eq!(shrunk_size([1000, 500], 100), Some([100, 50]));
        assert_eq!(shrunk_size([1, u32::MAX], 16_384), Some([1, 16_384]));
    }

    #[test]
    fn sides_and_texels_are_bounded() {
        let bounds = Bounds::default();
        for size in [[1, 1], [16_384, 8_192], [8_192, 16_384], [11_585, 11_585]] {
            assert_eq!(bounds.fit(size).unwrap(), size);
        }
        for (size, fitted) in [
            ([20_000, 20_000], [11_585, 11_585]),
            ([16_385, 2], [16_384, 1]),
            ([131_072, 8_192], [16_384, 1_024]),
            ([21_600, 10_800], [16_384, 8_192]),
        ] {
            assert_eq!(bounds.fit(size).unwrap(), fitted);
        }
        assert_eq!(Bounds::unshrunk().fit([32_768, 32_768]).unwrap(), [32_768; 2]);
    }

    #[test]
    fn the_bytes_of_a_file_bound_its_texels() {
        assert!(check_file_bytes([16_384, 100], 100).is_ok());
        let error = check_file_bytes([16_384, 101], 100).unwrap_err();
        let text = "the file has 100 bytes, too few for the 16384x101 texels that it states: it is cut off or damaged";
        assert_eq!(error.to_string(), text);
        assert!(check_file_bytes([MAX_SOURCE_SIDE, MAX_SOURCE_SIDE], u64::MAX).is_ok());
    }

    #[test]
    fn refusals_tell_size_and_bound() {
        let text = |size| Bounds::default().fit(size).unwrap_err().to_string();
        assert_eq!(text([0, 5]), "the image has no pixels");
        for size in [[131_073, 1], [40_000, 40_000]] {
            let [width, height] = size;
            let start =
                format!("it has {width}x{height} texels, but at most 131072 a side and 1073741824 in all");
            assert!(text(size).starts_with(&start), "{}", text(size));
        }
        let little = Bounds { bytes_left: 63, ..Bounds::default() };
        assert!(little.fit([3, 5]).is_ok());
        let error = little.fit([4, 4]).unwrap_err();
        assert!(matches!(error, PictureError::OverBudget { bytes: 64, left: 63, .. }), "{error}");
    }
}
