//! Figures of `docs/reliability.md`: rows of sums, and the first table, which repeats figures of the sections.
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

/// Returns the total of a column over the rows of sums of a section.
fn total(section: &str, column: &str) -> u64 {
    let (mut at, mut sum) = (None, 0);
    for row in section.lines().map(cells) {
        let Some(row) = row else {
            at = None;
            continue;
        };
        at = at.or_else(|| row.iter().position(|cell| *cell == column));
        sum += at.filter(|_| row[0] == SUM).and_then(|at| number(row.get(at)?)).unwrap_or(0);
    }
    sum
}

/// Returns the parts of a text that are numbers above 99, as they are written, with the words that follow.
fn large_numbers(text: &str) -> Vec<(&str, &str)> {
    let is_part = |byte: char| byte.is_ascii_digit() || matches!(byte, ',' | '.');
    let words: Vec<&str> = text.split_whitespace().collect();
    let numbers = words.iter().zip(words.iter().skip(1).chain([&""])).filter_map(|(word, next)| {
        let word = word.trim_matches([',', '.', ':', ';', '(', ')']);
        let is_number = word.starts_with(|first: char| first.is_ascii_digit()) && word.chars().all(is_part);
        (is_number && (word.len() > 2 || *next == "million")).then_some((word, *next))
    });
    numbers.collect()
}

/// Returns the complaints about figures of the first table: each stands in its section, or is the total of a column there.
fn wrong_headlines(page: &str) -> Vec<String> {
    let mut wrong = Vec::new();
    let first = page.split("\n## ").next().unwrap_or_default();
    for row in first.lines().filter_map(cells) {
        let anchor = row[0].split("](#").nth(1).and_then(|rest| rest.split(')').next());
        let Some(anchor) = anchor else { continue };
        let is_it = |section: &&str| {
            section.lines().next().is_some_and(|title| title.to_lowercase().replace(' ', "-") == anchor)
        };
        let section = page.split("\n## ").find(is_it).unwrap_or_default();
        for (figure, word) in large_numbers(row.get(1).copied().unwrap_or_default()) {
            let decimals = figure.split('.').nth(1).map_or(0, str::len);
            let millions = |found: &str| Some(format!("{:.decimals$}", number(found)? as f64 / 1e6));
            let is_it = |(found, unit): &(&str, &str)| match (word == "million", *unit == "million") {
                (true, false) => millions(found).is_some_and(|found| found == figure),
                (wanted, unit) => wanted == unit && *found == figure,
            };
            if !large_numbers(section).iter().any(is_it) && number(figure) != Some(total(section, word)) {
                wrong.push(format!(
                    "{figure} {word} is neither in the section '{anchor}' nor the total of a column"
                ));
            }
        }
    }
    wrong
}

#[test]
fn figures_of_the_first_table_are_those_of_the_sections() {
    let page = std::fs::read_to_string(project().join("docs/reliability.md")).unwrap();
    assert_eq!(wrong_headlines(&page), Vec::<String>::new());
}

#[test]
fn a_wrong_figure_of_the_first_table_is_noticed() {
    let page = "| what | figures |\n|---|---|\n| [a b](#a-b) | 1,002 runs, 300 more |\n\n## A b\n\n\
                | x | runs |\n|---|---|\n| y | 1,002 |\n| all of these | 1,002 |\n\n300 more.\n";
    assert_eq!(wrong_headlines(page), Vec::<String>::new());
    assert_eq!(wrong_headlines(&page.replacen("1,002", "1,003", 1)).len(), 1);
    assert_eq!(wrong_headlines(&page.replacen("300", "301", 1)).len(), 1);
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
