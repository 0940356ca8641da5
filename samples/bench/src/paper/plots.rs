//! Which plots the report has.

use super::bar_chart::{Bar, BarChart, Group};
use super::error::PaperError;
use super::goals::AVERAGE_RATIO;
use super::legend::Hue;
use super::line_chart::LineChart;
use super::measured::SceneResult;
use super::published::{self, PublishedScene};
use super::times::{Statistic, Times};
use super::trace_path::TracePath;

// Told apart by those who see no red or green (after Okabe and Ito).
const PIPELINE: Hue = (0, 114, 178);
const QUERY: Hue = (86, 180, 233);
const SOFTWARE_QUERY: Hue = (204, 121, 167);
const PAPER: [Hue; 3] = [(230, 159, 0), (240, 200, 100), (213, 94, 0)];
const STANDALONE: Hue = (120, 120, 120);
const RAYS: Hue = (0, 114, 178);
const GEOMETRY: Hue = (230, 159, 0);
const BLACK: Hue = (0, 0, 0);
const GOAL: Hue = (0, 158, 115);

/// A file of the report.
pub(super) type NamedPlot = (String, String);

/// All plots, as names and contents of files.
pub(super) fn all(scenes: &[SceneResult], paths: &[TracePath]) -> Result<Vec<NamedPlot>, PaperError> {
    let mut plots = vec![("ratio.svg".to_owned(), ratios(scenes, paths).svg()?)];
    for &path in paths {
        plots.push((times_name(path), times(scenes, path).svg()?));
        for scene in scenes {
            plots.push((frames_name(scene, path), frames(scene, path).svg()?));
        }
    }
    Ok(plots)
}

/// File of the bars of a path.
pub(super) fn times_name(path: TracePath) -> String {
    format!("times_{}.svg", path.file_name())
}

/// File of the curves of a scene.
pub(super) fn frames_name(scene: &SceneResult, path: TracePath) -> String {
    format!("frames_{}_{}.svg", scene.name, path.file_name())
}

/// t/T of each camera, beside those of the paper's cards.
fn ratios(scenes: &[SceneResult], paths: &[TracePath]) -> BarChart {
    let mut groups = Vec::new();
    for scene in scenes {
        let published = PublishedScene::named(&scene.name);
        for camera in (0..5).map(Some).chain([None]) {
            let own = paths.iter().map(|&path| single(at(scene, path, camera).ratio(), path_color(path)));
            let theirs = published.iter().flat_map(|theirs| {
                published::CARDS.iter().zip(PAPER).filter_map(move |(card, color)| {
                    let times =
                        camera.map_or_else(|| Some(card.mean(theirs)), |camera| card.times(theirs, camera));
                    Some(single(times?.ratio(), color))
                })
            });
            groups.push(Group { name: group_name(scene, camera), bars: own.chain(theirs).collect() });
        }
    }
    let own = paths.iter().map(|&path| (format!("measured, {}", path.name()), path_color(path)));
    let theirs =
        published::CARDS.iter().zip(PAPER).map(|(card, color)| (format!("paper, {}", card.card), color));
    let has_published = scenes.iter().any(|scene| PublishedScene::named(&scene.name).is_some());
    BarChart {
        title: "Hybrid over stand-alone, t/T, averages (below 1: the hybrid method is faster)".to_owned(),
        axis: "t / T",
        legend: own
            .chain(theirs.filter(|_| has_published))
            .chain([("goal on average".to_owned(), GOAL)])
            .collect(),
        levels: vec![(1.0, BLACK), (AVERAGE_RATIO, GOAL)],
        groups,
    }
}

/// T beside t_a on t_b of each camera.
fn times(scenes: &[SceneResult], path: TracePath) -> BarChart {
    let mut groups = Vec::new();
    for scene in scenes {
        for camera in (0..5).map(Some).chain([None]) {
            let times = at(scene, path, camera);
            let hybrid = vec![(times.rays, RAYS), (times.geometry, GEOMETRY)];
            let bars = vec![single(times.standalone, STANDALONE), hybrid];
            groups.push(Group { name: group_name(scene, camera), bars });
        }
    }
    let legend = [("stand-alone T", STANDALONE), ("ray pass t_a", RAYS), ("geometry pass t_b", GEOMETRY)];
    BarChart {
        title: format!("Average times by {}", path.name()),
        axis: "milliseconds",
        legend: legend.map(|(name, color)| (name.to_owned(), color)).into(),
        levels: Vec::new(),
        groups,
    }
}

fn frames(scene: &SceneResult, path: TracePath) -> LineChart {
    let curve = |name: &str, hue, number: fn(&Times) -> f64| {
        let stretches = scene.of(path).map(|cell| cell.frames.iter().map(number).collect());
        (name.to_owned(), hue, stretches.collect())
    };
    LineChart {
        title: format!("Every frame of {} by {}", scene.name, path.name()),
        axis: "milliseconds",
        curves: vec![
            curve("stand-alone T", STANDALONE, |times| times.standalone),
            curve("hybrid t", BLACK, Times::hybrid),
            curve("ray pass t_a", RAYS, |times| times.rays),
            curve("geometry pass t_b", GEOMETRY, |times| times.geometry),
        ],
        stretches: scene.of(path).map(|cell| format!("cam {}", cell.camera + 1)).collect(),
    }
}

/// The average of a camera, or of all.
fn at(scene: &SceneResult, path: TracePath, camera: Option<usize>) -> Times {
    let cell = camera.and_then(|camera| scene.of(path).find(|cell| cell.camera == camera));
    match cell {
        Some(cell) => Statistic::Average.of(&cell.frames),
        None => scene.mean(path, Statistic::Average),
    }
}

fn group_name(scene: &SceneResult, camera: Option<usize>) -> String {
    let what = camera.map_or("average".to_owned(), |camera| format!("cam {}", camera + 1));
    format!("{} {what}", scene.name)
}

fn single(value: f64, color: Hue) -> Bar {
    vec![(value, color)]
}

fn path_color(path: TracePath) -> Hue {
    match path {
        TracePath::Pipeline => PIPELINE,
        TracePath::Query => QUERY,
        TracePath::SoftwareQuery => SOFTWARE_QUERY,
    }
}
