//! The `bench` program as a user meets it: every benchmark runs in its smallest form and prints its figures.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on has failed")]

use std::process::{Command, Output};

use lvk_samples::app::metrics::compare;

/// Standard output of the program, which must succeed, with a silent validation layer.
fn parse_table(args: &[&str]) -> String {
    let args = [args, &["--validate"]].concat();
    let (status, out, err) = outcome(&args);
    assert_eq!(status, Some(0), "{args:?}: {out}{err}");
    out
}

fn outcome(args: &[&str]) -> (Option<i32>, String, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_bench"));
    let Output { status, stdout, stderr } = command.args(args).output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (status.code(), text(stdout), text(stderr))
}

#[test]
fn devices_and_scenes_are_listed_without_a_benchmark() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("attic.obj"), "").unwrap();
    let (status, out, err) = outcome(&["--list-scenes", &folder.path().display().to_string()]);
    assert_eq!(status, Some(0), "{err}");
    assert!(out.contains("courtyard") && out.contains("attic"), "{out}");
    let (status, out, err) = outcome(&["--list-devices"]);
    assert!(status == Some(0) && out.starts_with("[0] "), "{out}{err}");
    let (status, _, err) = outcome(&[]);
    assert!(status == Some(2) && err.contains("--help"), "{err}");
}

/// The cells of the row that begins with `name`, the name left out.
fn columns_of_row(table: &str, name: &str) -> Vec<String> {
    let line = table.lines().find(|line| line.trim_start_matches("| ").starts_with(name));
    let line = line.unwrap_or_else(|| panic!("no row '{name}' in\n{table}"));
    let cells: Vec<String> = line.split('|').skip(2).map(|cell| cell.trim().to_owned()).collect();
    cells[..cells.len() - 1].to_vec()
}

/// The number in front of the unit of a cell.
fn number(cell: &str) -> f64 {
    let digits: String = cell.chars().take_while(|c| c.is_ascii_digit() || ".,".contains(*c)).collect();
    digits.replace(',', "").parse().unwrap_or_else(|_| panic!("no number in '{cell}'"))
}

fn assert_positive(table: &str, name: &str, cells: std::ops::Range<usize>) {
    for cell in &columns_of_row(table, name)[cells] {
        let value = number(cell);
        assert!(value > 0.0 && value.is_finite(), "{name}: {cell} in\n{table}");
    }
}

#[test]
fn a_batch_is_timed_and_its_scratch_memory_within_the_budget() {
    let table = parse_table(&["batch", "--quick"]);
    for name in ["one batch", "a submission and a wait for each", "one batch, scratch budget"] {
        assert_positive(&table, name, 0..2);
    }
    assert_positive(&table, "ratio", 0..1);
    for name in ["peak of scratch memory ", "peak of scratch memory then"] {
        assert!(number(&columns_of_row(&table, name)[1]) <= 100.0, "{table}");
    }
}

#[test]
fn builds_and_sizes_are_printed_beside_hand_written_ones() {
    let table = parse_table(&["compaction", "--quick"]);
    for name in
        ["build, fast trace", "build, fast build", "rebuild, updates allowed", "refit", "before compaction"]
    {
        assert_positive(&table, name, 0..3);
    }
    let [before, after] =
        ["before compaction ", "after compaction "].map(|name| number(&columns_of_row(&table, name)[0]));
    assert!(after <= before, "{table}");
    let freed = number(&columns_of_row(&table, "given back to the allocator")[0]);
    assert!((freed - (before - after)).abs() < 1.0, "what compaction saves is given back\n{table}");
}

#[test]
fn a_split_mesh_renders_the_same_image() {
    let table = parse_table(&["split", "--quick", "--parts", "12"]);
    let head = table.lines().find(|line| line.contains(" parts |")).unwrap();
    let parts = number(head.split('|').nth(3).unwrap().trim());
    assert!(parts >= 12.0, "{table}");
    let traced = table.lines().filter(|line| line.starts_with("| primary rays by")).count();
    assert!(traced > 0, "{table}");
    for line in table.lines().filter(|line| line.starts_with("| pixels that differ")) {
        assert!(line.contains(" 0 of 576 "), "{table}");
    }
}

#[test]
fn updates_of_instances_are_timed_for_every_number_asked_for() {
    let table = parse_table(&["tlas", "--quick", "--instances", "1", "--instances", "300"]);
    for count in ["1", "300"] {
        for mode in ["rebuild", "refit"] {
            for what in ["plain copy + driver", "lvk, from the host", "lvk, from a buffer"] {
                assert_positive(&table, &format!("{mode} of {count}: {what}"), 1..6);
            }
        }
    }
}

#[test]
fn orders_are_timed_and_render_the_same_image() {
    let table = parse_table(&["order", "--quick"]);
    assert!(table.lines().any(|line| line.starts_with("| primary rays by")), "{table}");
    for line in table.lines().filter(|line| line.starts_with("| pixels that differ")) {
        assert!(line.contains(" 0 |"), "{table}");
    }
}

#[test]
fn queries_in_software_are_timed_and_agree_with_the_devices_pipeline() {
    let tables = parse_table(&["queries", "--quick", "--camera", "1", "--instances", "5"]);
    let [rates, cut, agreement, structures]: [&str; 4] =
        tables.split("\n##").collect::<Vec<_>>().try_into().unwrap_or_else(|_| panic!("{tables}"));
    for name in ["software, fast trace", "software, low memory", "software, fast build"] {
        assert_positive(rates, name, 0..1);
    }
    assert!(cut.contains("As 5 overlapping instances"), "{cut}");
    assert_positive(cut, "software, fast trace", 0..1);
    for line in agreement.lines().filter(|line| line.starts_with("| software")) {
        for share in line.split('|').skip(2).filter(|cell| cell.contains('%')) {
            assert!(number(share.trim()) > 99.0, "{agreement}");
        }
    }
    for name in
        ["bytes a triangle, low memory", "build by the CPU, fast trace", "refit of what the GPU built"]
    {
        assert_positive(structures, name, 0..1);
    }
}

#[test]
fn a_frame_is_timed_by_both_hands_and_renders_the_same_image() {
    let table = parse_table(&["overhead", "--quick"]);
    if table.contains("not measured") {
        return eprintln!("NOT TESTED, no ray tracing pipelines");
    }
    for name in ["trace (GPU)", "record and submit (CPU)", "until done"] {
        assert_positive(&table, name, 0..3);
    }
    assert_eq!(columns_of_row(&table, "pixels that differ")[1], "0 of 576");
}

#[test]
fn the_papers_experiment_writes_its_report() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("made/report");
    let size = ["--width", "32", "--height", "18", "--frames", "2", "--depth", "1"];
    let table = parse_table(&[&["paper", "--quick", "--out", out.to_str().unwrap()], &size[..]].concat());
    assert!(table.contains("| courtyard, "), "{table}");
    let page = std::fs::read_to_string(out.join("report.md")).unwrap();
    assert!(page.contains("--width 32") && page.contains("a rehearsal"), "{page}");
    assert!(!page.contains(folder.path().to_str().unwrap()), "folders are everybody's own");
}

/// The experiment in its smallest form by this path: its table, and its folder; `None`, loudly, where the device lacks
/// the path.
fn small_paper(rt: &str) -> Option<(String, tempfile::TempDir)> {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().to_str().unwrap();
    let size = ["--width", "64", "--height", "36", "--frames", "1", "--depth", "2"];
    let args = [&["paper", "--quick", "--validate", "--rt", rt, "--out", out], &size[..]].concat();
    let (status, table, err) = outcome(&args);
    if status == Some(1) && (err.contains("has no ray queries") || err.contains("neither by pipeline")) {
        eprintln!("NOT TESTED, {err}");
        return None;
    }
    assert_eq!(status, Some(0), "{args:?}: {table}{err}");
    Some((table, folder))
}

#[test]
fn the_papers_experiment_in_software_says_so_and_renders_the_same() {
    let (table, software) = small_paper("software").unwrap();
    assert!(table.contains("| courtyard, software query "), "{table}");
    let text = |name: &str| std::fs::read_to_string(software.path().join(name)).unwrap();
    let page = text("report.md");
    assert!(page.contains("in software (software was asked for)"), "{page}");
    assert!(page.contains("## By software query") && !page.contains("by query"), "{page}");
    assert!(text("times.csv").lines().skip(1).all(|line| line.starts_with("courtyard,software query,")));
    assert!(text("times_software_query.svg").contains("by software query"));
    let Some((table, hardware)) = small_paper("query") else { return };
    assert!(table.contains("| courtyard, query "), "{table}");
    for (camera, method) in (1..=5).flat_map(|camera| [(camera, "standalone"), (camera, "hybrid")]) {
        let picture = |folder: &tempfile::TempDir, path: &str| {
            let name = format!("pictures/courtyard_{path}_cam{camera}_{method}.png");
            image::open(folder.path().join(name)).unwrap().into_rgba8()
        };
        let (ours, theirs) = (picture(&software, "software_query"), picture(&hardware, "query"));
        let found = compare(&ours, &theirs, 64, 36).unwrap();
        assert!(found.psnr > 50.0 && found.differing_share < 2e-3, "camera {camera}, {method}: {found:?}");
    }
}

#[test]
fn what_a_device_lacks_is_said_and_no_failure() {
    let without_query = parse_table(&["order", "--quick", "--profile", "no-ray-query"]);
    assert!(without_query.contains("ray queries not measured"), "{without_query}");
    assert!(!without_query.contains("| primary rays by query"), "{without_query}");
    let alone = parse_table(&[
        "queries",
        "--quick",
        "--camera",
        "1",
        "--instances",
        "2",
        "--profile",
        "no-ray-tracing",
    ]);
    assert!(
        alone.contains("ray tracing pipelines not measured") && alone.contains("ray queries not measured"),
        "{alone}"
    );
    assert!(alone.contains("| software, fast trace") && !alone.contains("| pipeline, as given"), "{alone}");
    let without_pipeline = parse_table(&["overhead", "--quick", "--profile", "no-rt-pipeline"]);
    assert!(without_pipeline.contains("not measured"), "{without_pipeline}");
}

#[test]
fn wrong_input_and_no_ray_tracing_have_statuses_of_their_own() {
    let (status, _, err) = outcome(&["order", "--quick", "--scene", "absent.obj"]);
    assert!(status == Some(2) && err.contains("absent.obj"), "{status:?}: {err}");
    let (status, _, err) = outcome(&["split", "--quick", "--profile", "no-ray-tracing"]);
    assert!(status == Some(1) && err.starts_with("error: "), "{status:?}: {err}");
}

#[test]
fn what_the_core_costs_stands_beside_its_limits() {
    let table = parse_table(&["core", "--quick"]);
    assert_positive(&table, "push constants + draw", 0..2);
    assert_positive(&table, "- own share", 0..1);
    assert_positive(&table, "dispatch behind", 0..2);
    assert_positive(&table, "empty submission", 0..2);
    assert!(table.contains("60 ms") && !table.contains("NaN"), "{table}");
}
