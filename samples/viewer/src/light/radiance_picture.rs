//! Decoding of Radiance HDR pictures (Ward, 1991; the file formats of Radiance, "Picture File Format"), a row at a time.
//!
//! Rows come one by one, so that a decoder need not hold a picture, and nothing is allocated by what a header states.

/// Texels in a row from which on it may be compressed by channel. Narrower rows have these bytes as a texel.
const LEAST_WIDTH_BY_CHANNEL: usize = 8;
/// Bytes of a texel: red, green, blue, and the exponent that they share.
const TEXEL_BYTES: usize = 4;
/// Most characters of a header that a message repeats.
const MOST_QUOTED: usize = 24;

/// Defects of the bytes of a Radiance HDR picture.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum RadianceError {
    /// The bytes begin as those of no such file.
    #[error("it does not begin with #?RADIANCE or #?RGBE")]
    Signature,
    /// The file ends in its header.
    #[error("its header has no end")]
    Header,
    /// The texels have another encoding.
    #[error("its FORMAT is '{format}', and 32-bit_rle_rgbe alone is read")]
    Format {
        /// The start of the encoding's name.
        format: String,
    },
    /// The line of the size is another.
    #[error("its size is '{line}', and sizes as '-Y 512 +X 1024' alone are read")]
    SizeLine {
        /// The start of the line.
        line: String,
    },
    /// A row cannot be decoded.
    #[error("row {row} of {height}: {why}")]
    Row {
        /// The row, from 1.
        row: u32,
        /// Rows of the picture.
        height: u32,
        /// The defect of the row.
        why: &'static str,
    },
}

/// A picture whose header was read. Its rows follow one another.
#[derive(Debug)]
pub(super) struct RadiancePicture<'a> {
    /// Texels in a row.
    pub(super) width: u32,
    /// Rows.
    pub(super) height: u32,
    /// Bytes of the rows that were not read.
    rest: &'a [u8],
    /// Rows that were read.
    rows: u32,
    /// The row that was read last: red, green, blue, exponent.
    row: Vec<[u8; TEXEL_BYTES]>,
}

impl<'a> RadiancePicture<'a> {
    /// Reads the header of a file.
    ///
    /// # Errors
    /// [`RadianceError`], but for [`RadianceError::Row`].
    pub(super) fn new(bytes: &'a [u8]) -> Result<Self, RadianceError> {
        let mut rest = bytes;
        let mut line = || take_line(&mut rest).ok_or(RadianceError::Header);
        if !bytes.starts_with(b"#?RADIANCE") && !bytes.starts_with(b"#?RGBE") {
            return Err(RadianceError::Signature);
        }
        line()?;
        loop {
            let attribute = line()?;
            if attribute.is_empty() {
                break;
            }
            let format = attribute.strip_prefix(b"FORMAT=").map(<[u8]>::trim_ascii);
            if let Some(format) = format.filter(|format| *format != b"32-bit_rle_rgbe") {
                return Err(RadianceError::Format { format: quoted(format) });
            }
        }
        let size = line()?;
        let [width, height] = parse_size(size).ok_or(RadianceError::SizeLine { line: quoted(size) })?;
        Ok(Self { width, height, rest, rows: 0, row: Vec::new() })
    }

    /// Bytes of the rows that are left.
    pub(super) fn bytes_left(&self) -> u64 {
        self.rest.len() as u64
    }

    /// Fewest bytes of all rows. The old run-length encoding is the densest: behind a first texel, a marker of four bytes repeats
    /// it up to 255 times, a second one up to 255 * 256 times. That by channel takes at least four bytes a row and, for each 127
    /// texels of each of four channels, two bytes, which is never less.
    pub(super) fn least_bytes(&self) -> u64 {
        let texels_and_markers = match self.width {
            0..=1 => u64::from(self.width),
            2..=256 => 2,
            _ => 3,
        };
        texels_and_markers * TEXEL_BYTES as u64 * u64::from(self.height)
    }

    /// Decodes the next row.
    ///
    /// # Errors
    /// [`RadianceError::Row`].
    pub(super) fn next_scanline(&mut self) -> Result<Vec<[f32; 3]>, RadianceError> {
        self.rows += 1;
        self.row.resize(self.width as usize, [0; TEXEL_BYTES]);
        let (row, height) = (self.rows, self.height);
        read_scanline(&mut self.rest, &mut self.row).map_err(|why| RadianceError::Row {
            row,
            height,
            why,
        })?;
        Ok(self.row.iter().map(|texel| radiance_of(*texel)).collect())
    }
}

/// Takes a line without its end. `None` if it has no end.
fn take_line<'a>(rest: &mut &'a [u8]) -> Option<&'a [u8]> {
    let end = rest.iter().position(|byte| *byte == b'\n')?;
    let line = &rest[..end];
    *rest = &rest[end + 1..];
    Some(line.strip_suffix(b"\r").unwrap_or(line))
}

/// Width and height of a picture whose rows go down and whose columns go to the right.
fn parse_size(line: &[u8]) -> Option<[u32; 2]> {
    let words: Vec<&str> = std::str::from_utf8(line).ok()?.split_ascii_whitespace().take(5).collect();
    let ["-Y", height, "+X", width] = words[..] else { return None };
    Some([width.parse().ok()?, height.parse().ok()?])
}

/// The start of a text, for messages.
fn quoted(text: &[u8]) -> String {
    let start = &text[..text.len().min(MOST_QUOTED)];
    String::from_utf8_lossy(start).escape_debug().collect()
}

const CUT: &str = "it is cut off";
const LONG_RUN: &str = "a run is longer than the row";

/// Reads a row, flat or compressed by either run-length encoding.
fn read_scanline(rest: &mut &[u8], row: &mut [[u8; TEXEL_BYTES]]) -> Result<(), &'static str> {
    let Some([red, green, high @ 0..128, low]) = rest.first_chunk().copied() else {
        return read_texels(rest, row);
    };
    if [red, green] != [2, 2] || row.len() < LEAST_WIDTH_BY_CHANNEL {
        return read_texels(rest, row);
    }
    *rest = &rest[TEXEL_BYTES..];
    if usize::from(high) << 8 | usize::from(low) != row.len() {
        return Err("it has another length than the header states");
    }
    (0..TEXEL_BYTES).try_for_each(|channel| read_channel(rest, row, channel))
}

/// Reads one channel of a row: runs of a value, and runs of other values.
fn read_channel(rest: &mut &[u8], row: &mut [[u8; TEXEL_BYTES]], channel: usize) -> Result<(), &'static str> {
    let mut left = row;
    while !left.is_empty() {
        let [count] = take(rest)?;
        let length = if count > 128 { count - 128 } else { count };
        let (run, others) = left.split_at_mut_checked(length.into()).ok_or(LONG_RUN)?;
        if count > 128 {
            let [value] = take(rest)?;
            run.iter_mut().for_each(|texel| texel[channel] = value);
        } else {
            let (values, behind) = rest.split_at_checked(run.len()).ok_or(CUT)?;
            run.iter_mut().zip(values).for_each(|(texel, value)| texel[channel] = *value);
            *rest = behind;
        }
        left = others;
    }
    Ok(())
}

/// Reads a row of whole texels. Markers among them repeat the texel before them.
fn read_texels(rest: &mut &[u8], row: &mut [[u8; TEXEL_BYTES]]) -> Result<(), &'static str> {
    let mut at = 0;
    // Markers that follow one another are the digits of a number to the base 256, the lowest first.
    let mut shift = 0_u32;
    while at < row.len() {
        let texel = take(rest)?;
        let [1, 1, 1, digit] = texel else {
            row[at] = texel;
            (at, shift) = (at + 1, 0);
            continue;
        };
        let before = *row[..at].last().ok_or("it begins with a run of no texel")?;
        let count = u64::from(digit) << shift;
        let length = usize::try_from(count).map_err(|_| LONG_RUN)?;
        row[at..].get_mut(..length).ok_or(LONG_RUN)?.fill(before);
        at += length;
        // From the fifth digit on, any other than 0 states more texels than a row has.
        shift = (shift + 8).min(32);
    }
    Ok(())
}

/// Takes bytes from the front.
fn take<const N: usize>(rest: &mut &[u8]) -> Result<[u8; N], &'static str> {
    let (taken, behind) = rest.split_first_chunk().ok_or(CUT)?;
    *rest = behind;
    Ok(*taken)
}

/// Radiance of a texel. The exponent is above the real one by 128, and the channels are 256ths.
fn radiance_of([red, green, blue, exponent]: [u8; TEXEL_BYTES]) -> [f32; 3] {
    // The power of two, by its bits: the exponent of a double is above the real one by 1,023.
    let scale = if exponent == 0 { 0.0 } else { f64::from_bits((u64::from(exponent) + 1_023 - 136) << 52) };
    let radiance = |channel: u8| (f64::from(channel) * scale) as f32;
    [radiance(red), radiance(green), radiance(blue)]
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use image::codecs::hdr::HdrDecoder;
    use image::{DynamicImage, Rgb32FImage};
    use proptest::prelude::*;

    use super::*;

    /// How a row is stored.
    #[derive(Debug, Clone, Copy)]
    enum Coding {
        Flat,
        Markers,
        ByChannel,
    }

    fn file(width: usize, rows: &[(Coding, Vec<[u8; 4]>)]) -> Vec<u8> {
        let head = format!(
            "#?RADIANCE\n# a comment\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=1.0\n\n-Y {} +X {width}\n",
            rows.len()
        );
        let mut bytes = head.into_bytes();
        for (coding, row) in rows {
            match coding {
                Coding::Flat => bytes.extend(row.as_flattened()),
                Coding::Markers => runs(row).for_each(|run| put_markers(&mut bytes, run)),
                Coding::ByChannel => {
                    bytes.extend([2, 2, (width >> 8) as u8, width as u8]);
                    (0..4).for_each(|channel| put_channel(&mut bytes, row, channel));
                }
            }
        }
        bytes
    }

    fn runs<T: PartialEq>(row: &[T]) -> impl Iterator<Item = &[T]> {
        row.chunk_by(|a, b| a == b)
    }

    fn put_markers(bytes: &mut Vec<u8>, run: &[[u8; 4]]) {
        bytes.extend(run[0]);
        let repeats = run.len() - 1;
        let digits = [repeats as u8, (repeats >> 8) as u8];
        let count = [repeats > 0, repeats > 255].into_iter().filter(|is| *is).count();
        digits[..count].iter().for_each(|digit| bytes.extend([1, 1, 1, *digit]));
    }

    /// Runs as such, and every other one as values.
    fn put_channel(bytes: &mut Vec<u8>, row: &[[u8; 4]], channel: usize) {
        let values: Vec<u8> = row.iter().map(|texel| texel[channel]).collect();
        for (number, run) in runs(&values).flat_map(|run| run.chunks(127)).enumerate() {
            let length = run.len() as u8;
            match number % 2 {
                0 => bytes.extend([length + 128, run[0]]),
                _ => bytes.extend([&[length], run].concat()),
            }
        }
    }

    fn decoded(bytes: &[u8]) -> Result<Vec<[f32; 3]>, RadianceError> {
        let mut picture = RadiancePicture::new(bytes)?;
        assert!(picture.least_bytes() <= picture.bytes_left(), "the bound refuses a whole file");
        let mut texels = Vec::new();
        for _ in 0..picture.height {
            texels.extend(picture.next_scanline()?);
        }
        Ok(texels)
    }

    /// The texels by the decoder of the crate `image`.
    fn reference(bytes: &[u8]) -> Rgb32FImage {
        let decoder = HdrDecoder::new(Cursor::new(bytes)).unwrap();
        DynamicImage::from_decoder(decoder).unwrap().into_rgb32f()
    }

    /// Rows in a few runs. No texel is a marker, nor the start of a compressed row.
    fn rows(width: usize) -> impl Strategy<Value = Vec<(Coding, Vec<[u8; 4]>)>> {
        let texel =
            any::<[u8; 4]>().prop_map(|[red, green, blue, exponent]| [red | 4, green, blue, exponent]);
        let run = (texel, 1..700_usize).prop_map(|(texel, count)| vec![texel; count]);
        let row = prop::collection::vec(run, 1..6).prop_map(move |runs| {
            let mut row = runs.concat();
            row.resize(width, [200, 2, 3, 129]);
            row
        });
        let coding = if width < 8 {
            vec![Coding::Flat, Coding::Markers]
        } else {
            vec![Coding::Flat, Coding::Markers, Coding::ByChannel]
        };
        prop::collection::vec((prop::sample::select(coding), row), 1..5)
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(128) })]

        #[test]
        fn scanlines_of_all_encodings_are_those_of_another_decoder(
            (width, rows) in prop_oneof![1..20_usize, 200..1_200_usize].prop_flat_map(|width| (Just(width), rows(width)))
        ) {
            let bytes = file(width, &rows);
            let expected = reference(&bytes);
            prop_assert_eq!(expected.width() as usize, width);
            let expected: Vec<_> = expected.pixels().map(|texel| texel.0).collect();
            prop_assert_eq!(decoded(&bytes).unwrap(), expected);
        }
    }

    #[test]
    fn every_truncated_file_is_an_error() {
        let row: Vec<_> = (0..40).map(|x| [x | 4, 9, x / 7, 130]).collect();
        let bytes =
            file(40, &[Coding::Flat, Coding::Markers, Coding::ByChannel].map(|coding| (coding, row.clone())));
        assert_eq!(decoded(&bytes).unwrap().len(), 120);
        for length in 0..bytes.len() {
            let mut picture = RadiancePicture::new(&bytes[..length]);
            let is_whole =
                picture.as_mut().is_ok_and(|picture| (0..3).all(|_| picture.next_scanline().is_ok()));
            assert!(!is_whole, "{length} of {} bytes", bytes.len());
        }
    }

    fn row_error(width: usize, bytes: &[u8]) -> &'static str {
        read_scanline(&mut &*bytes, &mut vec![[0; 4]; width]).unwrap_err()
    }

    #[test]
    fn wrong_scanlines_are_refused() {
        assert_eq!(row_error(4, &[1, 1, 1, 3]), "it begins with a run of no texel");
        assert_eq!(row_error(4, &[9, 9, 9, 9, 1, 1, 1, 4]), LONG_RUN);
        assert_eq!(row_error(8, &[2, 2, 0, 9]), "it has another length than the header states");
        assert_eq!(row_error(8, &[2, 2, 0, 8, 128 + 9, 1]), LONG_RUN);
        assert_eq!(row_error(8, &[2, 2, 0, 8, 9]), LONG_RUN);
        assert_eq!(row_error(8, &[2, 2, 0, 8, 128 + 8]), CUT);
        // Markers of no repeats have no end but that of the file, and the weight of the next one does not overflow.
        let zeros = [&[9, 9, 9, 9], &[1, 1, 1, 0].repeat(20)[..]].concat();
        assert_eq!(row_error(4, &zeros), CUT);
        assert_eq!(row_error(4, &[&zeros[..], &[1, 1, 1, 255]].concat()), LONG_RUN);
    }

    #[test]
    fn exponents_are_powers_of_two() {
        for exponent in 1..=255 {
            let expected = (200.0 * 2_f64.powi(i32::from(exponent) - 136)) as f32;
            assert_eq!(radiance_of([200, 0, 0, exponent]), [expected, 0.0, 0.0], "{exponent}");
        }
        assert_eq!(radiance_of([1, 2, 3, 0]), [0.0; 3]);
    }

    #[test]
    fn narrow_scanlines_are_never_compressed_by_channel() {
        let row = [[2, 2, 0, 7]; 7];
        assert_eq!(decoded(&file(7, &[(Coding::Flat, row.to_vec())])).unwrap(), row.map(radiance_of));
    }

    #[test]
    fn headers_are_read_and_refused() {
        let read =
            |text: &str| RadiancePicture::new(text.as_bytes()).map(|picture| [picture.width, picture.height]);
        assert_eq!(read("#?RGBE\r\nFORMAT=32-bit_rle_rgbe\r\n\r\n-Y 2 +X 4\r\n"), Ok([4, 2]));
        assert_eq!(read("#?RADIANCE\n\n-Y 4294967295 +X 4294967295\n"), Ok([u32::MAX; 2]));
        assert_eq!(read("P6 1 1\n"), Err(RadianceError::Signature));
        for text in ["#?RADIANCE", "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n", "#?RADIANCE\n\n-Y 2 +X 4"] {
            assert_eq!(read(text), Err(RadianceError::Header));
        }
        let format = "32-bit_rle_xyze".to_owned();
        assert_eq!(read("#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n"), Err(RadianceError::Format { format }));
        for line in ["+Y 2 +X 4", "-Y 2 +X", "-Y 2 +X 4 5", "-Y -2 +X 4", "-Y 2 +X 4294967296", ""] {
            let expected = RadianceError::SizeLine { line: line.to_owned() };
            assert_eq!(read(&format!("#?RADIANCE\n\n{line}\n")), Err(expected));
        }
    }
}
