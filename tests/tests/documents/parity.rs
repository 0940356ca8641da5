//! The manual's page on LightweightVK's features: no feature is missing, and each row names test files that exist or
//! the reason why the feature is left out.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::collections::BTreeSet;

use crate::held_by::{self, cells};

const PAGE: &str = include_str!("../../../lvk/src/manual/parity.md");

/// Features of LightweightVK by area. Each is given by words that stand in its row.
const FEATURES: [(&str, &[&str]); 20] = [
    (
        "Shape of the interface",
        &["abstract classes", "typed handles", "holders", "pools", "result code", "profiler", "logging"],
    ),
    (
        "Context and device",
        &[
            "Vulkan 1.3 or 1.4",
            "validation and GPU-assisted",
            "termination",
            "raw chain",
            "a loader",
            "extensions of the instance",
            "portability",
            "a device by type",
            "a list of devices",
            "features that a device must have",
            "push descriptors",
            "optional features",
            "8-bit indices",
            "questions to the device",
            "invocation reordering",
            "tile images",
            "workarounds",
            "Memory Allocator",
            "all memory is one heap",
            "a window made",
        ],
    ),
    (
        "Swapchains",
        &[
            "16 images",
            "colour space",
            "to store to",
            "screen turned",
            "HDR metadata",
            "six present modes",
            "shared present modes",
            "part of the submission",
            "recreation",
            "headless",
        ],
    ),
    (
        "Buffers",
        &[
            "usages",
            "uniform",
            "texel",
            "memory of the device",
            "memoryless",
            "addresses",
            "mapped pointers",
            "uploads",
            "downloads",
            "sizes checked",
            "4 GiB",
            "sparse",
        ],
    ),
    (
        "Textures and samplers",
        &[
            "2D, 3D, cubes",
            "several samples",
            "mips, a swizzle",
            "usages",
            "views of mips",
            "framebuffer views",
            "49 formats",
            "depth formats",
            "uploads of regions",
            "host image copies",
            "mips by blits",
            "downloads",
            "NV12",
            "samplers with",
            "transient",
        ],
    ),
    (
        "Bindless descriptors",
        &["one set", "growth", "dummies", "at the next bind", "used again", "no buffer descriptors"],
    ),
    ("Deferred destruction", &["wait for a submission", "caller's own"]),
    (
        "Pipelines",
        &[
            "first bind",
            "modules",
            "vertex, tessellation",
            "16 attributes",
            "8 colour",
            "blending",
            "stencil",
            "polygon mode",
            "depth bias",
            "dynamic",
            "specialization",
            "compute",
            "reflection",
            "a cache",
        ],
    ),
    (
        "Shaders",
        &[
            "SPIR-V and GLSL",
            "Slang",
            "optimisation",
            "put in front",
            "helpers",
            "storage images",
            "a structure to trace in",
            "no includes",
            "debug printing",
            "debug information",
        ],
    ),
    (
        "Commands and the barriers that they hide",
        &[
            "dependencies",
            "transitions of whole",
            "by hand",
            "passes",
            "draws, indexed",
            "indirect calls",
            "VK_EXT_multi_draw",
            "mesh draws",
            "dispatches",
            "push constants",
            "fills",
            "clears",
            "generated mips",
            "traces",
            "updates of top-level",
            "buffers and images",
            "events",
        ],
    ),
    (
        "Submission and queues",
        &["64 command buffers", "a fence", "a handle", "everything", "a queue for compute"],
    ),
    ("Staging", &["grows to a bound", "each piece"]),
    ("Queries", &["timestamps", "occlusion", "waited for", "calibrated"]),
    ("Debugging", &["names", "labels", "lost device", "settings", "trace of all commands"]),
    (
        "Mesh shaders, local reads, views, shading rates, headsets",
        &["mesh and task", "input attachments", "multiview", "shading rates", "density maps", "OpenXR"],
    ),
    ("User interface", &["ImGui", "plots", "input of"]),
    ("Headless and screenshots", &["headless", "a screenshot", "in CI"]),
    ("Interop", &["taken out", "in between", "taken in"]),
    (
        "Ray tracing",
        &[
            "bottom levels",
            "submission for each",
            "sizes",
            "scratch",
            "splits",
            "refits",
            "compaction",
            "from a buffer",
            "position fetch",
            "ray queries",
            "six kinds",
            "binding tables",
            "recursion",
            "libraries",
            "host builds",
            "capture and replay",
            "micromaps",
        ],
    ),
    (
        "Samples",
        &[
            "a triangle",
            "a cube map",
            "Y'CbCr",
            "deferred",
            "by mesh shaders",
            "fireworks",
            "shadows on all sides",
            "triplanar",
            "large textured mesh",
            "compressed",
            "first ray traced",
            "ambient occlusion",
            "whole ray tracing pipeline",
            "textures in ray tracing",
            "HDR",
            "planets",
            "phones",
        ],
    ),
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
        let Some(cells) = cells(line) else { continue };
        let [feature, here, held_by] = cells[..] else { return Err(format!("three cells: {line}")) };
        let is_head = held_by == "Held by" || held_by == "---";
        if !is_head {
            found.push(Row { area, feature, here, held_by });
        }
    }
    Ok(found)
}

/// The error of a row; `None` if the row is valid.
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
    held_by::complaint(held_by)
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
    assert_eq!(areas[..FEATURES.len()], FEATURES.map(|(area, _)| area));
    assert_eq!(areas[FEATURES.len()..], ["Weak spots"]);
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
fn every_known_feature_is_in_the_table() {
    let rows = rows(PAGE).unwrap();
    let is_there =
        |area: &str, words: &str| rows.iter().any(|row| row.area == area && row.feature.contains(words));
    let all = FEATURES.iter().flat_map(|(area, features)| features.iter().map(move |words| (*area, *words)));
    let forgotten: Vec<_> = all.filter(|(area, words)| !is_there(area, words)).collect();
    assert!(forgotten.is_empty(), "{forgotten:#?}");
}

#[test]
fn entries_without_a_valid_test_are_noticed() {
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
    assert_eq!(complaint(&row("the same", "t: documents/parity; s: windows/input; u: barrier/batch")), None);
    assert_eq!(complaint(&row("Left out: as long as no device at hand could hold it", "-")), None);
    assert!(rows("| a | b |").is_err() && rows("| a | b | c | d |").is_err());
}
