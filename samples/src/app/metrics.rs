//! Image metrics: the difference of two images.

/// The difference of two images.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Difference {
    /// Peak signal-to-noise ratio over the red, green and blue channels, in dB; infinite for equal pictures.
    pub psnr: f64,
    /// Mean structural similarity of the luma (Wang et al. 2004, Gaussian window of 11 x 11), at most 1.
    pub ssim: f64,
    /// Share of pixels, 0 to 1, that differ by more than 1 of 255 in red, green or blue.
    pub differing_share: f64,
    /// Largest difference of a channel, 0 to 255.
    pub max_difference: u8,
}

/// Reason that two images cannot be compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("{what} holds {bytes} bytes; {width} x {height} pixels need 3 or 4 bytes each")]
pub struct SizeError {
    what: &'static str,
    bytes: usize,
    width: u32,
    height: u32,
}

/// Compares two pictures of `width` x `height` pixels of 8 bits a channel, RGB or RGBA each (told by the number
/// of bytes). Alpha does not count.
///
/// # Errors
/// [`SizeError`] when a buffer is not one of a picture of that size, or there are no pixels.
pub fn compare(first: &[u8], second: &[u8], width: u32, height: u32) -> Result<Difference, SizeError> {
    let first = Picture::new("the first picture", first, width, height)?;
    let second = Picture::new("the second picture", second, width, height)?;
    let (mut squares, mut differing, mut largest) = (0u64, 0u64, 0u8);
    for (a, b) in first.pixels().zip(second.pixels()) {
        let [r, g, b] = [0, 1, 2].map(|i| a[i].abs_diff(b[i]));
        squares += [r, g, b].iter().map(|&d| u64::from(d) * u64::from(d)).sum::<u64>();
        let worst = r.max(g).max(b);
        differing += u64::from(worst > 1);
        largest = largest.max(worst);
    }
    let pixel_count = f64::from(width) * f64::from(height);
    let mean_square = squares as f64 / (3.0 * pixel_count);
    Ok(Difference {
        psnr: 10.0 * (255.0 * 255.0 / mean_square).log10(),
        ssim: ssim(&first.luma(), &second.luma(), width as usize, height as usize),
        differing_share: differing as f64 / pixel_count,
        max_difference: largest,
    })
}

impl std::fmt::Display for Difference {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { psnr, ssim, differing_share, max_difference } = self;
        let percent = 100.0 * differing_share;
        write!(
            f,
            "PSNR {psnr:.2} dB, SSIM {ssim:.5}, {percent:.4} % of pixels differ by more than 1/255, at most by \
             {max_difference}/255"
        )
    }
}

struct Picture<'a> {
    bytes: &'a [u8],
    channels: usize,
}

impl<'a> Picture<'a> {
    fn new(what: &'static str, bytes: &'a [u8], width: u32, height: u32) -> Result<Self, SizeError> {
        let pixel_count = u64::from(width) * u64::from(height);
        let wrong = SizeError { what, bytes: bytes.len(), width, height };
        match (bytes.len() as u64).checked_div(pixel_count) {
            Some(channels @ 3..=4) if bytes.len() as u64 == pixel_count * channels => {
                Ok(Self { bytes, channels: channels as usize })
            }
            _ => Err(wrong),
        }
    }

    fn pixels(&self) -> impl Iterator<Item = &[u8]> {
        self.bytes.chunks_exact(self.channels)
    }

    /// Luma by Rec. 601, 0 to 255, of the encoded channels.
    fn luma(&self) -> Vec<f64> {
        let weigh = |p: &[u8]| 0.299 * f64::from(p[0]) + 0.587 * f64::from(p[1]) + 0.114 * f64::from(p[2]);
        self.pixels().map(weigh).collect()
    }
}

/// Rows and columns of the window.
const WINDOW: usize = 11;

/// Mean structural similarity of two grey pictures with values from 0 to 255, by Wang, Bovik, Sheikh and
/// Simoncelli, "Image quality assessment: from error visibility to structural similarity" (2004): windows of 11 x 11
/// weighted by a Gaussian of standard deviation 1.5, K1 = 0.01, K2 = 0.03, over all windows inside the picture.
/// Pictures smaller than the window use the part of the window that fits.
fn ssim(first: &[f64], second: &[f64], width: usize, height: usize) -> f64 {
    const C1: f64 = (0.01 * 255.0) * (0.01 * 255.0);
    const C2: f64 = (0.03 * 255.0) * (0.03 * 255.0);
    let blurred = |values: Vec<f64>| blur(&values, width, height);
    let product = |a: &[f64], b: &[f64]| blurred(a.iter().zip(b).map(|(x, y)| x * y).collect());
    let (mean_1, mean_2) = (blurred(first.to_vec()), blurred(second.to_vec()));
    let (square_1, square_2) = (product(first, first), product(second, second));
    let cross = product(first, second);
    let at = |i: usize| {
        let (m1, m2) = (mean_1[i], mean_2[i]);
        let (variance_1, variance_2) = (square_1[i] - m1 * m1, square_2[i] - m2 * m2);
        let covariance = cross[i] - m1 * m2;
        (2.0 * m1 * m2 + C1) * (2.0 * covariance + C2)
            / ((m1 * m1 + m2 * m2 + C1) * (variance_1 + variance_2 + C2))
    };
    (0..mean_1.len()).map(at).sum::<f64>() / mean_1.len() as f64
}

/// Weighted means over all windows that lie inside the picture.
fn blur(values: &[f64], width: usize, height: usize) -> Vec<f64> {
    let (across, down) = (kernel(width.min(WINDOW)), kernel(height.min(WINDOW)));
    let columns = width - across.len() + 1;
    let mut rows = Vec::with_capacity(columns * height);
    for row in values.chunks_exact(width) {
        rows.extend(row.windows(across.len()).map(|window| weighted(window.iter(), &across)));
    }
    let mut means = Vec::with_capacity(columns * (height - down.len() + 1));
    for top in 0..=height - down.len() {
        means
            .extend((0..columns).map(|x| weighted(rows[top * columns + x..].iter().step_by(columns), &down)));
    }
    means
}

fn weighted<'a>(values: impl Iterator<Item = &'a f64>, weights: &[f64]) -> f64 {
    values.zip(weights).map(|(value, weight)| value * weight).sum()
}

/// A Gaussian of standard deviation 1.5 at `size` points around its middle, with sum 1.
fn kernel(size: usize) -> Vec<f64> {
    let middle = (size as f64 - 1.0) / 2.0;
    let weights: Vec<f64> =
        (0..size).map(|i| (-(i as f64 - middle).powi(2) / (2.0 * 1.5 * 1.5)).exp()).collect();
    let sum: f64 = weights.iter().sum();
    weights.into_iter().map(|weight| weight / sum).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn equal_pictures_do_not_differ() {
        let picture: Vec<u8> = (0..16 * 12 * 3).map(|i| (i * 7 % 256) as u8).collect();
        let found = compare(&picture, &picture, 16, 12).unwrap();
        assert_eq!((found.psnr, found.differing_share, found.max_difference), (f64::INFINITY, 0.0, 0));
        assert!((found.ssim - 1.0).abs() < 1e-12);
    }

    #[test]
    fn psnr_is_that_of_the_textbook() {
        let black = [0u8; 4 * 3];
        let found = compare(&black, &[255; 4 * 3], 2, 2).unwrap();
        assert!(found.psnr.abs() < 1e-12, "peak noise is 0 dB: {}", found.psnr);
        let mut one = black;
        one[4] = 10;
        // Mean square 100 / 12; 10 log10(65025 / (100 / 12)) = 38.92262
        let found = compare(&black, &one, 2, 2).unwrap();
        assert!((found.psnr - 38.922_62).abs() < 1e-4, "{}", found.psnr);
        assert_eq!((found.differing_share, found.max_difference), (0.25, 10));
    }

    #[test]
    fn ssim_of_flat_pictures_is_the_luminance_term() {
        let (a, b) = (vec![100u8; 20 * 20 * 3], vec![150u8; 20 * 20 * 3]);
        let found = compare(&a, &b, 20, 20).unwrap();
        // (2 * 100 * 150 + 6.5025) / (100^2 + 150^2 + 6.5025)
        assert!((found.ssim - 30_006.502_5 / 32_506.502_5).abs() < 1e-9, "{}", found.ssim);
    }

    #[test]
    fn ssim_of_opposite_checks_is_negative() {
        let check = |phase: usize| -> Vec<u8> {
            (0..16 * 16).flat_map(|i| [if (i % 16 + i / 16) % 2 == phase { 255 } else { 0 }; 3]).collect()
        };
        let found = compare(&check(0), &check(1), 16, 16).unwrap();
        assert!(found.ssim < -0.9, "{}", found.ssim);
        assert_eq!(found.differing_share, 1.0);
    }

    #[test]
    fn a_difference_of_one_and_alpha_do_not_count_as_differing() {
        let found = compare(&[10, 10, 10, 0], &[11, 9, 10, 255], 1, 1).unwrap();
        assert_eq!((found.differing_share, found.max_difference), (0.0, 1));
        let mixed = compare(&[10, 10, 10], &[10, 10, 10, 255], 1, 1).unwrap();
        assert_eq!(mixed.max_difference, 0);
    }

    #[test]
    fn wrong_sizes_are_refused() {
        assert!(compare(&[0; 5], &[0; 3], 1, 1).is_err());
        assert!(compare(&[0; 3], &[0; 2], 1, 1).is_err());
        assert!(compare(&[], &[], 0, 0).is_err());
        assert!(compare(&[0; 7], &[0; 7], 2, 1).is_err());
    }

    proptest! {
        #[test]
        fn measures_are_symmetric_and_in_range(
            (width, height) in (1u32..16, 1u32..16),
            seed in any::<u32>(),
        ) {
            let picture = |salt: u32| -> Vec<u8> {
                (0..width * height * 3)
                    .map(|i| (i.wrapping_mul(seed | 1).wrapping_add(salt).wrapping_mul(2_654_435_761) >> 24) as u8)
                    .collect()
            };
            let (a, b) = (picture(1), picture(77));
            let forth = compare(&a, &b, width, height).unwrap();
            let back = compare(&b, &a, width, height).unwrap();
            prop_assert_eq!(forth.psnr, back.psnr);
            prop_assert!((forth.ssim - back.ssim).abs() < 1e-12);
            prop_assert!(forth.ssim <= 1.0 + 1e-12 && forth.ssim >= -1.0);
            prop_assert!((0.0..=1.0).contains(&forth.differing_share));
        }
    }
}
