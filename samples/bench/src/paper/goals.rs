//! The goals of the hybrid method, and the measured values.

use super::measure::{CameraResult, SceneResult};
use super::published::PublishedScene;
use super::tables::decibels;
use super::times::{Statistic, Times};
use super::trace_path::TracePath;
use crate::table::Table;

/// Maximum average t/T.
pub(super) const AVERAGE_RATIO: f64 = 0.75;
/// Maximum t/T of a camera.
const CELL_RATIO: f64 = 1.0;
/// Maximum ratio of the worst frame to the average frame.
const WORST_OVER_AVERAGE: f64 = 1.5;
/// Minimum SSIM between both methods.
const SSIM: f64 = 0.999;
/// Maximum share of differing pixels.
const DIFFERING_SHARE: f64 = 0.0002;
/// Minimum PSNR between two paths, in dB.
const PATHS_PSNR: f64 = 50.0;

/// A goal and its measured value.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Goal {
    what: String,
    found: String,
    is_met: bool,
}

/// Returns the table of all goals of the measured paths.
pub(super) fn table(scenes: &[SceneResult], paths: &[TracePath]) -> Table {
    let mut table = Table::new("## Goals".to_owned(), &["goal", "measured", "met"]);
    for goal in
        paths.iter().flat_map(|&path| path_goals(scenes, path)).chain(path_agreement_goal(scenes, paths))
    {
        table.add_row(goal.what, [goal.found, if goal.is_met { "yes" } else { "no" }.to_owned()]);
    }
    table
}

fn path_goals(scenes: &[SceneResult], path: TracePath) -> Vec<Goal> {
    let name = path.name();
    let cells: Vec<(&SceneResult, &CameraResult)> =
        scenes.iter().flat_map(|scene| scene.cameras_by(path).map(move |cell| (scene, cell))).collect();
    let below = |what: &str, limit: f64, number: &dyn Fn(&SceneResult, &CameraResult) -> f64, unit: Unit| {
        let (found, at) = worst(&cells, |scene, cell| number(scene, cell));
        Goal {
            what: format!("{name}: {what} at most {}", unit.text(limit)),
            found: format!("{}{at}", unit.text(found)),
            is_met: found <= limit,
        }
    };
    let average = |cell: &CameraResult| Statistic::Average.evaluate(&cell.frames);
    vec![
        average_ratio("t/T", scenes, path, Times::ratio),
        average_ratio("t/T of whole frames as one span", scenes, path, Times::span_ratio),
        below("t/T of every camera", CELL_RATIO, &|_, cell| average(cell).ratio(), Unit::Percent),
        below(
            "worst frame over the average",
            WORST_OVER_AVERAGE,
            &|_, cell| Statistic::WORST.evaluate(&cell.frames).hybrid() / average(cell).hybrid(),
            Unit::Times,
        ),
        below(
            "share of differing pixels",
            DIFFERING_SHARE,
            &|_, cell| cell.metrics.differing_share,
            Unit::Share,
        ),
        lowest_ssim(name, &cells),
        psnr_margin(name, &cells),
    ]
}

/// Unit of a number in the table.
#[derive(Debug, Clone, Copy)]
enum Unit {
    Percent,
    Share,
    Times,
}

impl Unit {
    fn text(self, value: f64) -> String {
        match self {
            Self::Percent => format!("{:.1} %", 100.0 * value),
            Self::Share => format!("{:.4} %", 100.0 * value),
            Self::Times => format!("{value:.2}x"),
        }
    }
}

/// Returns the largest number of all cameras, and the name of that camera.
fn worst(
    cells: &[(&SceneResult, &CameraResult)],
    number: impl Fn(&SceneResult, &CameraResult) -> f64,
) -> (f64, String) {
    let numbers = cells.iter().map(|(scene, cell)| (number(scene, cell), scene, cell));
    let found = numbers.max_by(|a, b| a.0.total_cmp(&b.0));
    found.map_or((f64::NAN, String::new()), |(value, scene, cell)| {
        (value, format!(" ({} cam {})", scene.name, cell.camera + 1))
    })
}

/// Returns the goal of an average ratio. All scenes have equal weight.
fn average_ratio(what: &str, scenes: &[SceneResult], path: TracePath, ratio: fn(&Times) -> f64) -> Goal {
    let ratios = scenes.iter().map(|scene| ratio(&scene.mean(path, Statistic::Average)));
    let found = ratios.sum::<f64>() / scenes.len().max(1) as f64;
    let (name, limit) = (path.name(), Unit::Percent.text(AVERAGE_RATIO));
    Goal {
        what: format!("{name}: {what} on average at most {limit}"),
        found: Unit::Percent.text(found),
        is_met: found <= AVERAGE_RATIO,
    }
}

fn lowest_ssim(name: &str, cells: &[(&SceneResult, &CameraResult)]) -> Goal {
    let (found, at) = worst(cells, |_, cell| -cell.metrics.ssim);
    Goal {
        what: format!("{name}: SSIM of both methods at least {SSIM}"),
        found: format!("{:.5}{at}", -found),
        is_met: -found >= SSIM,
    }
}

/// Returns the goal of PSNR above the paper's average for the scene, or for all its scenes if the scene is not in the paper.
fn psnr_margin(name: &str, cells: &[(&SceneResult, &CameraResult)]) -> Goal {
    let margin = |scene: &SceneResult, cell: &CameraResult| {
        let published = PublishedScene::find(&scene.name);
        cell.metrics.psnr - published.map_or(MEAN_PSNR, |theirs| theirs.mean_metrics().0)
    };
    let (found, at) = worst(cells, |scene, cell| -margin(scene, cell));
    Goal {
        what: format!(
            "{name}: PSNR of both methods above the paper's average for the scene, on every camera"
        ),
        found: match -found {
            margin if margin.is_finite() => format!("{margin:+.2} dB{at}"),
            _ => "equal images".to_owned(),
        },
        is_met: -found > 0.0,
    }
}

/// The paper's average PSNR over its scenes, in dB.
const MEAN_PSNR: f64 = 46.71;

fn path_agreement_goal(scenes: &[SceneResult], paths: &[TracePath]) -> Option<Goal> {
    let [first, second, ..] = paths else { return None };
    let metrics = scenes.iter().flat_map(|scene| &scene.path_metrics);
    let lowest = metrics.flat_map(|(a, b)| [a.psnr, b.psnr]).reduce(f64::min)?;
    Some(Goal {
        what: format!("{} and {}: PSNR at least {PATHS_PSNR} dB", first.name(), second.name()),
        found: decibels(lowest),
        is_met: lowest >= PATHS_PSNR,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper::ImageMetrics;

    fn scene(name: &str, standalone: f64, psnr: f64) -> SceneResult {
        let alike = ImageMetrics { psnr, lowest_psnr: psnr, ssim: 0.9995, differing_share: 1e-4 };
        let spans = Times { standalone_span: standalone, hybrid_span: 0.7, ..Times::default() };
        let frames = vec![Times { standalone, rays: 0.4, geometry: 0.2, ..spans }; 3];
        let cells = (0..5).map(|camera| CameraResult {
            path: TracePath::Query,
            camera,
            frames: frames.clone(),
            metrics: alike,
        });
        let cells = cells.collect();
        SceneResult {
            name: name.to_owned(),
            vertices: 3,
            triangles: 1,
            cells,
            rasterisers: Vec::new(),
            path_metrics: Vec::new(),
        }
    }

    fn missed(scenes: &[SceneResult]) -> Vec<String> {
        let goals = path_goals(scenes, TracePath::Query).into_iter().filter(|goal| !goal.is_met);
        goals.map(|goal| goal.what).collect()
    }

    #[test]
    fn every_goal_can_be_missed() {
        assert_eq!(missed(&[scene("courtyard", 1.0, 60.0)]), [""; 0]);
        assert!(missed(&[scene("courtyard", 0.7, 60.0)])[0].contains("on average"));
        let slow = missed(&[scene("courtyard", 0.5, 60.0), scene("kitchen", 9.0, 60.0)]);
        assert!(slow.len() == 1 && slow[0].contains("every camera"), "{slow:?}");
        assert!(missed(&[scene("conference", 1.0, 55.0)])[0].contains("PSNR"));
        assert_eq!(missed(&[scene("kitchen", 1.0, 55.0)]), [""; 0]);
        let mut gaps = scene("courtyard", 1.0, 60.0);
        gaps.cells.iter_mut().flat_map(|cell| &mut cell.frames).for_each(|times| times.hybrid_span = 0.8);
        let wide = missed(&[gaps]);
        assert!(wide.len() == 1 && wide[0].contains("one span"), "{wide:?}");
        let mut uneven = scene("courtyard", 1.0, f64::INFINITY);
        uneven.cells[2].frames[1].geometry = 9.0;
        uneven.cells[2].frames[0].standalone = 9.0;
        uneven.cells[1].metrics = ImageMetrics { ssim: 0.9, differing_share: 0.1, ..uneven.cells[1].metrics };
        let missed = missed(&[uneven]);
        assert_eq!(missed.len(), 4, "all but that of each camera's t/T and the PSNR: {missed:?}");
    }
}
