//! One measured figure with its limit.

use crate::table::Table;

/// One measured figure with a reference figure and a limit.
pub(super) struct OverheadRow {
    name: String,
    /// The library's figure, in `unit`.
    ours: f64,
    /// The reference figure, in the same unit.
    reference: Option<f64>,
    unit: &'static str,
    limit: Limit,
}

/// Limit of a figure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Limit {
    /// The figure is at most this value.
    AtMost(f64),
    /// The ratio to the reference is at most this value.
    RatioAtMost(f64),
    /// The reference is at least this many times the figure.
    FasterThan(f64),
    /// No limit.
    None,
}

impl OverheadRow {
    /// Creates a row without a reference figure.
    pub(super) fn new(name: impl Into<String>, ours: f64, unit: &'static str, limit: Limit) -> Self {
        Self { name: name.into(), ours, reference: None, unit, limit }
    }

    /// Adds the reference figure.
    pub(super) fn compared_with(self, reference: f64) -> Self {
        Self { reference: Some(reference), ..self }
    }

    fn ratio(&self) -> Option<f64> {
        self.reference.map(|reference| self.ours / reference)
    }

    /// Returns true if the limit is met; `None` without a limit.
    fn is_met(&self) -> Option<bool> {
        match self.limit {
            Limit::AtMost(most) => Some(self.ours <= most),
            Limit::RatioAtMost(most) => self.ratio().map(|ratio| ratio <= most),
            Limit::FasterThan(least) => self.ratio().map(|ratio| ratio.recip() >= least),
            Limit::None => None,
        }
    }

    fn limit_text(&self) -> String {
        match self.limit {
            Limit::AtMost(most) => format!("{most} {}", self.unit),
            Limit::RatioAtMost(most) => format!("{most:.2}x"),
            Limit::FasterThan(least) => format!("1/{least:.0}x"),
            Limit::None => String::new(),
        }
    }

    /// Adds the row to a table with six columns.
    pub(super) fn print(&self, table: &mut Table) {
        let figure = |value: f64| format!("{value:.2} {}", self.unit);
        let kept = self.is_met().map_or("", |kept| if kept { "kept" } else { "MISSED" });
        table.add_row(
            self.name.clone(),
            [
                figure(self.ours),
                self.reference.map(figure).unwrap_or_default(),
                self.ratio().map(|ratio| format!("{ratio:.3}x")).unwrap_or_default(),
                self.limit_text(),
                kept.to_owned(),
            ],
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_figure_equal_to_its_limit_is_met() {
        let row =
            |ours, reference, limit| OverheadRow { reference, ..OverheadRow::new("", ours, "ns", limit) };
        assert_eq!(row(7.0, None, Limit::AtMost(7.0)).is_met(), Some(true));
        assert_eq!(row(7.1, None, Limit::AtMost(7.0)).is_met(), Some(false));
        assert_eq!(row(3.0, Some(2.0), Limit::RatioAtMost(1.25)).is_met(), Some(false));
        assert_eq!(row(1.0, Some(10.0), Limit::FasterThan(10.0)).is_met(), Some(true));
        assert_eq!(row(1.0, Some(9.0), Limit::FasterThan(10.0)).is_met(), Some(false));
        assert_eq!(row(1.0, None, Limit::None).is_met(), None);
    }
}
