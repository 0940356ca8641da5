//! The tables of `docs/reliability.md` are those of the targets.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk_fuzz::{MOST_TIME, TARGETS};

const DOCUMENT: &str = include_str!("../../../docs/reliability.md");

/// The cells of the rows of a table, whose header begins with `header`.
fn rows<'a>(section: &'a str, header: &str) -> Vec<Vec<&'a str>> {
    let lines = section.lines().skip_while(|line| !line.starts_with(header)).skip(2);
    let rows = lines.take_while(|line| line.starts_with('|'));
    rows.map(|row| row.trim_matches('|').split(" | ").map(str::trim).collect()).collect()
}

#[test]
fn the_tables_have_every_target_with_its_bound() {
    let (_, section) = DOCUMENT.split_once("\n## Fuzzing\n").unwrap();
    let section = section.split("\n## ").next().unwrap();
    let bounds = rows(section, "| target | reads | memory");
    let runs = rows(section, "| target | executions");
    assert_eq!((bounds.len(), runs.len()), (TARGETS.len(), TARGETS.len() + 1), "one row of sums");
    for ((target, bound), run) in TARGETS.iter().zip(bounds).zip(runs) {
        let name = format!("`{}`", target.name);
        assert_eq!([bound[0], run[0]], [&name, &name], "the order of the targets");
        assert_eq!(bound[2], target.memory.to_string(), "{name}");
    }
    let time = format!("{} seconds of processor time", MOST_TIME.as_secs());
    assert!(section.contains(&time), "{time}");
}
