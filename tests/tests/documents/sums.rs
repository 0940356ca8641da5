//! Tables of `docs/reliability.md` that end with a row of sums.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use crate::held_by::{cells, project};

/// The first cell of a row of sums.
const SUM: &str = "all of these";

/// Returns the number of a cell, which may have separators.
fn number(cell: &str) -> Option<u64> {
    cell.replace(',', "").parse().ok()
}

/// Returns the complaints about rows of sums. The rows above have a number in each column that has a sum.
fn complaints(page: &str) -> Vec<String> {
    let (mut above, mut wrong): (Vec<Vec<&str>>, _) = (Vec::new(), Vec::new());
    for line in page.lines() {
        let Some(row) = cells(line) else {
            above.clear();
            continue;
        };
        if row[0] != SUM {
            above.push(row);
            continue;
        }
        for (column, sum) in row.iter().enumerate().filter_map(|(at, cell)| Some((at, number(cell)?))) {
            let found: u64 = above.iter().filter_map(|row| number(row.get(column)?)).sum();
            if found != sum {
                wrong.push(format!("column {column} has the sum {found}, not {sum}: {line}"));
            }
        }
    }
    wrong
}

#[test]
fn the_sums_of_tables_are_right() {
    let page = std::fs::read_to_string(project().join("docs/reliability.md")).unwrap();
    assert!(page.matches(SUM).count() >= 2);
    assert_eq!(complaints(&page), Vec::<String>::new());
}

#[test]
fn a_wrong_sum_is_noticed() {
    let page =
        "| a | b | c |\n|---|---|---|\n| x | 1,000 | d |\n| y | 2 | 7 |\n| all of these | 1,002 | |\n\n";
    assert_eq!(complaints(page), Vec::<String>::new());
    let wrong = page.replace("1,002", "1,003");
    assert_eq!(complaints(&(page.to_owned() + &wrong)).len(), 1);
}
