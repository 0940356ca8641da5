//! Times of a frame by both methods, and what many frames come to.

/// Milliseconds of one frame by both methods, or an average of such.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Times {
    /// T: stand-alone ray tracing.
    pub standalone: f64,
    /// t_a: the hybrid method's ray pass.
    pub rays: f64,
    /// t_b: the hybrid method's geometry pass.
    pub geometry: f64,
    /// T as one span, from the first stamp of the frame to the last; 0 where only the passes are known.
    pub standalone_span: f64,
    /// t as one span, as well: with what lies between the passes.
    pub hybrid_span: f64,
}

/// What stands for many frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Statistic {
    /// The mean.
    Average,
    /// The frame that so large a share, 0 to 1, of the others is not slower than, of each method by itself: 0 is the
    /// best frame, 1 the worst, 0.5 the median.
    Quantile(f64),
}

impl Statistic {
    /// The fastest frame.
    pub const BEST: Self = Self::Quantile(0.0);
    /// The slowest frame.
    pub const WORST: Self = Self::Quantile(1.0);
    /// The frame in the middle.
    pub const MEDIAN: Self = Self::Quantile(0.5);
    /// The frame that only one of a hundred is slower than.
    pub const NEARLY_WORST: Self = Self::Quantile(0.99);

    /// Of `frames`; zero where there are none. The passes and the span of the hybrid method are those of one and the
    /// same frame, so that t = t_a + t_b, and so are T and its span.
    #[must_use]
    pub fn of(self, frames: &[Times]) -> Times {
        match self {
            Self::Average => Times::mean(frames),
            Self::Quantile(share) => quantile(frames, share),
        }
    }
}

impl Times {
    /// t = t_a + t_b: the hybrid method.
    #[must_use]
    pub fn hybrid(&self) -> f64 {
        self.rays + self.geometry
    }

    /// t / T: below 1 where the hybrid method is faster.
    #[must_use]
    pub fn ratio(&self) -> f64 {
        self.hybrid() / self.standalone
    }

    /// The same of whole frames, each as one span.
    #[must_use]
    pub fn span_ratio(&self) -> f64 {
        self.hybrid_span / self.standalone_span
    }

    /// What of the hybrid method's frame lies outside its passes.
    #[must_use]
    pub fn outside_passes(&self) -> f64 {
        self.hybrid_span - self.hybrid()
    }

    /// t_a / T.
    #[must_use]
    pub fn ray_ratio(&self) -> f64 {
        self.rays / self.standalone
    }

    /// t_b / T.
    #[must_use]
    pub fn geometry_ratio(&self) -> f64 {
        self.geometry / self.standalone
    }

    /// The mean of each; zero where there are none.
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
    fn the_worst_frame_of_each_method_is_its_own() {
        let worst = Statistic::WORST.of(&frames());
        let spans = |standalone_span, hybrid_span| Times { standalone_span, hybrid_span, ..Times::default() };
        assert_eq!(worst, Times { standalone: 3.0, rays: 0.5, geometry: 4.0, ..spans(3.25, 5.0) });
        let best = Statistic::BEST.of(&frames());
        assert_eq!(best, Times { standalone: 1.0, rays: 1.0, geometry: 1.0, ..spans(1.25, 2.5) });
        assert_eq!(Statistic::MEDIAN.of(&frames()).hybrid(), 2.5);
    }

    #[test]
    fn ratios_are_of_the_averages() {
        let mean = Statistic::Average.of(&frames());
        assert_eq!((mean.standalone, mean.hybrid()), (2.0, 3.0));
        assert_eq!((mean.ratio(), mean.ray_ratio() + mean.geometry_ratio()), (1.5, 1.5));
        assert_eq!((mean.outside_passes(), mean.span_ratio()), (0.5, 3.5 / 2.25));
        assert_eq!(Statistic::Average.of(&[]), Times::default());
        assert_eq!(Statistic::WORST.of(&[]), Times::default());
    }
}
