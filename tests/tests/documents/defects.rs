//! `docs/defects.md` names a test for each defect, or says why there is none.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::collections::BTreeSet;
use std::path::Path;

use crate::bad_input::tests_of;
use crate::held_by::{cells, project};

/// Returns the sweeps of a source in the table of a macro, such as `whole_threads: "threads";`.
fn sweeps_of(source: &str) -> impl Iterator<Item = &str> {
    let names = source.lines().filter_map(|line| line.trim_start().split_once(": "));
    names.map(|(name, _)| name).filter(|name| name.starts_with("whole_"))
}

/// Adds the names of the tests in the Rust files of a folder.
fn add_tests(folder: &Path, names: &mut BTreeSet<String>) {
    for entry in std::fs::read_dir(folder).unwrap().map(Result::unwrap) {
        let path = entry.path();
        let is_hidden = entry.file_name().to_string_lossy().starts_with('.');
        if path.is_dir() && !is_hidden && entry.file_name() != "target" {
            add_tests(&path, names);
        } else if path.extension().is_some_and(|end| end == "rs") {
            let text = std::fs::read_to_string(path).unwrap();
            names.extend(tests_of(&text).chain(sweeps_of(&text)).map(str::to_owned));
        }
    }
}

/// Returns what is wrong with the rows of a page: no test, or one that is not among `names`.
fn complaints(page: &str, names: &BTreeSet<String>) -> Vec<String> {
    let rows = page.lines().filter_map(cells);
    let tests =
        rows.filter_map(|cells| cells.last().copied()).filter(|cell| !matches!(*cell, "test" | "---"));
    let wrong = |cell: &str| {
        let named: Vec<&str> = cell.split('`').skip(1).step_by(2).collect();
        let missing = named.iter().find(|name| !names.contains(**name));
        match missing {
            Some(name) => Some(format!("no test is called {name}")),
            None if named.is_empty() && !cell.starts_with("none: ") => Some(format!("no test in '{cell}'")),
            None => None,
        }
    };
    tests.filter_map(wrong).collect()
}

#[test]
fn every_defect_of_the_page_has_its_test() {
    let mut names = BTreeSet::new();
    for folder in ["lvk", "lvk-gltf", "samples", "tests"] {
        add_tests(&project().join(folder), &mut names);
    }
    let page = std::fs::read_to_string(project().join("docs/defects.md")).unwrap();
    assert!(page.lines().filter_map(cells).count() > 50);
    assert_eq!(complaints(&page, &names), Vec::<String>::new());
}

#[test]
fn a_row_without_a_test_is_noticed() {
    let names = BTreeSet::from(["it_rains".to_owned(), "whole_rain".to_owned()]);
    let page = "| found | mended | test |\n|---|---|---|\n| a | b | `it_rains`, `whole_rain`, always |\n| a | b | none: a text |";
    assert_eq!(complaints(page, &names), Vec::<String>::new());
    let bad = format!("{page}\n| a | b | `it_snows` |\n| a | b | |\n| a | b | later |");
    assert_eq!(
        complaints(&bad, &names),
        ["no test is called it_snows", "no test in ''", "no test in 'later'"]
    );
    let source = "    #[test]\n    // Slow.\n    #[ignore]\n    fn it_rains() {\n}\nfn helper() {}\n    whole_rain: \"rain\";";
    assert!(tests_of(source).eq(["it_rains"]) && sweeps_of(source).eq(["whole_rain"]));
}
