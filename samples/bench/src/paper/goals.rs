//! What the hybrid method is to reach, and whether it does.

use super::super::table::Table;
use super::measured::{Cell, SceneResult};
use super::published::PublishedScene;
use super::tables::decibels;
use super::times::{Statistic, Times};
use super::trace_path::TracePath;

/// Largest t/T on average.
pub(super) const AVERAGE_RATIO: f64 = 0.75;
/// Largest t/T of a camera.
const CELL_RATIO: f64 = 1.0;
/// Largest time of the worst frame over the average.
const WORST_OVER_AVERAGE: f64 = 1.5;
/// Least SSIM of both methods.
const SSIM: f64 = 0.999;
/// Largest share of pixels that differ.
const DIFFERING_SHARE: f64 = 0.0002;
/// Least PSNR between two paths, in dB.
const PATHS_PSNR: f64 = 50.0;

/// A goal, what was measured, and whether that is enough.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Goal {
    what: String,
    found: String,
    is_met: bool,
}

/// All goals of the paths that were measured.
pub(super) fn table(scenes: &[SceneResult], paths: &[TracePath]) -> Table {
    let mut table = Table::new("## Goals".to_owned(), &["goal", "measured", "met"]);
    for goal in paths.iter().flat_map(|&path| of_path(scenes, path)).chain(paths_agree(scenes, paths)) {
        table.row(goal.what, [goal.found, if goal.is_met { "yes" } else { "no" }.to_owned()]);
    }
    table
}

fn of_path(scenes: &[SceneResult], path: TracePath) -> Vec<Goal> {
    let name = path.name();
    let cells: Vec<(&SceneResult, &Cell)> =
        scenes.iter().flat_map(|scene| scene.of(path).map(move |cell| (scene, cell))).collect();
    let below = |what: &str, limit: f64, number: &dyn Fn(&SceneResult, &Cell) -> f64, unit: Unit| {
        let (found, at) = worst(&cells, |scene, cell| number(scene, cell));
        Goal {
            what: format!("{name}: {what} at most {}", unit.text(limit)),
            found: format!("{}{at}", unit.text(found)),
            is_met: found <= limit,
        }
    };
    let average = |cell: &Cell| Statistic::Average.of(&cell.frames);
    vec![
        average_ratio("t/T", scenes, path, Times::ratio),
        average_ratio("t/T of whole frames as one span", scenes, path, Times::span_ratio),
        below("t/T of every camera", CELL_RATIO, &|_, cell| average(cell).ratio(), Unit::Percent),
        below(
            "worst frame over the average",
            WORST_OVER_AVERAGE,
            &|_, cell| Statistic::WORST.of(&cell.frames).hybrid() / average(cell).hybrid(),
            Unit::Times,
        ),
        below(
            "share of differing pixels",
            DIFFERING_SHARE,
            &|_, cell| cell.likeness.differing_share,
            Unit::Share,
        ),
        lowest_ssim(name, &cells),
        psnr_margin(name, &cells),
    ]
}

/// How a number is written.
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

/// The largest number of all cells, and where it is.
fn worst(cells: &[(&SceneResult, &Cell)], number: impl Fn(&SceneResult, &Cell) -> f64) -> (f64, String) {
    let numbers = cells.iter().map(|(scene, cell)| (number(scene, cell), scene, cell));
    let found = numbers.max_by(|a, b| a.0.total_cmp(&b.0));
    found.map_or((f64::NAN, String::new()), |(value, scene, cell)| {
        (value, format!(" ({} cam {})", scene.name, cell.camera + 1))
    })
}

/// Every scene counts as much as any other, however long it takes.
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

fn lowest_ssim(name: &str, cells: &[(&SceneResult, &Cell)]) -> Goal {
    let (found, at) = worst(cells, |_, cell| -cell.likeness.ssim);
    Goal {
        what: format!("{name}: SSIM of both methods at least {SSIM}"),
        found: format!("{:.5}{at}", -found),
        is_met: -found >= SSIM,
    }
}

/// PSNR against the average that the paper has for the scene, where it has one, else for all its scenes.
fn psnr_margin(name: &str, cells: &[(&SceneResult, &Cell)]) -> Goal {
    let margin = |scene: &SceneResult, cell: &Cell| {
        let published = PublishedScene::named(&scene.name);
        cell.likeness.psnr - published.map_or(MEAN_PSNR, |theirs| theirs.mean_likeness().0)
    };
    let (found, at) = worst(cells, |scene, cell| -margin(scene, cell));
    Goal {
        what: format!(
            "{name}: PSNR of both methods above the paper's average for the scene, on every camera"
        ),
        found: match -found {
            margin if margin.is_finite() => format!("{margin:+.2} dB{at}"),
            _ => "equal pictures".to_owned(),
        },
        is_met: -found > 0.0,
    }
}

/// The paper's average over its scenes, in dB.
const MEAN_PSNR: f64 = 46.71;

fn paths_agree(scenes: &[SceneResult], paths: &[TracePath]) -> Option<Goal> {
    let [first, second, ..] = paths else { return None };
    let alike = scenes.iter().flat_map(|scene| &scene.paths_alike);
    let lowest = alike.flat_map(|(a, b)| [a.psnr, b.psnr]).reduce(f64::min)?;
    Some(Goal {
        what: format!("{} and {}: PSNR at least {PATHS_PSNR} dB", first.name(), second.name()),
        found: decibels(lowest),
        is_met: lowest >= PATHS_PSNR,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper::Likeness;

    fn scene(name: &str, standalone: f64, psnr: f64) -> SceneResult {
        let alike = Likeness { psnr, lowest_psnr: psnr, ssim: 0.9995, differing_share: 1e-4 };
        let spans = Times { standalone_span: standalone, hybrid_span: 0.7, ..Times::default() };
        let frames = vec![Times { standalone, rays: 0.4, geometry: 0.2, ..spans }; 3];
        let cells = (0..5).map(|camera| Cell {
            path: TracePath::Query,
            camera,
            frames: frames.clone(),
            likeness: alike,
        });
        let cells = cells.collect();
        SceneResult {
            name: name.to_owned(),
            vertices: 3,
            triangles: 1,
            cells,
            rasterisers: Vec::new(),
            paths_alike: Vec::new(),
        }
    }

    fn missed(scenes: &[SceneResult]) -> Vec<String> {
        let goals = of_path(scenes, TracePath::Query).into_iter().filter(|goal| !goal.is_met);
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
        uneven.cells[1].likeness = Likeness { ssim: 0.9, differing_share: 0.1, ..uneven.cells[1].likeness };
        let missed = missed(&[uneven]);
        assert_eq!(missed.len(), 4, "all but that of each camera's t/T and the PSNR: {missed:?}");
    }
}
