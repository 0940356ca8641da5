//! A Markdown table with a title and notes.

use std::fmt;

/// A Markdown table with a title above and notes below. Columns after the first are right-aligned.
pub(super) struct Table {
    title: String,
    rows: Vec<Vec<String>>,
    notes: Vec<String>,
}

impl Table {
    /// Creates an empty table with these column heads.
    pub(super) fn new(title: String, columns: &[&str]) -> Self {
        let head = columns.iter().map(|head| (*head).to_owned()).collect();
        Self { title, rows: vec![head], notes: Vec::new() }
    }

    /// Adds a row. Missing cells stay empty.
    pub(super) fn add_row(&mut self, name: impl Into<String>, cells: impl IntoIterator<Item = String>) {
        let row: Vec<String> = std::iter::once(name.into()).chain(cells).collect();
        debug_assert!(row.len() <= self.rows[0].len(), "{row:?}");
        self.rows.push(row);
    }

    /// Adds a line below the table.
    pub(super) fn add_note(&mut self, text: impl Into<String>) {
        self.notes.push(text.into());
    }

    fn width(&self, column: usize) -> usize {
        self.rows
            .iter()
            .filter_map(|row| row.get(column))
            .map(|cell| cell.chars().count())
            .max()
            .unwrap_or(0)
            .max(3)
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}\n", self.title)?;
        let widths: Vec<usize> = (0..self.rows[0].len()).map(|column| self.width(column)).collect();
        for (number, row) in self.rows.iter().enumerate() {
            for (column, &width) in widths.iter().enumerate() {
                let cell = row.get(column).map_or("", String::as_str);
                match column {
                    0 => write!(f, "| {cell:width$} |")?,
                    _ => write!(f, " {cell:>width$} |")?,
                }
            }
            writeln!(f)?;
            if number == 0 {
                write!(f, "|{}|", "-".repeat(widths[0] + 2))?;
                widths[1..].iter().try_for_each(|width| write!(f, "{}:|", "-".repeat(width + 1)))?;
                writeln!(f)?;
            }
        }
        self.notes.iter().try_for_each(|note| write!(f, "\n- {note}"))?;
        if self.notes.is_empty() { Ok(()) } else { writeln!(f) }
    }
}

/// Formats milliseconds with microsecond precision.
pub(super) fn format_ms(milliseconds: f64) -> String {
    format!("{milliseconds:.3} ms")
}

/// Formats a ratio, for example `1.250x`.
pub(super) fn format_ratio(ratio: f64) -> String {
    format!("{ratio:.3}x")
}

/// Formats a byte count with thousands separators.
pub(super) fn format_bytes(count: u64) -> String {
    format!("{} B", format_grouped(count))
}

/// Formats an integer with thousands separators.
pub(super) fn format_grouped(number: u64) -> String {
    let digits = number.to_string();
    let mut text = String::with_capacity(digits.len() * 4 / 3);
    for (place, digit) in digits.chars().enumerate() {
        if place > 0 && (digits.len() - place).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_are_aligned_markdown() {
        let mut table = Table::new("## title".to_owned(), &["what", "GPU"]);
        table.add_row("a build", [format_ms(1.5)]);
        table.add_row("ratio", []);
        table.add_note("measured");
        let expected = "## title\n\n| what    |      GPU |\n|---------|---------:|\n| a build | 1.500 ms |\n\
                        | ratio   |          |\n\n- measured\n";
        assert_eq!(table.to_string(), expected);
    }

    #[test]
    fn digits_are_grouped_by_three() {
        let grouped = [0, 999, 1000, 123_456, 1_234_567].map(format_grouped);
        assert_eq!(grouped, ["0", "999", "1,000", "123,456", "1,234,567"]);
        assert_eq!((format_bytes(1024), format_ratio(2.0)), ("1,024 B".to_owned(), "2.000x".to_owned()));
    }
}
