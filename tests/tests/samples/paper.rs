//! The paper's experiment on a tiny scene: it measures everything, and its report is complete and consistent.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::collections::HashMap;
use std::path::Path;

use lvk_samples::app::progress::Progress;
use lvk_samples::bench::paper::{
    CAMERA_COUNT, Experiment, PICTURES, Pictures, Plan, Statistic, TracePath, measure,
};
use lvk_tests::device;
use lvk_tests::hybrid::paths;
use lvk_tests::scene_obj::obj_scene;

const SIZE: [u32; 2] = [96, 54];
const FRAMES: u32 = 3;

/// The experiment on a scene that bears the name of one of the paper's.
fn experiment(folder: &Path) -> Option<Experiment> {
    let ctx = device()?;
    let mut scene = obj_scene();
    scene.name = "conference".to_owned();
    let paths = paths(&ctx).into_iter().map(|path| TracePath::of(path, ctx.capabilities())).collect();
    let plan = Plan { size: SIZE, frames: FRAMES, runs: 1, warm_up: 0, compared: 2, max_depth: 2, paths };
    let images = Pictures::new(&folder.join(PICTURES), SIZE).unwrap();
    let found = measure(&ctx, &scene, &plan, &images, &mut Progress::hidden()).unwrap();
    let mut experiment = Experiment::new(ctx.capabilities(), "bench paper".to_owned(), plan);
    experiment.scenes.push(found);
    experiment.write(folder).unwrap();
    Some(experiment)
}

/// The lines of a CSV file as values by the names of their columns.
fn csv(path: &Path) -> Vec<HashMap<String, String>> {
    let text = std::fs::read_to_string(path).unwrap();
    let mut lines = text.lines();
    let head: Vec<&str> = lines.next().unwrap().split(',').collect();
    let row = |line: &str| {
        let values: Vec<&str> = line.split(',').collect();
        assert_eq!(values.len(), head.len(), "{line}");
        head.iter().zip(values).map(|(name, value)| ((*name).to_owned(), value.to_owned())).collect()
    };
    lines.map(row).collect()
}

fn number(row: &HashMap<String, String>, name: &str) -> f64 {
    row[name].parse().unwrap()
}

#[test]
fn the_experiment_measures_everything_and_reports_it() {
    let folder = tempfile::tempdir().unwrap();
    let Some(experiment) = experiment(folder.path()) else { return };
    let path_count = experiment.plan.paths.len();
    let cells = CAMERA_COUNT * path_count;

    let frames = csv(&folder.path().join("frames.csv"));
    assert_eq!(frames.len(), cells * FRAMES as usize);
    for frame in &frames {
        let [rays, geometry, hybrid] = ["t_a_ms", "t_b_ms", "t_ms"].map(|name| number(frame, name));
        assert!((rays + geometry - hybrid).abs() < 2e-6, "{frame:?}");
        assert!(rays > 0.0 && geometry > 0.0 && number(frame, "T_ms") > 0.0, "{frame:?}");
        assert_spans_hold_passes(frame);
    }
    let times = csv(&folder.path().join("times.csv"));
    assert_eq!(times.len(), cells * 5);
    for cell in times.chunks(5) {
        let of = |statistic: &str| cell.iter().find(|row| row["statistic"] == statistic).unwrap();
        for name in ["T_ms", "t_ms"] {
            let [best, average, median, worst] =
                ["best", "average", "median", "worst"].map(|statistic| number(of(statistic), name));
            assert!(best <= median && median <= worst && best <= average && average <= worst, "{cell:?}");
        }
        for row in cell {
            let sum = number(row, "t_a_ms") + number(row, "t_b_ms");
            assert!((sum - number(row, "t_ms")).abs() < 2e-6, "{row:?}");
            assert!((sum / number(row, "T_ms") - number(row, "t_over_T")).abs() < 1e-4, "{row:?}");
            let spans = number(row, "t_span_ms") / number(row, "T_span_ms");
            assert!((spans - number(row, "t_span_over_T_span")).abs() < 1e-4, "{row:?}");
            assert_spans_hold_passes(row);
        }
    }
    assert_report_is_whole(folder.path(), &experiment);
    assert_images_are_similar(folder.path(), &experiment);
}

/// A span is at least as long as its passes, up to rounding.
fn assert_spans_hold_passes(row: &HashMap<String, String>) {
    for (span, passes) in [("T_span_ms", "T_ms"), ("t_span_ms", "t_ms")] {
        assert!(number(row, span) >= number(row, passes) - 2e-6, "{row:?}");
    }
}

fn assert_report_is_whole(folder: &Path, experiment: &Experiment) {
    let page = std::fs::read_to_string(folder.join("report.md")).unwrap();
    let path_count = experiment.plan.paths.len();
    for camera in 1..=CAMERA_COUNT {
        // In tables 2 to 7 and in those of the spans and of the spread, by each path, and once where paths are compared.
        let rows = page.matches(&format!("\n| conference cam {camera} ")).count();
        assert_eq!(rows, 8 * path_count + usize::from(path_count > 1), "camera {camera}");
    }
    for what in [
        "## Goals",
        "### Whole frames as one span",
        "t span/T span",
        "### Table 8",
        "RX 6600 (paper)",
        " 61.35 |",
        "1,338,208",
        &experiment.device,
    ] {
        assert!(page.contains(what), "{what} is not in the report");
    }
    let mut linked = 0;
    for link in page.split("](").skip(1).map(|rest| rest.split(')').next().unwrap()) {
        assert!(folder.join(link).is_file(), "{link} is not there");
        linked += 1;
    }
    assert_eq!(linked, 1 + path_count * 3);
}

fn assert_images_are_similar(folder: &Path, experiment: &Experiment) {
    let scene = &experiment.scenes[0];
    for cell in &scene.cells {
        let alike = &cell.likeness;
        // The goals of the experiment.
        assert!(alike.psnr >= 60.0 && alike.lowest_psnr >= 60.0, "{alike:?}");
        assert!(alike.ssim >= 0.999 && alike.ssim <= 1.0 + 1e-9, "{alike:?}");
        assert!(alike.differing_share < 2e-4, "{alike:?}");
        assert!(Statistic::WORST.of(&cell.frames).hybrid() > 0.0);
    }
    for (path, choice) in &scene.rasterisers {
        assert!(experiment.plan.paths.contains(path) && choice.contains("rasteriser ("), "{choice}");
    }
    for (standalone, hybrid) in &scene.paths_alike {
        assert!(standalone.psnr >= 50.0 && hybrid.psnr >= 50.0, "{standalone:?} {hybrid:?}");
    }
    for path in &experiment.plan.paths {
        let name = path.file_name();
        let file = |what: &str| folder.join(PICTURES).join(format!("conference_{name}_cam3_{what}.png"));
        let image = |what: &str| image::open(file(what)).unwrap().into_rgba8();
        let (standalone, difference) = (image("standalone"), image("difference"));
        assert_eq!((standalone.dimensions(), difference.dimensions()), ((96, 54), (98, 56)));
        let white = difference.pixels().filter(|pixel| pixel.0 == [255; 4]).count();
        assert!(white > 96 * 54 / 2, "only {white} pixels are equal");
        assert!(standalone.pixels().any(|pixel| pixel.0 != standalone.get_pixel(0, 0).0), "an empty picture");
    }
}
