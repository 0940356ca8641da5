//! Tables and plots of the groups.

use std::path::Path;

use super::curve::{MOST_CONSTANT, Unit};
use super::group::Group;
use super::log_log_chart::LogLogChart;
use crate::error::BenchError;
use crate::table::{Table, format_grouped};

/// Returns the table of a group, below a title.
pub(super) fn table(group: &Group, title: String) -> Table {
    let heads: Vec<String> = group.sizes.iter().map(|size| format_grouped(*size)).collect();
    let mut columns = vec!["cost"];
    columns.extend(heads.iter().map(String::as_str));
    columns.extend(["exponent", "constant", "why it grows"]);
    let mut table = Table::new(title, &columns);
    group.curves.iter().for_each(|curve| table.add_row(curve.name.clone(), curve.cells(&group.sizes)));
    group.notes.iter().for_each(|note| table.add_note(note.clone()));
    let grown: Vec<&str> =
        group.curves.iter().filter(|curve| curve.is_violated()).map(|curve| curve.name.as_str()).collect();
    let verdict = if grown.is_empty() { "yes".to_owned() } else { format!("no: {}", grown.join("; ")) };
    table.add_note(format!(
        "constant, where it should be: {verdict} (an exponent below {MOST_CONSTANT} of the larger half of the sizes; a cost that falls shares a fixed part)"
    ));
    table
}

/// Returns the plots of a group, one for each unit, with their file names.
pub(super) fn plots(group: &Group) -> Result<Vec<(String, String)>, BenchError> {
    let units = [Unit::Milliseconds, Unit::BytesPerTriangle, Unit::Times, Unit::Count];
    let mut plots = Vec::new();
    for unit in units {
        let curves: Vec<_> = group.curves.iter().filter(|curve| curve.unit == unit).collect();
        if !curves.is_empty() {
            let title = format!("cost by number of {}", group.key.title());
            let chart = LogLogChart { title, sizes: group.key.title(), unit, curves };
            plots.push((format!("{}{}.svg", group.key.name(), unit.file_suffix()), chart.svg()?));
        }
    }
    Ok(plots)
}

/// Writes `growth.md` with all tables, and the plots, into a folder, which is made if it is missing.
pub(super) fn write(folder: &Path, groups: &[(&Group, String)]) -> Result<(), BenchError> {
    let write = |name: &str, text: &str| {
        let path = folder.join(name);
        std::fs::write(&path, text).map_err(|source| BenchError::Write { path, source })
    };
    std::fs::create_dir_all(folder)
        .map_err(|source| BenchError::Write { path: folder.to_owned(), source })?;
    let mut page = "# Growth\n".to_owned();
    for (group, table) in groups {
        page += &format!("\n{table}");
        for (name, svg) in plots(group)? {
            write(&name, &svg)?;
            page += &format!("\n![{}, {name}]({name})\n", group.key.title());
        }
    }
    write("growth.md", &page)
}
