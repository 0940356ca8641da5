//! Times of a frame by both methods, and statistics over many frames.

/// Milliseconds of one frame by both methods, or an average over frames.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Times {
    /// T: stand-alone ray tracing.
    pub standalone: f64,
    /// t_a: the hybrid method's ray pass.
    pub rays: f64,
    /// t_b: the hybrid method's geometry pass.
    pub geometry: f64,
    /// T as one span, from the first timestamp of the frame to the last; 0 if only the passes are known.
    pub standalone_span: f64,
    /// t as one span, with the barriers between the passes.
    pub hybrid_span: f64,
}

/// A statistic over frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Statistic {
    /// The mean.
    Average,
    /// The quantile, 0 to 1, of the frame times of each method: 0 is the best frame, 1 the worst, 0.5 the median.
    Quantile(f64),
}

impl Statistic {
    /// The fastest frame.
    pub const BEST: Self = Self::Quantile(0.0);
    /// The slowest frame.
    pub const WORST: Self = Self::Quantile(1.0);
    /// The median frame.
    pub const MEDIAN: Self = Self::Quantile(0.5);
    /// The 99th percentile.
    pub const PERCENTILE_99: Self = Self::Quantile(0.99);

    /// Evaluates the statistic over `frames`; zero for no frames. The passes and the span of the hybrid method belong to the
    /// same frame, so that t = t_a + t_b. T and its span belong to the same frame.
    #[must_use]
    pub fn evaluate(self, frames: &[Times]) -> Times {
        match self {
            Self::Average => Times::mean(frames),
            Self::Quantile(share) => quantile(frames, share),
        }
    }
}

impl Times {
    /// Returns t = t_a + t_b, the time of the hybrid method.
    #[must_use]
    pub fn hybrid(&self) -> f64 {
        self.rays + self.geometry
    }

    /// Returns t / T: below 1 if the hybrid method is faster.
    #[must_use]
    pub fn ratio(&self) -> f64 {
        self.hybrid() / self.standalone
    }

    /// Returns the ratio of the spans of whole frames.
    #[must_use]
    pub fn span_ratio(&self) -> f64 {
        self.hybrid_span / self.standalone_span
    }

    /// Returns the time of the hybrid method's frame outside its passes.
    #[must_use]
    pub fn outside_passes(&self) -> f64 {
        self.hybrid_span - self.hybrid()
    }

    /// Returns t_a / T.
    #[must_use]
    pub fn ray_ratio(&self) -> f64 {
        self.rays / self.standalone
    }

    /// Returns t_b / T.
    #[must_use]
    pub fn geometry_ratio(&self) -> f64 {
        self.geometry / self.standalone
    }

    /// Returns the mean of each time; zero for no frames.
    #[must_use]
    pub fn mean(all: &[Self]) -> Self {
        let mean = |number: fn(&Self) -> f64| all.iter().map(number).sum::<f64>() / all.len().max(1) as f64;
        Self {
            standalone: mean(|times| times.standalone),
            rays: mean(|times| times.rays),
            geometry: mean(|times| times.geometry),
            standalone_span: mean(|times| times.standalone_span),
            hybrid_span: mean(|times| times.hybrid_span),
        }
    }
}

fn quantile(frames: &[Times], share: f64) -> Times {
    let place = (share.clamp(0.0, 1.0) * frames.len().saturating_sub(1) as f64).round() as usize;
    let sorted = |key: fn(&Times) -> f64| {
        let mut frames = frames.to_vec();
        frames.sort_by(|a, b| key(a).total_cmp(&key(b)));
        frames.get(place).copied().unwrap_or_default()
    };
    let Times { standalone, standalone_span, .. } = sorted(|times| times.standalone);
    Times { standalone, standalone_span, ..sorted(Times::hybrid) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frames() -> Vec<Times> {
        [(3.0, 1.0, 1.0), (1.0, 2.0, 0.5), (2.0, 0.5, 4.0)]
            .map(|(standalone, rays, geometry)| {
                let (standalone_span, hybrid_span) = (standalone + 0.25, rays + geometry + 0.5);
                Times { standalone, rays, geometry, standalone_span, hybrid_span }
            })
            .to_vec()
    }

    #[test]
    fn the_worst_frame_is_selected_per_method() {
        let worst = Statistic::WORST.evaluate(&frames());
        let spans = |standalone_span, hybrid_span| Times { standalone_span, hybrid_span, ..Times::default() };
        assert_eq!(worst, Times { standalone: 3.0, rays: 0.5, geometry: 4.0, ..spans(3.25, 5.0) });
        let best = Statistic::BEST.evaluate(&frames());
        assert_eq!(best, Times { standalone: 1.0, rays: 1.0, geometry: 1.0, ..spans(1.25, 2.5) });
        assert_eq!(Statistic::MEDIAN.evaluate(&frames()).hybrid(), 2.5);
    }

    #[test]
    fn ratios_are_of_the_averages() {
        let mean = Statistic::Average.evaluate(&frames());
        assert_eq!((mean.standalone, mean.hybrid()), (2.0, 3.0));
        assert_eq!((mean.ratio(), mean.ray_ratio() + mean.geometry_ratio()), (1.5, 1.5));
        assert_eq!((mean.outside_passes(), mean.span_ratio()), (0.5, 3.5 / 2.25));
        assert_eq!(Statistic::Average.evaluate(&[]), Times::default());
        assert_eq!(Statistic::WORST.evaluate(&[]), Times::default());
    }
}
