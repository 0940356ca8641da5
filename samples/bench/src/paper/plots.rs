//! The plots of the report.

use super::bar_chart::{Bar, BarChart, Group};
use super::error::PaperError;
use super::goals::AVERAGE_RATIO;
use super::legend::Rgb;
use super::line_chart::LineChart;
use super::measure::SceneResult;
use super::published::{self, PublishedScene};
use super::times::{Statistic, Times};
use super::trace_path::TracePath;

// A colour-blind-safe palette (after Okabe and Ito).
const PIPELINE: Rgb = (0, 114, 178);
const QUERY: Rgb = (86, 180, 233);
const SOFTWARE_QUERY: Rgb = (204, 121, 167);
const PAPER: [Rgb; 3] = [(230, 159, 0), (240, 200, 100), (213, 94, 0)];
const STANDALONE: Rgb = (120, 120, 120);
const RAYS: Rgb = (0, 114, 178);
const GEOMETRY: Rgb = (230, 159, 0);
const BLACK: Rgb = (0, 0, 0);
const GOAL: Rgb = (0, 158, 115);

/// Name and content of a plot file.
pub(super) type NamedPlot = (String, String);

/// Returns all plots.
pub(super) fn all(scenes: &[SceneResult], paths: &[TracePath]) -> Result<Vec<NamedPlot>, PaperError> {
    let mut plots = vec![("ratio.svg".to_owned(), ratio_chart(scenes, paths).svg()?)];
    for &path in paths {
        plots.push((times_name(path), times_chart(scenes, path).svg()?));
        for scene in scenes {
            plots.push((frames_name(scene, path), frames_chart(scene, path).svg()?));
        }
    }
    Ok(plots)
}

/// Returns the file name of the bar chart of a path.
pub(super) fn times_name(path: TracePath) -> String {
    format!("times_{}.svg", path.file_name())
}

/// Returns the file name of the line chart of a scene.
pub(super) fn frames_name(scene: &SceneResult, path: TracePath) -> String {
    format!("frames_{}_{}.svg", scene.name, path.file_name())
}

/// Returns the chart of t/T per camera, with the values of the paper's GPUs.
fn ratio_chart(scenes: &[SceneResult], paths: &[TracePath]) -> BarChart {
    let mut groups = Vec::new();
    for scene in scenes {
        let published = PublishedScene::find(&scene.name);
        for camera in (0..5).map(Some).chain([None]) {
            let own = paths
                .iter()
                .map(|&path| single(average_times(scene, path, camera).ratio(), path_color(path)));
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
    let has_published = scenes.iter().any(|scene| PublishedScene::find(&scene.name).is_some());
    BarChart {
        title: "Hybrid / stand-alone, t/T, averages (below 1: the hybrid method is faster)".to_owned(),
        axis: "t / T",
        legend: own
            .chain(theirs.filter(|_| has_published))
            .chain([("goal on average".to_owned(), GOAL)])
            .collect(),
        levels: vec![(1.0, BLACK), (AVERAGE_RATIO, GOAL)],
        groups,
    }
}

/// Returns the chart of T, and of t_a stacked with t_b, per camera.
fn times_chart(scenes: &[SceneResult], path: TracePath) -> BarChart {
    let mut groups = Vec::new();
    for scene in scenes {
        for camera in (0..5).map(Some).chain([None]) {
            let times = average_times(scene, path, camera);
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

fn frames_chart(scene: &SceneResult, path: TracePath) -> LineChart {
    let curve = |name: &str, hue, number: fn(&Times) -> f64| {
        let segments = scene.cameras_by(path).map(|cell| cell.frames.iter().map(number).collect());
        (name.to_owned(), hue, segments.collect())
    };
    LineChart {
        title: format!("Frame times of {} by {}", scene.name, path.name()),
        axis: "milliseconds",
        curves: vec![
            curve("stand-alone T", STANDALONE, |times| times.standalone),
            curve("hybrid t", BLACK, Times::hybrid),
            curve("ray pass t_a", RAYS, |times| times.rays),
            curve("geometry pass t_b", GEOMETRY, |times| times.geometry),
        ],
        segments: scene.cameras_by(path).map(|cell| format!("cam {}", cell.camera + 1)).collect(),
    }
}

/// Returns the average of one camera, or of all cameras for `None`.
fn average_times(scene: &SceneResult, path: TracePath, camera: Option<usize>) -> Times {
    let cell = camera.and_then(|camera| scene.cameras_by(path).find(|cell| cell.camera == camera));
    match cell {
        Some(cell) => Statistic::Average.evaluate(&cell.frames),
        None => scene.mean(path, Statistic::Average),
    }
}

fn group_name(scene: &SceneResult, camera: Option<usize>) -> String {
    let what = camera.map_or("average".to_owned(), |camera| format!("cam {}", camera + 1));
    format!("{} {what}", scene.name)
}

fn single(value: f64, color: Rgb) -> Bar {
    vec![(value, color)]
}

fn path_color(path: TracePath) -> Rgb {
    match path {
        TracePath::Pipeline => PIPELINE,
        TracePath::Query => QUERY,
        TracePath::SoftwareQuery => SOFTWARE_QUERY,
    }
}
