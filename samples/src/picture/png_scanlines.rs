//! PNG, row by row.

use std::io::{BufRead, Seek};

use png::{BitDepth, Decoder, Limits, Transformations};

use super::bounds::check_file_bytes;
use super::scanlines::{ScanlineSink, eight_bits};
use super::{Bounds, Picture, PictureError};

/// Most bytes of what the decoder keeps beside a row.
const DECODER_BYTES: usize = 64 << 20;

/// Reads a PNG of `file_bytes` bytes from its start. `None` for an interlaced one, whose rows come in seven passes.
pub(super) fn read(
    file: impl BufRead + Seek,
    file_bytes: u64,
    bounds: &Bounds,
) -> Result<Option<Picture>, PictureError> {
    let mut decoder = Decoder::new_with_limits(file, Limits { bytes: DECODER_BYTES });
    decoder.set_transformations(Transformations::EXPAND);
    decoder.set_ignore_text_chunk(true);
    decoder.set_ignore_iccp_chunk(true);
    let header = decoder.read_header_info()?;
    let (from, interlaced) = ([header.width, header.height], header.interlaced);
    let to = bounds.fit(from)?;
    check_file_bytes(from, file_bytes)?;
    if interlaced {
        return Ok(None);
    }
    let mut reader = decoder.read_info()?;
    let (color, depth) = reader.output_color_type();
    let mut sink = ScanlineSink::new(from, to, color.samples());
    let mut eight = Vec::new();
    for row in 1..=from[1] {
        let error = |source| PictureError::Row { row, height: from[1], source };
        let samples = reader.next_row().map_err(error)?.ok_or(PictureError::Empty)?;
        match depth {
            BitDepth::Sixteen => {
                let words = samples.data().as_chunks::<2>().0.iter().map(|bytes| u16::from_be_bytes(*bytes));
                eight.clear();
                eight_bits(&mut eight, words);
                sink.push(&eight);
            }
            _ => sink.push(samples.data()),
        }
    }
    Ok(Some(sink.finish()))
}
