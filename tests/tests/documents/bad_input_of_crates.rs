//! The section of the page of bad input about other crates than the library: it has each of their errors, with tests.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on has failed")]

use std::collections::BTreeSet;

use crate::bad_input::{CRATES, PAGE, has_test, has_words, quoted, reached_text, variants};
use crate::held_by::{cells, project};

const PROBLEMS: &str = include_str!("../../../lvk-gltf/src/error.rs");
const ERRORS: &str = include_str!("../../../lvk-egui/src/error.rs");

/// Returns the rows of the section: errors, and tests.
fn rows() -> Vec<(Vec<&'static str>, Vec<&'static str>)> {
    let (_, section) = PAGE.split_once(CRATES).unwrap();
    let lines = section.lines().filter_map(cells).skip(2);
    lines
        .map(|cells| match cells[..] {
            [errors, wrong, tests] if !wrong.is_empty() => (quoted(errors), quoted(tests)),
            _ => panic!("three cells: {cells:?}"),
        })
        .collect()
}

/// Returns the source of a test, and the name of its function.
fn source(test: &str) -> Option<(String, &str)> {
    let [program, module, name] = test.split("::").collect::<Vec<_>>()[..] else { return None };
    let path = match program {
        "lvk_gltf" => format!("lvk-gltf/tests/models/{module}.rs"),
        "lvk_egui" => format!("lvk-egui/src/{module}.rs"),
        _ => format!("tests/tests/{program}/{module}.rs"),
    };
    Some((std::fs::read_to_string(project().join(path)).ok()?, name))
}

/// Returns what is wrong with a row: a test that there is not, or an error that none of the tests expects.
fn complaint(errors: &[&str], tests: &[&str]) -> Option<String> {
    let mut texts = String::new();
    for test in tests {
        match source(test).filter(|(source, name)| has_test(source, name)) {
            Some((source, name)) => texts += &reached_text(&source, name),
            None => return Some(format!("there is no test {test}")),
        }
    }
    let is_expected = |error: &&&str| has_words(&texts, error.split_once("::").unwrap().1);
    let unexpected = errors.iter().find(|error| !is_expected(error))?;
    Some(format!("{unexpected} is not in {tests:?}"))
}

#[test]
fn every_error_of_other_crates_has_a_row() {
    let problems = PROBLEMS.replace("pub enum Problem", "pub enum Error");
    let of =
        |kind: &'static str, source| variants(source).into_iter().map(move |name| format!("{kind}::{name}"));
    let known: BTreeSet<String> =
        of("lvk_gltf::Problem", &problems).chain(of("lvk_egui::Error", ERRORS)).collect();
    let named: BTreeSet<String> =
        rows().into_iter().flat_map(|(errors, _)| errors).map(ToOwned::to_owned).collect();
    assert_eq!(named, known);
}

#[test]
fn every_row_of_other_crates_names_tests_that_expect_the_error() {
    let complaints: Vec<_> = rows().iter().filter_map(|(errors, tests)| complaint(errors, tests)).collect();
    assert!(complaints.is_empty(), "{complaints:#?}");
}

#[test]
fn wrong_entries_of_other_crates_are_noticed() {
    let test = "lvk_gltf::containers::errors_name_the_file";
    assert_eq!(complaint(&["lvk_gltf::Problem::File"], &[test]), None);
    for (error, test) in [
        ("lvk_gltf::Problem::Memory", test),
        ("lvk_gltf::Problem::File", "lvk_gltf::containers::no_such_test"),
        ("lvk_gltf::Problem::File", "lvk_gltf::nowhere::errors_name_the_file"),
    ] {
        assert!(complaint(&[error], &[test]).is_some(), "{error}, {test}");
    }
}
