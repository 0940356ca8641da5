//! Runs every benchmark of the `bench` program in its smallest form and checks the printed figures.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on has failed")]

use std::process::{Command, Output};

use lvk_samples::app::metrics::compare;

/// Returns the standard output of a successful run without validation messages.
fn table(args: &[&str]) -> String {
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

/// Returns the cells of the row that begins with `name`, without the name.
fn row(table: &str, name: &str) -> Vec<String> {
    let line = table.lines().find(|line| line.trim_start_matches("| ").starts_with(name));
    let line = line.unwrap_or_else(|| panic!("no row '{name}' in\n{table}"));
    let cells: Vec<String> = line.split('|').skip(2).map(|cell| cell.trim().to_owned()).collect();
    cells[..cells.len() - 1].to_vec()
}

/// Returns the number of a cell without its unit. A difference may be negative.
fn number(cell: &str) -> f64 {
    let digits: String = cell.chars().take_while(|c| c.is_ascii_digit() || "-.,".contains(*c)).collect();
    digits.replace(',', "").parse().unwrap_or_else(|_| panic!("no number in '{cell}'"))
}

fn assert_positive(table: &str, name: &str, cells: std::ops::Range<usize>) {
    for cell in &row(table, name)[cells] {
        let value = number(cell);
        assert!(value > 0.0 && value.is_finite(), "{name}: {cell} in\n{table}");
    }
}

#[test]
fn a_batch_is_timed_and_its_scratch_memory_within_the_budget() {
    let table = table(&["batch", "--quick"]);
    for name in ["one batch", "one submission and wait per mesh", "one batch, scratch budget"] {
        assert_positive(&table, name, 0..2);
    }
    assert_positive(&table, "ratio", 0..1);
    for name in ["peak scratch memory ", "peak scratch memory, small budget"] {
        assert!(number(&row(&table, name)[1]) <= 100.0, "{table}");
    }
}

#[test]
fn cpu_builds_are_timed_phase_by_phase_for_each_number_of_threads() {
    let table = table(&["builds", "--quick", "--threads", "1,2,3"]);
    for name in ["triangles", "Morton order", "clustering", "reinsertion", "encoding", "total"] {
        assert_positive(&table, name, 0..3);
    }
    for cell in row(&table, "peak heap memory, times the BLAS") {
        let ratio = number(&cell);
        assert!(
            (1.0..=3.0).contains(&ratio),
            "a builder holds the BLAS, and at most three times its bytes: {table}"
        );
    }
    assert!(table.contains("| 1 thread |") && table.contains("| 3 threads |"), "{table}");
    assert!(table.contains("all builds made the same bytes"), "{table}");
    for builder in ["lvk", "obvhs"] {
        assert!(table.contains(&format!("tree of {builder}: SAH cost")), "{table}");
    }
    assert!(table.contains(" bounce rays, each ") && !table.contains("WITH OTHER HITS"), "{table}");
    let (status, _, err) = outcome(&["builds", "--quick", "--threads", "0"]);
    assert!(status == Some(2) && err.contains("--threads"), "{err}");
    let (status, _, err) = outcome(&["builds", "--quick", "--embree", "no-such-library.so"]);
    assert!(
        status == Some(2) && err.contains("no-such-library.so") && err.contains("libembree-dev"),
        "{err}"
    );
}

#[test]
fn blas_of_low_memory_are_built_by_the_same_phases() {
    let [usual, low] = [&[][..], &["--low-memory"]].map(|flags| {
        let table = table(&[&["builds", "--quick", "--threads", "1,2"], flags].concat());
        assert_positive(&table, "encoding", 0..2);
        assert!(table.contains("all builds made the same bytes"), "{table}");
        let bytes = table.lines().find_map(|line| line.strip_prefix("- bytes of the BLAS: "));
        number(bytes.unwrap_or_else(|| panic!("{table}")))
    });
    assert!(low < 0.6 * usual, "{low} of {usual} bytes");
}

#[test]
#[ignore = "needs Embree: .ci/slow embree"]
fn builds_are_compared_with_those_of_embree() {
    let library = std::env::var("LVK_EMBREE").unwrap();
    let table = table(&["builds", "--quick", "--threads", "1,2", "--embree", &library]);
    for name in [
        "total of Embree, medium quality",
        "total of Embree, high quality",
        "rtcBuildBVH of Embree, medium quality",
        "tree of Embree, medium: SAH cost",
    ] {
        assert!(table.contains(name), "{name}: {table}");
    }
    assert!(table.contains(" bounce rays, each ") && !table.contains("WITH OTHER HITS"), "{table}");
}

#[test]
fn builds_and_sizes_are_compared_with_hand_written_vulkan() {
    let table = table(&["compaction", "--quick"]);
    for name in
        ["build, fast trace", "build, fast build", "rebuild, updates allowed", "refit", "before compaction"]
    {
        assert_positive(&table, name, 0..3);
    }
    let [before, after] =
        ["before compaction ", "after compaction "].map(|name| number(&row(&table, name)[0]));
    assert!(after <= before, "{table}");
    let freed = number(&row(&table, "freed to the allocator")[0]);
    assert!(
        (freed - (before - after)).abs() < 1.0,
        "the allocator gets back the memory that compaction saves\n{table}"
    );
}

#[test]
fn a_split_mesh_renders_the_same_image() {
    let table = table(&["split", "--quick", "--parts", "12"]);
    let head = table.lines().find(|line| line.contains(" parts |")).unwrap();
    let parts = number(head.split('|').nth(3).unwrap().trim());
    assert!(parts >= 12.0, "{table}");
    let traced = table.lines().filter(|line| line.starts_with("| primary rays by")).count();
    assert!(traced > 0, "{table}");
    for line in table.lines().filter(|line| line.starts_with("| differing pixels")) {
        assert!(line.contains(" 0 of 576 "), "{table}");
    }
}

#[test]
fn tlas_updates_are_timed_for_every_requested_instance_count() {
    let table = table(&["tlas", "--quick", "--instances", "1", "--instances", "300"]);
    for count in ["1", "300"] {
        for mode in ["rebuild", "refit"] {
            for what in ["plain copy + driver", "lvk, from the host", "lvk, from a buffer"] {
                assert_positive(&table, &format!("{mode} of {count}: {what}"), 1..6);
            }
        }
    }
}

#[test]
fn growth_is_measured_for_every_group_and_plotted() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("made/growth");
    let text = table(&["growth", "--quick", "--out", out.to_str().unwrap()]);
    let rows = |table: &str| {
        let lines = table.lines().filter(|line| line.starts_with("| "));
        lines.map(|line| line.split('|').nth(1).unwrap().trim().to_owned()).collect::<Vec<_>>()
    };
    for (title, expected) in [
        (
            "instances of one TLAS",
            &[
                "created and built, lvk",
                "one moved, refit, lvk",
                "the same rays traced, lvk",
                "the same rays, GPU time, lvk",
            ][..],
        ),
        (
            "textures alive",
            &["create one more", "empty submission and wait", "dispatch with 16 in `Dependencies`, recorded"],
        ),
        (
            "buffers alive",
            &["create one more", "buffer_address of handles at random, each", "VkDeviceMemory objects"],
        ),
        (
            "draws of one pass",
            &[
                "push constants and draw, recorded, each",
                "of it the library, each",
                "the same by hand, recorded, each",
                "the same, recorded, submitted and done, each",
            ],
        ),
        (
            "triangles of one BLAS",
            &[
                "BLAS created and built, lvk",
                "first trace, lvk",
                "traced again, GPU time, lvk",
                "memory of the BLAS, lvk",
            ],
        ),
        ("triangles of a loaded OBJ file", &[]),
    ] {
        let (_, part) = text.split_once(&format!("## growth: {title}")).unwrap_or_else(|| panic!("{text}"));
        let part = part.split_once("\n## ").map_or(part, |(part, _)| part);
        assert!(expected.iter().all(|name| rows(part).iter().any(|row| row == name)), "{part}");
        assert!(part.contains("- constant, where it should be: "), "{part}");
        for line in part.lines().filter(|line| line.starts_with("| ")).skip(1) {
            let cells: Vec<_> = line.split('|').map(str::trim).collect();
            let verdict = cells[cells.len() - 3];
            assert!(["yes", "no", "falls", "-"].contains(&verdict), "{line}");
            let costs = &cells[2..cells.len() - 4];
            assert!(costs.len() == 4 && costs.iter().all(|cost| number(cost) >= 0.0), "{line}");
        }
    }
    let page = std::fs::read_to_string(out.join("growth.md")).unwrap();
    for name in ["instances", "textures", "handles", "handles_count", "draws", "triangles", "triangles_bytes"]
    {
        assert!(page.contains(&format!("({name}.svg)")), "{page}");
        let svg = std::fs::read_to_string(out.join(format!("{name}.svg"))).unwrap();
        assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"), "{name}");
        assert!(svg.matches("<circle").count() >= 4 && !svg.contains("NaN"), "{name}");
    }
    if cfg!(target_os = "linux") {
        assert!(rows(&text).iter().any(|row| row == "resident peak, all of v, vt, vn"), "{text}");
        assert!(text.contains("MB of final data") && page.contains("(loading_times.svg)"), "{text}");
    }
}

#[test]
fn selected_groups_of_growth_are_measured_alone() {
    let draws = table(&["growth", "--quick", "--only", "draws"]);
    assert!(draws.contains("growth: draws") && !draws.contains("growth: buffers"), "{draws}");
    let (status, _, err) = outcome(&["growth", "--quick", "--only", "draws", "--out", "/dev/null/growth"]);
    assert!(status == Some(2) && err.contains("/dev/null/growth"), "{status:?}: {err}");
    let (status, _, err) = outcome(&["growth", "--load", "absent.obj"]);
    assert!(status == Some(2) && err.contains("absent.obj"), "{status:?}: {err}");
}

#[test]
fn orders_are_timed_and_render_the_same_image() {
    let table = table(&["order", "--quick"]);
    assert!(table.lines().any(|line| line.starts_with("| primary rays by")), "{table}");
    for line in table.lines().filter(|line| line.starts_with("| differing pixels")) {
        assert!(line.contains(" 0 |"), "{table}");
    }
}

#[test]
fn queries_in_software_are_timed_and_agree_with_the_devices_pipeline() {
    let tables = table(&["queries", "--quick", "--camera", "1", "--instances", "5"]);
    let [rates, chunks, agreement, structures]: [&str; 4] =
        tables.split("\n##").collect::<Vec<_>>().try_into().unwrap_or_else(|_| panic!("{tables}"));
    for name in ["software, fast trace", "software, low memory", "software, fast build"] {
        assert_positive(rates, name, 0..1);
    }
    assert!(chunks.contains("As 5 overlapping instances"), "{chunks}");
    assert_positive(chunks, "software, fast trace", 0..1);
    for line in agreement.lines().filter(|line| line.starts_with("| software")) {
        for share in line.split('|').skip(2).filter(|cell| cell.contains('%')) {
            assert!(number(share.trim()) > 99.0, "{agreement}");
        }
    }
    for name in ["bytes per triangle, low memory", "CPU build, fast trace", "GPU refit of a GPU build"] {
        assert_positive(structures, name, 0..1);
    }
}

#[test]
fn a_frame_is_timed_by_lvk_and_by_hand_and_renders_the_same_image() {
    let table = table(&["overhead", "--quick"]);
    if table.contains("not measured") {
        return eprintln!("NOT TESTED, no ray tracing pipelines");
    }
    for name in ["trace (GPU)", "record and submit (CPU)", "until the GPU is done"] {
        assert_positive(&table, name, 0..4);
    }
    assert_eq!(row(&table, "differing pixels")[1], "0 of 576");
}

#[test]
fn the_papers_experiment_writes_its_report() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("made/report");
    let size = ["--width", "32", "--height", "18", "--frames", "2", "--depth", "1"];
    let table = table(&[&["paper", "--quick", "--out", out.to_str().unwrap()], &size[..]].concat());
    assert!(table.contains("| courtyard, "), "{table}");
    let page = std::fs::read_to_string(out.join("report.md")).unwrap();
    assert!(page.contains("--width 32") && page.contains("a smoke test"), "{page}");
    assert!(!page.contains(folder.path().to_str().unwrap()), "the report contains no private folder");
}

/// Runs the experiment in its smallest form by this path. Returns its table and folder; prints a message and returns `None` if
/// the device lacks the path.
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
fn the_papers_experiment_in_software_names_the_path_and_renders_the_same() {
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
fn lowered_pipelines_are_timed_beside_those_of_the_driver() {
    let with_driver = table(&["lowered", "--quick"]);
    let without = table(&["lowered", "--quick", "--profile", "no-ray-tracing"]);
    for what in ["the driver's pipelines", "pipelines lowered to ray queries"] {
        assert!(without.contains(&format!("{what} not measured")), "{without}");
    }
    for name in ["hybrid", "rtx_hello"] {
        for cell in [0, 1, 3, 4, 5] {
            assert_positive(&with_driver, name, cell..cell + 1);
            assert_positive(&with_driver, &format!("{name}, rays"), cell..cell + 1);
        }
        assert_positive(&without, name, 1..2);
        assert_positive(&without, name, 3..4);
        let cells = row(&without, name);
        assert!(cells[0].is_empty() && cells[2].is_empty() && cells[4].is_empty(), "{without}");
    }
    let triangle = row(&with_driver, "triangle, 640x480, until done");
    assert!(
        number(&triangle[0]) > 0.0 && triangle[3].is_empty() && number(&triangle[4]) > 0.0,
        "{with_driver}"
    );
}

#[test]
fn a_missing_feature_is_reported_and_no_failure() {
    let without_query = table(&["order", "--quick", "--profile", "no-ray-query"]);
    assert!(without_query.contains("ray queries not measured"), "{without_query}");
    assert!(!without_query.contains("| primary rays by query"), "{without_query}");
    let alone =
        table(&["queries", "--quick", "--camera", "1", "--instances", "2", "--profile", "no-ray-tracing"]);
    assert!(
        alone.contains("ray tracing pipelines not measured") && alone.contains("ray queries not measured"),
        "{alone}"
    );
    assert!(
        alone.contains("| software, fast trace") && !alone.contains("| pipeline, given order"),
        "{alone}"
    );
    let without_pipeline = table(&["overhead", "--quick", "--profile", "no-rt-pipeline"]);
    assert!(without_pipeline.contains("not measured"), "{without_pipeline}");
}

#[test]
fn wrong_input_and_no_ray_tracing_have_different_exit_statuses() {
    let (status, _, err) = outcome(&["order", "--quick", "--scene", "absent.obj"]);
    assert!(status == Some(2) && err.contains("absent.obj"), "{status:?}: {err}");
    let (status, _, err) = outcome(&["split", "--quick", "--profile", "no-ray-tracing"]);
    assert!(status == Some(1) && err.lines().any(|line| line.starts_with("error: ")), "{status:?}: {err}");
}

#[test]
fn every_row_is_done_by_lvk_and_by_plain_ash_with_equal_results() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("peers.md");
    let table =
        table(&["peers", "--quick", "--width", "40", "--height", "20", "--out", out.to_str().unwrap()]);
    assert_eq!(std::fs::read_to_string(&out).unwrap(), table);
    for name in
        ["context created", "empty submission", "buffer created", "texture created", "resident memory"]
    {
        assert_positive(&table, name, 1..3);
    }
    for name in ["50 draws", "20 dispatches", "12 uploads", "frame with 12 textures"] {
        assert_positive(&table, name, 1..3);
    }
    let gpu_times: Vec<_> = table.lines().filter(|line| line.contains("|  GPU |")).collect();
    let has_time = |line: &&str| {
        line.split('|')
            .skip(3)
            .take(2)
            .all(|cell| cell.trim().split(' ').next().and_then(|time| time.parse().ok()) > Some(0.0))
    };
    assert!(gpu_times.len() >= 6 && gpu_times.iter().all(has_time), "{table}");
    assert!(table.contains("textures: equal") && table.contains("| 40x20 rays by query "), "{table}");
    for reason in
        table.lines().filter(|line| line.starts_with("- ash cannot") || line.starts_with("- lvk cannot"))
    {
        assert!(reason.contains("the device has no"), "{table}");
    }
    let one = self::table(&["peers", "--quick", "--rows", "submit", "--peers", "lvk", "--runs", "1"]);
    assert!(!one.contains("draws") && !one.contains("lvk-sw"), "{one}");
}

#[test]
fn errors_of_the_comparison_name_their_cause() {
    let (status, _, err) = outcome(&["peers", "--quick", "--device", "0"]);
    assert!(status == Some(2) && err.contains("VK_DRIVER_FILES"), "{status:?}: {err}");
    let (status, _, err) = outcome(&["peers", "--quick", "--peers", "gfx"]);
    assert!(
        status == Some(1) && err.contains("no peer 'gfx'") && err.contains("ash, lvk"),
        "{status:?}: {err}"
    );
    let (status, _, err) = outcome(&["peers", "--quick", "--rows", "submit", "--out", "/absent/peers.md"]);
    assert!(status == Some(1) && err.contains("cannot write /absent/peers.md"), "{status:?}: {err}");
    let absent = ["peers", "--quick", "--rows", "ray-query", "--scene", "absent.obj", "--runs", "1"];
    let (status, out, err) = outcome(&absent);
    assert!(status == Some(0) && out.contains("absent.obj"), "{status:?}: {out}{err}");
}

#[test]
fn cpu_overhead_is_compared_with_its_limits() {
    let table = table(&["core", "--quick"]);
    assert_positive(&table, "push constants + draw", 0..2);
    assert_positive(&table, "- library share", 0..1);
    assert_positive(&table, "dispatch after", 0..2);
    for part in ["frame of one dispatch: command buffer", "- the same: commands", "- the same: submission"] {
        assert_positive(&table, part, 0..2);
    }
    assert_positive(&table, "empty submission", 0..2);
    assert_positive(&table, "resident memory with the first context", 0..1);
    assert_positive(&table, "TLAS refit recorded", 0..1);
    assert_positive(&table, "- first refit of each of 16 TLAS", 0..1);
    for of_objects in
        ["buffer created + destroyed", "texture created + destroyed", "texture created among 60"]
    {
        assert_positive(&table, of_objects, 0..2);
    }
    assert_positive(&table, "50 uploads of 4 KiB", 0..2);
    for counted in ["heap allocations per draw", "heap allocations per frame"] {
        assert!(number(&row(&table, counted)[0]) < 1.0, "{table}");
    }
    assert!(table.contains("60 ms") && !table.contains("NaN"), "{table}");
}

#[test]
fn the_core_is_measured_with_one_queue_too() {
    let table = table(&["core", "--quick", "--single-queue"]);
    for name in [
        "push constants + draw",
        "dispatch after",
        "frame of one dispatch: command buffer",
        "empty submission",
    ] {
        assert_positive(&table, name, 0..2);
    }
    assert!(!table.contains("NaN"), "{table}");
}

#[test]
fn images_are_compared_by_three_measures() {
    let folder = tempfile::tempdir().unwrap();
    let [ramp, other] = [("ramp.png", 0), ("other.png", 40)].map(|(name, more)| {
        let path = folder.path().join(name);
        let picture =
            image::RgbImage::from_fn(64, 32, |x, y| image::Rgb([(x * 3) as u8, (y * 5) as u8, more]));
        picture.save(&path).unwrap();
        path
    });
    let compare = |paths: [&std::path::Path; 2]| {
        let output = std::process::Command::new(env!("CARGO_BIN_EXE_compare")).args(paths).output().unwrap();
        (
            output.status.code(),
            String::from_utf8(output.stdout).unwrap() + &String::from_utf8(output.stderr).unwrap(),
        )
    };
    let (status, same) = compare([&ramp, &ramp]);
    assert!(status == Some(0) && same.contains("SSIM 1.00000") && same.ends_with("FLIP 0.0000\n"), "{same}");
    let (status, differs) = compare([&ramp, &other]);
    let flip = differs.trim_end().rsplit_once("FLIP ").and_then(|(_, flip)| flip.parse::<f64>().ok());
    assert!(status == Some(0) && flip.is_some_and(|flip| (0.01..0.5).contains(&flip)), "{differs}");
    let (status, error) = compare([&ramp, &folder.path().join("absent.png")]);
    assert!(status == Some(2) && error.contains("absent.png"), "{error}");
}
