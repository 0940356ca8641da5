//! Figures of `docs/reliability.md`: rows of sums, and the first table, which repeats figures of the sections.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::collections::{BTreeMap, BTreeSet};

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

/// Returns the letter in brackets of a cell, as `b` of `interop [b]`; empty without one.
fn letter(cell: &str) -> &str {
    cell.split_once('[').and_then(|(_, rest)| rest.split_once(']')).map_or("", |(letter, _)| letter)
}

/// Returns the sweeps and faults that a cell states for a letter, as `[b] (40 sweeps, 34,798 faults)`.
fn stated(cell: &str) -> Option<(u64, u64)> {
    let (_, counts) = cell.strip_suffix(" faults)")?.split_once('(')?;
    let (sweeps, faults) = counts.split_once(" sweeps, ").or_else(|| counts.split_once(" sweep, "))?;
    Some((number(sweeps)?, number(faults)?))
}

/// Returns what is wrong with the sweeps and faults that are stated for each letter: they are those of the rows with that letter, in
/// tables with a column of faults.
fn wrong_letters(page: &str) -> Vec<String> {
    let (mut column, mut told, mut counted) = (None, BTreeMap::new(), BTreeMap::<_, (u64, u64)>::new());
    for row in page.lines().map(cells) {
        let Some(row) = row else {
            column = None;
            continue;
        };
        told.extend(stated(row[0]).map(|counts| (letter(row[0]), counts)));
        let faults = column.and_then(|column: usize| number(row.get(column)?)).filter(|_| row[0] != SUM);
        if let Some(faults) = faults {
            let of_letter = counted.entry(letter(row[0])).or_default();
            *of_letter = (of_letter.0 + 1, of_letter.1 + faults);
        }
        column = column.or_else(|| row.iter().position(|cell| *cell == "faults"));
    }
    let letters = told.keys().chain(counted.keys()).collect::<BTreeSet<_>>();
    let wrong = letters.into_iter().filter(|letter| told.get(*letter) != counted.get(*letter));
    let tell = |letter| {
        format!("[{letter}] states {:?}, and its rows have {:?}", told.get(letter), counted.get(letter))
    };
    wrong.map(|letter| tell(*letter)).collect()
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

fn reliability() -> String {
    std::fs::read_to_string(project().join("docs/reliability.md")).unwrap()
}

#[test]
fn figures_of_the_first_table_are_those_of_the_sections() {
    let page = reliability();
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
fn sweeps_and_faults_are_counted_by_letter() {
    let page = reliability();
    assert_eq!(wrong_letters(&page), Vec::<String>::new());
}

#[test]
fn a_wrong_count_of_a_letter_is_noticed() {
    let page = "| rows |\n|---|\n| [b] (2 sweeps, 1,007 faults) |\n| without a letter (1 sweep, 3 faults) |\n\n\
                | program | faults |\n|---|---|\n| x [b] | 1,000 |\n| y [b], in part | 7 |\n| z | 3 |\n\
                | all of these | 1,010 |\n";
    assert_eq!(wrong_letters(page), Vec::<String>::new());
    for (right, wrong) in
        [("(2 sweeps", "(3 sweeps"), ("1,007", "1,008"), ("| 7 |", "| 8 |"), ("z |", "z [c] |")]
    {
        assert!(!wrong_letters(&page.replacen(right, wrong, 1)).is_empty(), "{right}");
    }
}

#[test]
fn the_sums_of_tables_are_right() {
    let page = reliability();
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
