//! `docs/features.md`: each row names tests that exist, and the manual page that explains what is left out.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use crate::held_by::{self, cells, project};

const DOCUMENT: &str = include_str!("../../../docs/features.md");
const HEAD: [&str; 4] = ["Feature", "Here", "Held by", "Left out"];

/// The rows below the head of the table, but for those that begin an area.
fn rows() -> Vec<[&'static str; 4]> {
    let lines = DOCUMENT.lines().skip_while(|line| cells(line).is_none_or(|cells| cells != HEAD));
    let rows = lines.skip(2).map_while(cells).map(|cells| <[&str; 4]>::try_from(cells).unwrap());
    rows.filter(|[feature, ..]| !feature.starts_with("**")).collect()
}

/// The error of a row; `None` if the row is valid.
fn complaint([feature, here, held_by, left_out]: &[&str; 4]) -> Option<String> {
    if feature.is_empty() || here.is_empty() {
        return Some("a cell is empty".to_owned());
    }
    held_by::complaint(held_by).or_else(|| page_complaint(left_out))
}

/// The error of a cell about missing features, which is `-` or ends with the name of the manual page that gives the
/// reason.
fn page_complaint(left_out: &str) -> Option<String> {
    if left_out == "-" {
        return None;
    }
    let page = left_out.strip_suffix(')').and_then(|rest| rest.rsplit_once(" (")).map(|(_, page)| page);
    let Some(page) = page else { return Some(format!("no page: {left_out}")) };
    let file = project().join("lvk/src/manual").join(page).with_extension("md");
    (!file.is_file()).then(|| format!("no such page: {page}"))
}

#[test]
fn every_row_names_its_tests_and_the_page_of_its_reasons() {
    let rows = rows();
    assert!(rows.len() > 60, "{} rows", rows.len());
    let wrong: Vec<_> = rows.iter().filter_map(|row| complaint(row).map(|why| (row[0], why))).collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn entries_without_a_test_or_a_page_are_noticed() {
    let test = "t: documents/features";
    for (held_by, left_out) in [
        ("-", "-"),
        ("", "-"),
        ("t: nowhere", "-"),
        (test, ""),
        (test, "texel buffers"),
        (test, "x (nowhere)"),
    ] {
        assert!(complaint(&["x", "all", held_by, left_out]).is_some(), "{held_by} {left_out}");
    }
    assert_eq!(complaint(&["x", "all", test, "-"]), None);
    assert_eq!(complaint(&["x", "all", test, "texel buffers (parity)"]), None);
}
