//! GPU milliseconds per pass over many frames, as a table.

use std::fmt;

/// GPU milliseconds per pass over many frames; displayed as an aligned table of minimum, median and maximum.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Timings {
    passes: Vec<Pass>,
}

#[derive(Debug, Clone, PartialEq)]
struct Pass {
    name: String,
    samples: Vec<PassSample>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct PassSample {
    frame: u64,
    milliseconds: f64,
}

/// The time of a pass, in milliseconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spread {
    /// Fastest frame.
    pub min: f64,
    /// Middle frame; the mean of the two middle ones when their number is even.
    pub median: f64,
    /// Slowest frame.
    pub max: f64,
}

impl Timings {
    /// An empty table.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds what `pass` took in `frame`. Passes are listed in the order of their first appearance; a pass that
    /// runs several times in a frame counts with its sum. Times that are negative or not finite are ignored.
    pub fn push(&mut self, frame: u64, pass: &str, milliseconds: f64) {
        if !(milliseconds >= 0.0 && milliseconds.is_finite()) {
            return;
        }
        let index = self.passes.iter().position(|known| known.name == pass).unwrap_or_else(|| {
            self.passes.push(Pass { name: pass.to_owned(), samples: Vec::new() });
            self.passes.len() - 1
        });
        let samples = &mut self.passes[index].samples;
        match samples.iter_mut().rev().find(|sample| sample.frame == frame) {
            Some(sample) => sample.milliseconds += milliseconds,
            None => samples.push(PassSample { frame, milliseconds }),
        }
    }

    /// Names of the passes, in the order of their first appearance.
    pub fn passes(&self) -> impl Iterator<Item = &str> {
        self.passes.iter().map(|pass| pass.name.as_str())
    }

    /// Returns the time of `pass`; `None` for a pass that was never pushed.
    pub fn spread(&self, pass: &str) -> Option<Spread> {
        let pass = self.passes.iter().find(|known| known.name == pass)?;
        spread(pass.samples.iter().map(|sample| sample.milliseconds).collect())
    }

    /// Returns the time of whole frames: the spread of the sums over all passes of a frame.
    pub fn total(&self) -> Option<Spread> {
        let mut sums = std::collections::BTreeMap::new();
        for sample in self.passes.iter().flat_map(|pass| &pass.samples) {
            *sums.entry(sample.frame).or_insert(0.0) += sample.milliseconds;
        }
        spread(sums.into_values().collect())
    }

    fn rows(&self) -> Vec<(&str, Spread)> {
        let passes =
            self.passes.iter().filter_map(|pass| Some((pass.name.as_str(), self.spread(&pass.name)?)));
        passes.chain(self.total().map(|total| ("total", total))).collect()
    }
}

impl fmt::Display for Timings {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let rows = self.rows();
        let width = rows.iter().map(|(name, _)| name.chars().count()).fold("GPU ms".len(), usize::max);
        write!(f, "{:width$}  {:>10}  {:>10}  {:>10}", "GPU ms", "min", "median", "max")?;
        for (name, Spread { min, median, max }) in rows {
            write!(f, "\n{name:width$}  {min:>10.3}  {median:>10.3}  {max:>10.3}")?;
        }
        Ok(())
    }
}

/// Returns the minimum, median and maximum of the values; `None` for no values.
#[must_use]
pub fn spread(mut values: Vec<f64>) -> Option<Spread> {
    values.sort_unstable_by(f64::total_cmp);
    let (&min, &max) = (values.first()?, values.last()?);
    let middle = values.len() / 2;
    let median = match values.len() % 2 {
        0 => 0.5 * (values[middle - 1] + values[middle]),
        _ => values[middle],
    };
    Some(Spread { min, median, max })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn filled() -> Timings {
        let mut timings = Timings::new();
        for (frame, ms) in [(0, 4.0), (1, 1.0), (2, 3.0), (3, 2.0)] {
            timings.push(frame, "g-buffer", ms);
            timings.push(frame, "trace", 10.0);
        }
        timings
    }

    #[test]
    fn spreads_are_of_the_right_frames() {
        let timings = filled();
        assert_eq!(timings.spread("g-buffer"), Some(Spread { min: 1.0, median: 2.5, max: 4.0 }));
        assert_eq!(timings.total(), Some(Spread { min: 11.0, median: 12.5, max: 14.0 }));
        assert_eq!(timings.spread("absent"), None);
        assert_eq!(Timings::new().total(), None);
    }

    #[test]
    fn a_pass_that_runs_twice_in_a_frame_counts_with_its_sum() {
        let mut timings = filled();
        timings.push(1, "trace", 5.0);
        timings.push(1, "trace", f64::NAN);
        timings.push(1, "trace", -1.0);
        assert_eq!(timings.spread("trace"), Some(Spread { min: 10.0, median: 10.0, max: 15.0 }));
    }

    #[test]
    fn the_table_is_aligned_and_ends_with_the_total() {
        let text = filled().to_string();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[0], "GPU ms           min      median         max");
        assert_eq!(lines[1], "g-buffer       1.000       2.500       4.000");
        assert_eq!(lines[3], "total         11.000      12.500      14.000");
        assert!(lines.iter().all(|line| line.len() == lines[0].len()));
    }
}
