//! `docs/gltf.md`: each test of this program has a row, each row has tests, and each extension is listed.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::collections::BTreeSet;
use std::path::Path;

const DOCUMENT: &str = include_str!("../../../docs/gltf.md");

/// The tables whose last column names tests: first and last cell of each row.
fn rows() -> Vec<(&'static str, &'static str)> {
    let mut rows = Vec::new();
    let mut inside = false;
    for line in DOCUMENT.lines() {
        let cells: Vec<&str> = line.split('|').map(str::trim).collect();
        let (first, last) = (cells.get(1), cells.len().checked_sub(2).and_then(|last| cells.get(last)));
        let (Some(first), Some(last)) = (first, last) else {
            inside = false;
            continue;
        };
        if *last == "Held by" {
            inside = true;
        } else if inside && !first.starts_with("---") {
            rows.push((*first, *last));
        }
    }
    rows
}

/// The tests of this program, but for those of this file and those that run only on demand.
fn tests() -> BTreeSet<String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/models");
    let mut found = BTreeSet::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let module = path.file_stem().unwrap().to_str().unwrap().to_owned();
        if module == "support_table" {
            continue;
        }
        let text = std::fs::read_to_string(&path).unwrap();
        for test in text.split("#[test]\n").skip(1).filter(|test| !test.trim_start().starts_with("#[ignore"))
        {
            let name = test.split("fn ").nth(1).and_then(|rest| rest.split('(').next()).unwrap();
            found.insert(format!("{module}::{name}"));
        }
    }
    found
}

#[test]
fn rows_and_tests_are_the_same() {
    let rows = rows();
    assert!(rows.len() > 40, "{} rows", rows.len());
    let named: BTreeSet<String> =
        rows.iter().flat_map(|(_, tests)| tests.split(", ")).map(str::to_owned).collect();
    assert_eq!(named, tests());
}

#[test]
fn every_extension_that_is_read_is_in_the_table() {
    let features: String = rows().iter().map(|(feature, _)| *feature).collect();
    for extension in lvk_gltf::SUPPORTED_EXTENSIONS {
        assert!(features.contains(&format!("`{extension}`")), "{extension}");
    }
}
