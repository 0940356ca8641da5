//! The decision if a series of samples is flat. Pure: no device, no clock.

use std::collections::BTreeMap;

/// Rule for a series.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rule {
    /// Every sample after the warm-up equals the first of them.
    Exact,
    /// The median of the last third is at most this share, in thousandths, above the median of the middle third.
    Slope(i64),
    /// The median of the last third is at most this much above the median of the middle third.
    Rise(i64),
    /// The series is reported only.
    Reported,
}

/// One quantity at every sample.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Series {
    /// Rule of the series.
    pub rule: Rule,
    /// Values, the oldest first.
    pub values: Vec<i64>,
}

impl Series {
    /// Samples that a series has after the warm-up at least, so that each third has two.
    const LEAST: usize = 6;

    /// Returns the medians of the middle and of the last third of the samples after the warm-up. `None` with too few.
    pub fn medians(&self, warm_up: usize) -> Option<[i64; 2]> {
        let values = self.values.get(warm_up..).filter(|values| values.len() >= Self::LEAST)?;
        let third = values.len() / 3;
        Some([median(&values[third..2 * third]), median(&values[2 * third..])])
    }

    /// Checks the samples after the first `warm_up` ones. The error says what has grown.
    pub fn check(&self, warm_up: usize) -> Result<(), String> {
        let values = self.values.get(warm_up..).unwrap_or_default();
        let [middle, last] = self.medians(warm_up).ok_or_else(|| format!("too few samples: {values:?}"))?;
        match self.rule {
            Rule::Exact if values.iter().any(|value| *value != values[0]) => {
                Err(format!("not the same at every sample: {values:?}"))
            }
            Rule::Slope(thousandths) if (last - middle) * 1000 > middle * thousandths => {
                Err(format!("grows from {middle} to {last}, more than {thousandths} thousandths: {values:?}"))
            }
            Rule::Rise(most) if last - middle > most => {
                Err(format!("grows from {middle} to {last}, by more than {most}: {values:?}"))
            }
            _ => Ok(()),
        }
    }
}

fn median(values: &[i64]) -> i64 {
    let mut sorted = values.to_vec();
    sorted.sort_unstable();
    sorted[sorted.len() / 2]
}

/// One quantity at one sample: name, rule and value.
pub type Quantity = (String, Rule, i64);

/// Samples for which a series has memory from the beginning, so that it takes no more while bytes are counted.
const MOST_SAMPLES: usize = 256;

/// All series of a run. A quantity that a sample does not name is 0 there.
#[derive(Debug, Default)]
pub struct Samples {
    count: usize,
    series: BTreeMap<String, Series>,
}

impl Samples {
    /// Adds one sample.
    pub fn add(&mut self, quantities: Vec<Quantity>) {
        for (name, rule, value) in quantities {
            let count = self.count;
            let new = || Series { rule, values: Vec::with_capacity(MOST_SAMPLES) };
            let values = &mut self.series.entry(name).or_insert_with(new).values;
            values.resize(count, 0);
            values.push(value);
        }
        self.count += 1;
        self.series.values_mut().for_each(|series| series.values.resize(self.count, 0));
    }

    /// Returns the number of samples.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Returns every series by name.
    pub fn series(&self) -> &BTreeMap<String, Series> {
        &self.series
    }

    /// Returns the series that are not flat, each as a line with its name.
    pub fn violations(&self, warm_up: usize) -> Vec<String> {
        let check = |(name, series): (&String, &Series)| {
            series.check(warm_up).err().map(|error| format!("{name}: {error}"))
        };
        self.series.iter().filter_map(check).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series(rule: Rule, values: impl IntoIterator<Item = i64>) -> Series {
        Series { rule, values: values.into_iter().collect() }
    }

    #[test]
    fn exact_series_may_change_during_the_warm_up_only() {
        let values = [1, 2, 3, 5, 5, 5, 5, 5, 5, 5];
        assert_eq!(series(Rule::Exact, values).check(3), Ok(()));
        assert!(series(Rule::Exact, values).check(2).is_err());
        for place in 3..10 {
            for step in [1, -1] {
                let mut changed = values;
                changed[place] += step;
                assert!(series(Rule::Exact, changed).check(3).is_err(), "{changed:?}");
            }
        }
        assert_eq!(series(Rule::Reported, 0..20).check(3), Ok(()));
    }

    #[test]
    fn slopes_ignore_noise_and_peaks_but_no_leak() {
        let noisy = |leak: i64| (0..30).map(move |at| 1_000_000 + 5_000 * (at * 7 % 3) + leak * at);
        assert_eq!(series(Rule::Slope(20), noisy(0)).check(3), Ok(()));
        assert_eq!(series(Rule::Slope(20), noisy(-3_000)).check(3), Ok(()));
        assert!(series(Rule::Slope(20), noisy(3_000)).check(3).is_err(), "27 KB from third to third");
        let mut peaks: Vec<_> = noisy(0).collect();
        for peak in [22, 25, 28] {
            peaks[peak] *= 3;
        }
        assert_eq!(series(Rule::Slope(20), peaks).check(3), Ok(()));
        assert_eq!(series(Rule::Rise(16), noisy(1)).check(3), Ok(()));
        assert!(series(Rule::Rise(16), noisy(30)).check(3).is_err());
        let step = (0..30).map(|at| if at < 20 { 100 } else { 103 });
        assert!(series(Rule::Slope(20), step).check(3).is_err());
    }

    #[test]
    fn too_few_samples_are_no_proof() {
        for rule in [Rule::Exact, Rule::Slope(20), Rule::Rise(16), Rule::Reported] {
            for count in 0..9 {
                let check = series(rule, vec![7; count]).check(3);
                assert!(check.unwrap_err().contains("too few"), "{count}");
            }
            assert_eq!(series(rule, vec![7; 9]).check(3), Ok(()));
        }
    }

    #[test]
    fn quantities_that_come_or_go_are_violations() {
        let mut samples = Samples::default();
        for number in 0..12 {
            let mut all = vec![("always".to_owned(), Rule::Exact, 4)];
            if number >= 6 {
                all.push(("late".to_owned(), Rule::Exact, 1));
            }
            if number < 6 {
                all.push(("early".to_owned(), Rule::Exact, 1));
            }
            samples.add(all);
        }
        let violations = samples.violations(2);
        assert_eq!(samples.count(), 12);
        assert_eq!(violations.len(), 2, "{violations:?}");
        assert!(violations[0].starts_with("early: ") && violations[1].starts_with("late: "));
    }
}
