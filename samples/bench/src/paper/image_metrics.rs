//! Image metrics between frames of two renderers.

use super::error::PaperError;
use lvk_samples::app::metrics::{Difference, SizeError, compare};

/// Image metrics between the same frames of two renderers, as in the paper's Table 2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImageMetrics {
    /// Peak signal-to-noise ratio in dB of the mean square error over all frames; infinite for equal images.
    pub psnr: f64,
    /// The lowest PSNR of a single frame in dB.
    pub lowest_psnr: f64,
    /// Mean structural similarity.
    pub ssim: f64,
    /// Share of pixels, 0 to 1, that differ by more than 1 of 255.
    pub differing_share: f64,
}

impl ImageMetrics {
    /// Compares pairs of images with 4 bytes per pixel, each pair on its own thread.
    pub(super) fn compare_pairs(
        pairs: &[[Vec<u8>; 2]],
        [width, height]: [u32; 2],
    ) -> Result<Self, PaperError> {
        let compared: Result<Vec<Difference>, SizeError> = std::thread::scope(|scope| {
            let work = |[first, second]: &'_ [Vec<u8>; 2]| compare(first, second, width, height);
            let threads: Vec<_> = pairs.iter().map(|pair| (pair, scope.spawn(move || work(pair)))).collect();
            threads.into_iter().map(|(pair, thread)| thread.join().unwrap_or_else(|_| work(pair))).collect()
        });
        Ok(Self::from_frames(&compared?))
    }

    /// Averages the metrics of several cameras. Averages squared errors, not decibels.
    pub(super) fn mean(cells: &[Self]) -> Self {
        let mean =
            |number: &dyn Fn(&Self) -> f64| cells.iter().map(number).sum::<f64>() / cells.len().max(1) as f64;
        Self {
            psnr: -10.0 * mean(&|cell| 10.0_f64.powf(-0.1 * cell.psnr)).log10(),
            lowest_psnr: cells.iter().map(|cell| cell.lowest_psnr).fold(f64::INFINITY, f64::min),
            ssim: mean(&|cell| cell.ssim),
            differing_share: mean(&|cell| cell.differing_share),
        }
    }

    fn from_frames(frames: &[Difference]) -> Self {
        let mean = |number: &dyn Fn(&Difference) -> f64| {
            frames.iter().map(number).sum::<f64>() / frames.len().max(1) as f64
        };
        let error = mean(&|frame| 10.0_f64.powf(-0.1 * frame.psnr));
        Self {
            psnr: -10.0 * error.log10(),
            lowest_psnr: frames.iter().map(|frame| frame.psnr).fold(f64::INFINITY, f64::min),
            ssim: mean(&|frame| frame.ssim),
            differing_share: mean(&|frame| frame.differing_share),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_frames_do_not_hide_different_ones() {
        let flat = |level: u8| vec![level; 12 * 12 * 4];
        let pairs = [[flat(100), flat(100)], [flat(100), flat(110)]];
        let metrics = ImageMetrics::compare_pairs(&pairs, [12, 12]).unwrap();
        let single = 20.0 * 25.5_f64.log10();
        assert!((metrics.lowest_psnr - single).abs() < 1e-9, "{metrics:?}");
        assert!((metrics.psnr - single - 10.0 * 2.0_f64.log10()).abs() < 1e-9, "{metrics:?}");
        assert_eq!(metrics.differing_share, 0.5);
        let same = ImageMetrics::compare_pairs(&pairs[..1], [12, 12]).unwrap();
        assert_eq!((same.psnr, same.lowest_psnr, same.differing_share), (f64::INFINITY, f64::INFINITY, 0.0));
        assert!(ImageMetrics::compare_pairs(&pairs, [13, 12]).is_err());
        let other = ImageMetrics::compare_pairs(&pairs[1..], [12, 12]).unwrap();
        assert_eq!(ImageMetrics::mean(&[same, other]), metrics, "an equal camera counts as no error");
    }
}
