//! Formats whose decoders give whole images.

use std::io::{BufRead, Seek};

use image::{DynamicImage, ImageDecoder as _, ImageReader, Limits};

use super::bounds::check_file_bytes;
use super::scanlines::{ScanlineSink, eight_bits};
use super::{Bounds, Picture, PictureError};

/// Decodes the image of a file of `file_bytes` bytes and shrinks it where it must be.
pub(super) fn read<R: BufRead + Seek>(
    mut reader: ImageReader<R>,
    file_bytes: u64,
    bounds: &Bounds,
) -> Result<Picture, PictureError> {
    let mut limits = Limits::no_limits();
    // Beside the image, decoders keep tables and rows.
    limits.max_alloc = Some(bounds.max_decoded_bytes.saturating_mul(2));
    reader.limits(limits);
    let decoder = reader.into_decoder()?;
    let (width, height) = decoder.dimensions();
    let (from, bytes) = ([width, height], decoder.total_bytes());
    let to = bounds.fit(from)?;
    let most = bounds.max_decoded_bytes;
    if bytes > most {
        return Err(PictureError::TooManyBytes { width, height, bytes, most });
    }
    check_file_bytes(from, file_bytes)?;
    let image = DynamicImage::from_decoder(decoder)?;
    match from == to {
        true => Ok(Picture { width, height, rgba: image.into_rgba8().into_raw(), warnings: Vec::new() }),
        false => Ok(shrunk(image, from, to)),
    }
}

fn shrunk(image: DynamicImage, from: [u32; 2], to: [u32; 2]) -> Picture {
    let channels = usize::from(image.color().channel_count());
    let row = from[0] as usize * channels;
    let mut sink = ScanlineSink::new(from, to, channels);
    match image {
        DynamicImage::ImageLuma8(image) => push_rows(&mut sink, &image, row),
        DynamicImage::ImageLumaA8(image) => push_rows(&mut sink, &image, row),
        DynamicImage::ImageRgb8(image) => push_rows(&mut sink, &image, row),
        DynamicImage::ImageRgba8(image) => push_rows(&mut sink, &image, row),
        DynamicImage::ImageLuma16(image) => push_wide_rows(&mut sink, &image, row),
        DynamicImage::ImageLumaA16(image) => push_wide_rows(&mut sink, &image, row),
        DynamicImage::ImageRgb16(image) => push_wide_rows(&mut sink, &image, row),
        DynamicImage::ImageRgba16(image) => push_wide_rows(&mut sink, &image, row),
        other => {
            let mut sink = ScanlineSink::new(from, to, 4);
            push_rows(&mut sink, &other.into_rgba8(), from[0] as usize * 4);
            return sink.finish();
        }
    }
    sink.finish()
}

fn push_rows(sink: &mut ScanlineSink, samples: &[u8], row: usize) {
    samples.chunks_exact(row).for_each(|row| sink.push(row));
}

fn push_wide_rows(sink: &mut ScanlineSink, samples: &[u16], row: usize) {
    let mut eight = Vec::with_capacity(row);
    for row in samples.chunks_exact(row) {
        eight.clear();
        eight_bits(&mut eight, row.iter().copied());
        sink.push(&eight);
    }
}
