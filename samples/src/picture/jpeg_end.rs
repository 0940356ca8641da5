//! The end of a JPEG file.

use std::io::{self, BufRead, Read as _};

/// Start and end of an image.
const SOI: u8 = 0xd8;
const EOI: u8 = 0xd9;

/// True if the file has an end-of-image marker behind its last scan. Segments are skipped by their lengths, as they may
/// hold a whole JPEG of their own.
///
/// # Errors
/// Those of the reader.
pub(super) fn has_end(file: &mut impl BufRead) -> io::Result<bool> {
    let mut bytes = file.by_ref().bytes();
    loop {
        let Some(code) = next_marker(&mut bytes)? else { return Ok(false) };
        match code {
            EOI => return Ok(true),
            SOI => {}
            _ => {
                let (Some(high), Some(low)) = (bytes.next().transpose()?, bytes.next().transpose()?) else {
                    return Ok(false);
                };
                let length = u16::from_be_bytes([high, low]).saturating_sub(2);
                // The data of a scan follow its header up to the next marker.
                for _ in 0..length {
                    if bytes.next().transpose()?.is_none() {
                        return Ok(false);
                    }
                }
            }
        }
    }
}

/// The code of the next marker that is not a restart, nor a stuffed byte of a scan.
fn next_marker(bytes: &mut impl Iterator<Item = io::Result<u8>>) -> io::Result<Option<u8>> {
    let mut before = 0;
    for byte in bytes {
        let byte = byte?;
        let is_plain = matches!(byte, 0x00 | 0x01 | 0xd0..=0xd7 | 0xff);
        if before == 0xff && !is_plain {
            return Ok(Some(byte));
        }
        before = byte;
    }
    Ok(None)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Start of a scan.
    const SOS: u8 = 0xda;

    fn ends(parts: &[&[u8]]) -> bool {
        has_end(&mut parts.concat().as_slice()).unwrap()
    }

    #[test]
    fn only_the_marker_of_the_image_itself_counts() {
        let start: &[u8] = &[0xff, SOI];
        let end: &[u8] = &[0xff, EOI];
        let thumbnail: &[u8] = &[0xff, 0xe1, 0, 6, 0xff, SOI, 0xff, EOI];
        let scan: &[u8] = &[0xff, SOS, 0, 3, 9, 1, 0xff, 0, 0xff, 0xd3, 2];
        for whole in
            [&[start, scan, end][..], &[start, thumbnail, scan, end], &[start, scan, scan, end, b"more"]]
        {
            assert!(ends(whole));
        }
        assert!(ends(&[start, scan, &[0xff, 0xff], end]), "fill bytes");
        for cut in
            [&[start, thumbnail, scan][..], &[start, thumbnail], &[start, scan, &[0xff]], &[start], &[]]
        {
            assert!(!ends(cut), "{cut:?}");
        }
        assert!(!ends(&[start, &thumbnail[..7]]), "cut off in a segment");
    }
}
