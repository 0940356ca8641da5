//! Medians and spreads of samples.

/// The median and the interquartile range of numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Spread {
    pub(super) median: f64,
    pub(super) low: f64,
    pub(super) high: f64,
}

impl Spread {
    /// Returns the spread of at least one number, else `None`.
    pub(super) fn of_samples(mut numbers: Vec<f64>) -> Option<Self> {
        numbers.sort_by(f64::total_cmp);
        let last = numbers.len().checked_sub(1)?;
        let at = |share: f64| {
            let place = share * last as f64;
            let (below, part) = (place.floor() as usize, place.fract());
            numbers[below] + part * (numbers[(below + 1).min(last)] - numbers[below])
        };
        Some(Self { median: at(0.5), low: at(0.25), high: at(0.75) })
    }

    /// Returns the spread of the ratios of numbers that were measured in the same rounds.
    pub(super) fn of_ratios(ours: &[f64], reference: &[f64]) -> Option<Self> {
        let ratios = ours.iter().zip(reference).map(|(ours, reference)| ours / reference);
        Self::of_samples(ratios.filter(|ratio| ratio.is_finite()).collect())
    }
}

/// Formats milliseconds with three digits, in a unit that fits.
pub(crate) fn format_time(milliseconds: f64) -> String {
    let (value, unit) = match milliseconds {
        ms if ms >= 1e4 => (ms * 1e-3, "s"),
        ms if ms >= 1.0 => (ms, "ms"),
        ms if ms >= 1e-3 => (ms * 1e3, "us"),
        ms => (ms * 1e6, "ns"),
    };
    let digits = match value {
        value if value >= 100.0 => 0,
        value if value >= 10.0 => 1,
        _ => 2,
    };
    format!("{value:.digits$} {unit}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_spread_is_that_of_the_middle_half() {
        let spread = Spread::of_samples(vec![5.0, 1.0, 2.0, 4.0, 3.0]).unwrap();
        assert_eq!(spread, Spread { median: 3.0, low: 2.0, high: 4.0 });
        let even = Spread::of_samples(vec![1.0, 2.0]).unwrap();
        assert_eq!(even, Spread { median: 1.5, low: 1.25, high: 1.75 });
        assert_eq!(Spread::of_samples(Vec::new()), None);
    }

    #[test]
    fn ratios_are_those_of_the_same_round() {
        let spread = Spread::of_ratios(&[2.0, 40.0, 3.0], &[1.0, 20.0, 0.0]).unwrap();
        assert_eq!(spread, Spread { median: 2.0, low: 2.0, high: 2.0 });
    }

    #[test]
    fn times_have_a_unit_that_fits() {
        let times = [12_345.0, 150.04, 12.34, 0.5, 0.000_32].map(format_time);
        assert_eq!(times, ["12.3 s", "150 ms", "12.3 ms", "500 us", "320 ns"]);
    }
}
