//! Image files: decoding within bounds, and shrinking.
//!
//! A PNG is decoded row by row and shrunk meanwhile, so that beside the result only some rows are in memory. The decoders
//! of other formats, and that of interlaced PNG, give whole images only; these have a bound of their own.

mod bounds;
mod jpeg_end;
mod png_scanlines;
mod scanlines;
pub mod shrink;
mod whole;

use std::io::{BufReader, Seek as _};
use std::path::Path;

use image::{ImageFormat, ImageReader};

pub(crate) use bounds::shrunk_size;
pub use bounds::{Bounds, MAX_DECODED_BYTES, MAX_SOURCE_SIDE, MAX_SOURCE_TEXELS, MAX_TEXELS_PER_BYTE};

use crate::app::input_file::{self, FileKind};

/// A decoded image.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Picture {
    /// Texels in a row; at least 1.
    pub width: u32,
    /// Rows; at least 1.
    pub height: u32,
    /// Red, green, blue, alpha of each texel, 8 bits each, row by row: `width * height * 4` bytes.
    pub rgba: Vec<u8>,
    /// Differences from the file, for the user.
    pub warnings: Vec<String>,
}

/// Errors of reading an image file. The messages do not name the file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PictureError {
    /// The file cannot be read, is no regular file, or has too many bytes.
    #[error("{0}")]
    File(#[from] std::io::Error),
    /// The image has no texels.
    #[error("the image has no pixels")]
    Empty,
    /// The image has more texels than are read.
    #[error(
        "it has {width}x{height} texels, but at most {MAX_SOURCE_SIDE} a side and {MAX_SOURCE_TEXELS} in all are read; \
         shrink it"
    )]
    TooManyTexels {
        /// Texels in a row.
        width: u32,
        /// Rows.
        height: u32,
    },
    /// The image is too large for a decoder that gives whole images only.
    #[error(
        "it has {width}x{height} texels, which take {bytes} bytes, more than the {most} that are decoded of \
         this kind of file; shrink it, or convert it to PNG without interlacing"
    )]
    TooManyBytes {
        /// Texels in a row.
        width: u32,
        /// Rows.
        height: u32,
        /// Bytes of the decoded image.
        bytes: u64,
        /// Most bytes, [`Bounds::max_decoded_bytes`].
        most: u64,
    },
    /// The file is a Radiance HDR file.
    #[error(
        "it is a Radiance HDR file, and pictures of high dynamic range are not read here; convert it to PNG"
    )]
    HighDynamicRange,
    /// The header states more texels than a file of this length can have.
    #[error(
        "the file has {bytes} bytes, too few for the {width}x{height} texels that it states: it is cut off or damaged"
    )]
    TooFewBytes {
        /// Texels in a row.
        width: u32,
        /// Rows.
        height: u32,
        /// Bytes of the file.
        bytes: u64,
    },
    /// The images of a scene have more texels than it may have.
    #[error(
        "its {bytes} bytes of texels are more than the {left} that are left of {all} for all pictures of a scene; shrink \
         pictures"
    )]
    OverBudget {
        /// Bytes of the image.
        bytes: u64,
        /// Bytes that are left.
        left: u64,
        /// Bytes for all images.
        all: u64,
    },
    /// A row of a PNG cannot be decoded.
    #[error("row {row} of {height}: {source}")]
    Row {
        /// The row, from 1.
        row: u32,
        /// Rows of the image.
        height: u32,
        /// Error of the decoder.
        source: png::DecodingError,
    },
    /// The start of a PNG cannot be decoded.
    #[error("{0}")]
    Png(#[from] png::DecodingError),
    /// The decoder refused the file.
    #[error("{0}")]
    Decoder(#[from] image::ImageError),
}

/// Reads an image file. An image that exceeds [`Bounds::max_side`] or [`Bounds::max_texels`] is shrunk, with a warning. A JPEG
/// that is cut off is read with a warning, too: the texels behind the end are grey.
///
/// # Errors
/// [`PictureError`].
pub fn read(path: &Path, bounds: &Bounds) -> Result<Picture, PictureError> {
    let file = input_file::open(path, FileKind::Picture)?;
    let file_bytes = file.metadata()?.len();
    let file = BufReader::new(file);
    let mut reader = ImageReader::new(file);
    if let Ok(format) = ImageFormat::from_path(path) {
        reader.set_format(format);
    }
    let reader = reader.with_guessed_format()?;
    let format = reader.format();
    let mut warnings = Vec::new();
    let picture = match format {
        Some(ImageFormat::Png) => {
            let mut file = reader.into_inner();
            match png_scanlines::read(&mut file, file_bytes, bounds)? {
                Some(picture) => picture,
                None => {
                    file.rewind()?;
                    whole::read(ImageReader::with_format(file, ImageFormat::Png), file_bytes, bounds)?
                }
            }
        }
        Some(ImageFormat::Jpeg) => {
            let mut file = reader.into_inner();
            if !jpeg_end::has_end(&mut file)? {
                let warning =
                    "the file is cut off: it has no end-of-image marker; texels that are missing are grey";
                warnings.push(warning.to_owned());
            }
            file.rewind()?;
            whole::read(ImageReader::with_format(file, ImageFormat::Jpeg), file_bytes, bounds)?
        }
        // The decoder of `image` keeps every line of a header, and markers of no repeats overflow in it.
        Some(ImageFormat::Hdr) => return Err(PictureError::HighDynamicRange),
        _ => whole::read(reader, file_bytes, bounds)?,
    };
    warnings.extend(picture.warnings);
    Ok(Picture { warnings, ..picture })
}

#[cfg(test)]
mod tests;
