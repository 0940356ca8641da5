//! One cost against one size.

use super::fit;
use crate::peers::format_time;

/// Costs whose exponent is smaller than this, up or down, count as constant. A cost that falls more shares a fixed part.
pub(super) const MOST_CONSTANT: f64 = 0.1;

/// The costs of one operation at several sizes.
#[derive(Debug, Clone)]
pub(super) struct Curve {
    pub(super) name: String,
    pub(super) unit: Unit,
    pub(super) expected: Expected,
    /// Pairs of size and cost, by rising size.
    pub(super) points: Vec<(f64, f64)>,
}

/// What costs are measured in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Unit {
    Milliseconds,
    BytesPerTriangle,
    /// Times the data that stay.
    Times,
    /// A number of objects.
    Count,
}

/// How a cost should grow.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Expected {
    Constant,
    /// Growth with the work: the reason.
    Grows(&'static str),
}

impl Unit {
    /// Returns the word behind the group's name in the name of the plot; none for times.
    pub(super) const fn file_suffix(self) -> &'static str {
        match self {
            Self::Milliseconds => "",
            Self::BytesPerTriangle => "_bytes",
            Self::Times => "_times",
            Self::Count => "_count",
        }
    }

    /// Returns the label of the axis.
    pub(super) const fn axis(self) -> &'static str {
        match self {
            Self::Milliseconds => "time",
            Self::BytesPerTriangle => "bytes a triangle",
            Self::Times => "times the final data",
            Self::Count => "number",
        }
    }

    fn format(self, cost: f64) -> String {
        match self {
            _ if !cost.is_finite() => "-".to_owned(),
            Self::Milliseconds => format_time(cost),
            Self::BytesPerTriangle => format!("{cost:.1} B"),
            Self::Times => format!("{cost:.2}x"),
            Self::Count => format!("{cost:.0}"),
        }
    }
}

impl Curve {
    /// Creates a curve without points.
    pub(super) fn new(name: impl Into<String>, unit: Unit, expected: Expected) -> Self {
        Self { name: name.into(), unit, expected, points: Vec::new() }
    }

    /// Adds the cost of the next larger size.
    pub(super) fn push(&mut self, size: u64, cost: f64) {
        self.points.push((size as f64, cost));
    }

    /// Returns the fitted exponent; see [`fit::exponent`].
    pub(super) fn exponent(&self) -> Option<f64> {
        fit::exponent(&self.points)
    }

    /// True if a cost that should be constant grows.
    pub(super) fn is_violated(&self) -> bool {
        self.expected == Expected::Constant && self.exponent().is_some_and(|e| e >= MOST_CONSTANT)
    }

    /// Returns the cells of its row: a cost for each of `sizes`, the exponent, and whether it is constant.
    pub(super) fn cells(&self, sizes: &[u64]) -> Vec<String> {
        let cost = |size: &u64| self.points.iter().find(|point| point.0 == *size as f64);
        let costs =
            sizes.iter().map(|size| cost(size).map_or("-".to_owned(), |point| self.unit.format(point.1)));
        let exponent = self.exponent();
        let verdict = match exponent {
            None => "-",
            Some(exponent) if exponent.abs() < MOST_CONSTANT => "yes",
            Some(exponent) if exponent < 0.0 => "falls",
            Some(_) => "no",
        };
        let reason = match self.expected {
            Expected::Constant => "",
            Expected::Grows(reason) => reason,
        };
        let exponent = exponent.map_or("-".to_owned(), |exponent| format!("{exponent:.2}"));
        costs.chain([exponent, verdict.to_owned(), reason.to_owned()]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(expected: Expected, cost: fn(f64) -> f64) -> Curve {
        let mut curve = Curve::new("a", Unit::Milliseconds, expected);
        [1, 10, 100, 1000].into_iter().for_each(|size| curve.push(size, cost(size as f64)));
        curve
    }

    #[test]
    fn only_a_cost_that_should_be_constant_is_violated() {
        let grows = Expected::Grows("work");
        assert!(!curve(Expected::Constant, |_| 3.0).is_violated());
        assert!(curve(Expected::Constant, |size| size).is_violated());
        assert!(!curve(Expected::Constant, |size| size.powf(-0.2)).is_violated());
        assert!(!curve(grows, |size| size).is_violated());
    }

    #[test]
    fn a_row_has_a_cell_for_each_size_and_says_what_is_constant() {
        let constant = curve(Expected::Constant, |_| 3.0).cells(&[1, 7, 100]);
        assert_eq!(constant, ["3.00 ms", "-", "3.00 ms", "0.00", "yes", ""]);
        let linear = curve(Expected::Grows("all are copied"), |size| size).cells(&[10]);
        assert_eq!(linear, ["10.0 ms", "1.00", "no", "all are copied"]);
        let shared = curve(Expected::Constant, |size| 10.0 / size).cells(&[10]);
        assert_eq!(shared, ["1.00 ms", "-1.00", "falls", ""]);
        assert_eq!(Curve::new("b", Unit::Count, Expected::Constant).cells(&[1]), ["-", "-", "-", ""]);
    }
}
