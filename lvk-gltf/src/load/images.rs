//! Images: PNG, JPEG, WebP and KTX2, each recognised by its content.

use std::io::Cursor;

use image::{DynamicImage, ImageDecoder as _, ImageFormat, ImageReader, Limits};

use super::budget::Budget;
use super::buffers::Buffers;
use super::document::Document;
use super::files::Files;
use super::ktx2_texels;
use super::place::place;
use crate::{ImageData, MipLevel, Problem, TexelFormat, Warning};

/// Most texels of a side. No GPU takes more today.
pub(super) const MOST_SIDE: u32 = 32768;

/// What decodes images.
#[derive(Debug, Clone, Copy)]
pub(super) struct Images<'a> {
    pub(super) document: &'a Document,
    pub(super) buffers: &'a Buffers<'a>,
    pub(super) files: &'a Files<'a>,
    pub(super) budget: &'a Budget,
}

impl Images<'_> {
    /// Reads and decodes an image of the file.
    pub(super) fn decode(&self, index: usize) -> Result<(ImageData, Vec<Warning>), Problem> {
        let json = &self.document.root.images[index];
        let name = || place("image", index, json.name.as_deref());
        let decode = |source| self.decode_bytes(&self.budget.read(source, name)?, &name());
        match (&json.uri, json.buffer_view) {
            (Some(uri), _) => decode(self.files.resolve(uri, self.budget, &name)?.source()),
            (None, Some(view)) => decode(self.buffers.view(self.document, view.value())?),
            (None, None) => {
                let rule = "it has neither a URI nor a buffer view".into();
                Err(Problem::Rule { place: name(), rule })
            }
        }
    }

    fn decode_bytes(&self, bytes: &[u8], place: &str) -> Result<(ImageData, Vec<Warning>), Problem> {
        if bytes.starts_with(&ktx2::MAGIC) {
            return ktx2_texels::decode(bytes, self.budget, place).map(|image| (image, Vec::new()));
        }
        let format = image::guess_format(bytes).ok();
        let known = format
            .filter(|format| matches!(format, ImageFormat::Png | ImageFormat::Jpeg | ImageFormat::WebP));
        let Some(format) = known else {
            let why = "it is neither PNG, JPEG, WebP nor KTX2; convert it to one of these".into();
            return Err(Problem::Image { place: place.into(), why });
        };
        let warnings = if format == ImageFormat::Jpeg { warn_of_jpeg_end(bytes, place) } else { Vec::new() };
        decode_rgba(bytes, format, self.budget, place).map(|image| (image, warnings))
    }
}

fn decode_rgba(
    bytes: &[u8],
    format: ImageFormat,
    budget: &Budget,
    place: &str,
) -> Result<ImageData, Problem> {
    let damaged = |error: image::ImageError| Problem::Image {
        place: place.into(),
        why: format!(
            "it cannot be decoded ({}); export it again",
            super::place::shortened(&error.to_string())
        ),
    };
    let mut limits = Limits::default();
    limits.max_image_width = Some(MOST_SIDE);
    limits.max_image_height = Some(MOST_SIDE);
    limits.max_alloc = Some(budget.left());
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    reader.limits(limits);
    let decoder = reader.into_decoder().map_err(damaged)?;
    let (width, height) = decoder.dimensions();
    // What the decoder returns, as much inside of it, and four bytes for each texel.
    let texels = u64::from(width) * u64::from(height);
    let bytes = decoder.total_bytes().saturating_mul(2).saturating_add(4 * texels);
    budget.charge(bytes, || place.into())?;
    let rgba = DynamicImage::from_decoder(decoder).map_err(damaged)?.into_rgba8();
    let level = MipLevel { width, height, bytes: rgba.into_raw() };
    Ok(ImageData { format: TexelFormat::Rgba8, mips: vec![level] })
}

/// The decoder fills what is missing with grey.
fn warn_of_jpeg_end(bytes: &[u8], place: &str) -> Vec<Warning> {
    if bytes.windows(2).rev().any(|pair| pair == [0xff, 0xd9]) {
        return Vec::new();
    }
    let what = "a JPEG that is cut off: texels that are missing are grey".into();
    vec![Warning::Corrected { place: place.into(), what }]
}
