//! Tables of all documents: each row has as many cells as the head of its table.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use crate::held_by::project;
use crate::map::files;

/// Number of cells of a line of a table, or `None` where it is no such line. A `\|` is a letter of its cell.
fn width(line: &str) -> Option<usize> {
    let line = line.trim().strip_prefix('|')?;
    Some(line.matches('|').count() - line.matches("\\|").count())
}

/// Returns the numbers of lines that have more or fewer cells than the first line of their table.
fn uneven_rows(page: &str) -> Vec<usize> {
    let (mut head, mut is_code, mut uneven) = (None, false, Vec::new());
    for (number, line) in (1..).zip(page.lines()) {
        is_code ^= line.trim_start().starts_with("```");
        let row = width(line).filter(|_| !is_code);
        head = row.map(|row| head.unwrap_or(row));
        if row != head {
            uneven.push(number);
        }
    }
    uneven
}

#[test]
fn a_row_of_another_table_is_noticed() {
    let page = "| a | b |\n|---|---|\n| c | `d \\| e` |\n\n```sh\n| f\n```\n\n  | g |\n  |---|\n  | h |\n";
    assert_eq!(uneven_rows(page), [0; 0]);
    assert_eq!(uneven_rows(&page.replace("| c |", "| c | c |")), [3]);
    assert_eq!(uneven_rows(&page.replace("| h |", "| h | i |")), [11]);
}

#[test]
fn each_line_of_a_table_has_as_many_cells_as_its_head() {
    let (mut count, mut uneven) = (0, Vec::new());
    for file in files().into_iter().filter(|file| file.ends_with(".md")) {
        count += 1;
        let rows = uneven_rows(&std::fs::read_to_string(project().join(&file)).unwrap());
        uneven.extend(rows.into_iter().map(|row| format!("{file}:{row}")));
    }
    assert!(count > 20, "{count} pages");
    assert_eq!(uneven, Vec::<String>::new());
}
