//! A figure with its limit.

use crate::table::Table;

/// One measured figure, beside what it is compared with and what it should be at most.
pub(super) struct Row {
    pub(super) what: String,
    /// The library's figure, in `unit`.
    pub(super) ours: f64,
    /// What it is compared with, in the same unit.
    pub(super) other: Option<f64>,
    pub(super) unit: &'static str,
    pub(super) limit: Limit,
}

/// What a figure should be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Limit {
    /// At most so many units.
    Most(f64),
    /// At most so many times the other.
    Ratio(f64),
    /// The other takes at least so many times as long.
    Faster(f64),
    /// Nobody has asked for one.
    None,
}

impl Row {
    fn ratio(&self) -> Option<f64> {
        self.other.map(|other| self.ours / other)
    }

    /// Whether the limit is kept; `None` without one.
    fn is_kept(&self) -> Option<bool> {
        match self.limit {
            Limit::Most(most) => Some(self.ours <= most),
            Limit::Ratio(most) => self.ratio().map(|ratio| ratio <= most),
            Limit::Faster(least) => self.ratio().map(|ratio| ratio.recip() >= least),
            Limit::None => None,
        }
    }

    fn limit_text(&self) -> String {
        match self.limit {
            Limit::Most(most) => format!("{most} {}", self.unit),
            Limit::Ratio(most) => format!("{most:.2}x"),
            Limit::Faster(least) => format!("1/{least:.0}x"),
            Limit::None => String::new(),
        }
    }

    /// Adds the row to a table of six columns.
    pub(super) fn print(&self, table: &mut Table) {
        let figure = |value: f64| format!("{value:.2} {}", self.unit);
        let kept = self.is_kept().map_or("", |kept| if kept { "kept" } else { "MISSED" });
        table.row(
            self.what.clone(),
            [
                figure(self.ours),
                self.other.map(figure).unwrap_or_default(),
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
    fn limits_are_kept_up_to_themselves() {
        let row = |ours, other, limit| Row { what: String::new(), ours, other, unit: "ns", limit };
        assert_eq!(row(7.0, None, Limit::Most(7.0)).is_kept(), Some(true));
        assert_eq!(row(7.1, None, Limit::Most(7.0)).is_kept(), Some(false));
        assert_eq!(row(3.0, Some(2.0), Limit::Ratio(1.25)).is_kept(), Some(false));
        assert_eq!(row(1.0, Some(10.0), Limit::Faster(10.0)).is_kept(), Some(true));
        assert_eq!(row(1.0, Some(9.0), Limit::Faster(10.0)).is_kept(), Some(false));
        assert_eq!(row(1.0, None, Limit::None).is_kept(), None);
    }
}
