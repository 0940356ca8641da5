//! How often a cost is measured.

use std::time::{Duration, Instant};

use crate::error::BenchError;
use crate::measure::median_of;

/// Number of samples of each cost.
#[derive(Debug, Clone, Copy)]
pub(super) struct Effort {
    /// Most samples, unless they are over in less than a fifth of a second.
    pub(super) runs: u32,
    /// True for a smoke test: tiny sizes.
    pub(super) quick: bool,
}

impl Effort {
    /// Time after which a cost is measured no more often than [`LEAST`](Self::LEAST).
    const PATIENCE: Duration = Duration::from_millis(1_500);
    /// Least time of all samples of a short cost, so that other programs, which take turns of milliseconds, delay few of them.
    const LEAST_TIME: Duration = Duration::from_millis(200);
    /// Fewest samples of a cost that takes long.
    const LEAST: u32 = 3;

    /// Returns the median of what `sample` returns, called after one call that does not count. A long cost has fewer
    /// samples, and one of several seconds a single one, whose first call counts.
    pub(super) fn median(
        &self,
        mut sample: impl FnMut() -> Result<f64, BenchError>,
    ) -> Result<f64, BenchError> {
        let start = Instant::now();
        let first = sample()?;
        if start.elapsed() > Self::PATIENCE {
            return Ok(first);
        }
        let mut samples = Vec::new();
        let is_short = |start: Instant| !self.quick && start.elapsed() < Self::LEAST_TIME;
        while (samples.len() as u32) < self.runs || is_short(start) {
            samples.push(sample()?);
            if start.elapsed() > Self::PATIENCE && samples.len() as u32 >= Self::LEAST.min(self.runs) {
                break;
            }
        }
        Ok(median_of(&samples, |sample| *sample))
    }
}

/// Returns those of all samples of [`Effort::median`] that count: not the first, unless it is the only one.
pub(super) fn counted<T>(samples: &[T]) -> &[T] {
    if samples.len() > 1 { &samples[1..] } else { samples }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_sample_of_a_short_cost_does_not_count() {
        let mut samples = [9.0, 3.0, 1.0, 2.0, 99.0].into_iter();
        let effort = Effort { runs: 3, quick: true };
        assert_eq!(effort.median(|| Ok(samples.next().unwrap())).unwrap(), 2.0);
        assert_eq!(samples.collect::<Vec<_>>(), [99.0]);
    }
}
