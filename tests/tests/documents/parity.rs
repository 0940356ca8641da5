//! The manual's page on LightweightVK's features: each row says what holds it, by files that are there, or why it is left out.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

const PAGE: &str = include_str!("../../../lvk/src/manual/parity.md");

/// Features that LightweightVK has, area by area, of which none is forgotten.
const AREAS: [&str; 20] = [
    "Shape of the interface",
    "Context and device",
    "Swapchains",
    "Buffers",
    "Textures and samplers",
    "Bindless descriptors",
    "Deferred destruction",
    "Pipelines",
    "Shaders",
    "Commands and the barriers that they hide",
    "Submission and queues",
    "Staging",
    "Queries",
    "Debugging",
    "Mesh shaders, local reads, views, shading rates, headsets",
    "User interface",
    "Headless and screenshots",
    "Interop",
    "Ray tracing",
    "Samples",
];
/// Findings of weak spots, numbered from 1.
const WEAK_SPOTS: usize = 59;
/// Fewest letters of a reason to leave something out.
const REASON: usize = 30;

/// A line of a table.
#[derive(Debug, Clone, PartialEq)]
struct Row<'a> {
    area: &'a str,
    feature: &'a str,
    here: &'a str,
    held_by: &'a str,
}

/// The tables of a page, or the line that is no part of one.
fn rows(page: &str) -> Result<Vec<Row<'_>>, String> {
    let (mut area, mut found) = ("", Vec::new());
    for line in page.lines() {
        if let Some(title) = line.strip_prefix("# ") {
            area = title;
        }
        let Some(cells) = line.strip_prefix('|') else { continue };
        let cells: Vec<_> = cells.split('|').map(str::trim).collect();
        let [feature, here, held_by, ""] = cells[..] else { return Err(format!("three cells: {line}")) };
        let is_head = held_by == "Held by" || held_by == "---";
        if !is_head {
            found.push(Row { area, feature, here, held_by });
        }
    }
    Ok(found)
}

fn project() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Files of tests that a cell names, below the folder that their kind says.
fn files(held_by: &str) -> Result<Vec<String>, String> {
    let mut found = Vec::new();
    for part in held_by.split("; ") {
        let folder = match part.get(..3) {
            Some("t: ") => "tests/tests",
            Some("s: ") => "samples/tests",
            Some("u: ") => "lvk/src",
            _ => return Err(format!("{part:?} begins with none of t:, s: and u:")),
        };
        found.extend(part[3..].split(", ").map(|name| format!("{folder}/{name}.rs")));
    }
    Ok(found)
}

/// What is wrong with a row.
fn complaint(row: &Row<'_>) -> Option<String> {
    let Row { feature, here, held_by, .. } = row;
    let left_out = here.strip_prefix("Left out").map(|rest| rest.rsplit(": ").next().unwrap_or(rest));
    if feature.is_empty() || here.is_empty() {
        return Some("a cell is empty".to_owned());
    }
    match (left_out, *held_by) {
        (None, "-") => return Some("neither tests nor left out".to_owned()),
        (Some(reason), _) if reason.len() < REASON => return Some(format!("no reason: {reason}")),
        (Some(_), "-") => return None,
        _ => {}
    }
    let files = match files(held_by) {
        Ok(files) => files,
        Err(wrong) => return Some(wrong),
    };
    let without_test = files.into_iter().find(|file| {
        let text = std::fs::read_to_string(project().join(file)).unwrap_or_default();
        !text.contains("#[test]")
    });
    without_test.map(|file| format!("{file} has no test"))
}

#[test]
fn every_row_is_held_by_tests_or_left_out_with_a_reason() {
    let rows = rows(PAGE).unwrap();
    assert!(rows.len() > 200, "{} rows", rows.len());
    let wrong: Vec<_> =
        rows.iter().filter_map(|row| complaint(row).map(|why| (row.area, row.feature, why))).collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn every_area_and_every_weak_spot_is_there_once() {
    let rows = rows(PAGE).unwrap();
    let areas: Vec<_> = PAGE.lines().filter_map(|line| line.strip_prefix("# ")).collect();
    assert_eq!(areas[..AREAS.len()], AREAS);
    assert_eq!(areas[AREAS.len()..], ["Weak spots"]);
    for area in areas {
        assert!(rows.iter().filter(|row| row.area == area).count() >= 2, "{area}");
    }
    let numbers = rows.iter().filter(|row| row.area == "Weak spots").map(|row| {
        let (number, spot) = row.feature.split_once(": ").unwrap();
        assert!(!spot.is_empty(), "{number}");
        number.parse::<usize>().unwrap()
    });
    assert_eq!(numbers.collect::<Vec<_>>(), (1..=WEAK_SPOTS).collect::<Vec<_>>());
    let features: BTreeSet<_> = rows.iter().map(|row| (row.area, row.feature)).collect();
    assert_eq!(features.len(), rows.len(), "a row is there twice");
}

#[test]
fn rows_that_promise_without_holding_are_noticed() {
    let row = |here, held_by| Row { area: "", feature: "x", here, held_by };
    for (here, held_by) in [
        ("the same", "-"),
        ("the same", ""),
        ("the same", "documents/parity"),
        ("the same", "t: documents/parity, nowhere"),
        ("the same", "t: documents/parity; u: manual/mod"),
        ("Left out", "-"),
        ("Left out: later", "-"),
        ("", "t: documents/parity"),
    ] {
        assert!(complaint(&row(here, held_by)).is_some(), "{here} {held_by}");
    }
    assert_eq!(complaint(&row("the same", "t: documents/parity; s: windows; u: barrier/batch")), None);
    assert_eq!(complaint(&row("Left out: as long as nobody has a device that could", "-")), None);
    assert!(rows("| a | b |").is_err() && rows("| a | b | c | d |").is_err());
}
