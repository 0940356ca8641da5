//! Texels from rows of samples, shrunk where they must be.

use super::Picture;
use super::bounds::{self, shrunk_warning};
use super::shrink::Shrink;

/// Takes the rows of an image from the top and makes a [`Picture`] of them.
pub(super) struct ScanlineSink {
    from: [u32; 2],
    to: [u32; 2],
    channels: usize,
    /// `None` where the size stays.
    shrink: Option<Shrink>,
    rgba: Vec<u8>,
}

impl ScanlineSink {
    /// Starts with no row. Each will have `from[0]` texels of `channels` samples: grey, grey and alpha, red, green and blue,
    /// or these with alpha.
    pub(super) fn new(from: [u32; 2], to: [u32; 2], channels: usize) -> Self {
        let shrink = (from != to).then(|| Shrink::new(from, to, channels));
        Self { from, to, channels, shrink, rgba: Vec::with_capacity(4 * bounds::texels(to) as usize) }
    }

    /// Takes the next row, with 8 bits a sample.
    pub(super) fn push(&mut self, samples: &[u8]) {
        let (rgba, channels) = (&mut self.rgba, self.channels);
        match &mut self.shrink {
            None => push_rgba(rgba, samples, channels),
            Some(shrink) => shrink.push(samples, |row| push_rgba(rgba, row, channels)),
        }
    }

    /// Returns the image, after its last row.
    pub(super) fn finish(self) -> Picture {
        let [width, height] = self.to;
        let warnings = shrunk_warning(self.from, self.to).into_iter().collect();
        Picture { width, height, rgba: self.rgba, warnings }
    }
}

fn push_rgba(rgba: &mut Vec<u8>, samples: &[u8], channels: usize) {
    match channels {
        1 => rgba.extend(samples.iter().flat_map(|&grey| [grey, grey, grey, 255])),
        2 => rgba
            .extend(samples.as_chunks::<2>().0.iter().flat_map(|&[grey, alpha]| [grey, grey, grey, alpha])),
        3 => rgba.extend(
            samples.as_chunks::<3>().0.iter().flat_map(|&[red, green, blue]| [red, green, blue, 255]),
        ),
        _ => rgba.extend_from_slice(samples),
    }
}

/// Appends the nearest 8 bits to samples of 16.
pub(super) fn eight_bits(eight: &mut Vec<u8>, sixteen: impl Iterator<Item = u16>) {
    eight.extend(sixteen.map(|sample| ((u32::from(sample) + 128) / 257) as u8));
}
