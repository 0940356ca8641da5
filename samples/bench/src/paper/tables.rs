//! The paper's tables with the measured numbers beside the paper's.

use super::image_metrics::ImageMetrics;
use super::measure::SceneResult;
use super::published::{self, PublishedScene, TimesTable};
use super::times::{Statistic, Times};
use super::trace_path::TracePath;
use crate::table::{Table, format_grouped};

/// Columns of a table of times, without the first.
const TIMES: [&str; 6] = ["T", "t_a", "t_a/T", "t_b", "t", "t/T"];

/// True if the paper has numbers for one of the scenes.
pub(super) fn has_published(scenes: &[SceneResult]) -> bool {
    scenes.iter().any(|scene| PublishedScene::find(&scene.name).is_some())
}

/// Returns the table of geometry (Table 1).
pub(super) fn geometry(scenes: &[SceneResult]) -> Table {
    let head = ["scene", "vertices", "triangles", "paper: scene", "vertices", "faces"];
    let shown = if has_published(scenes) { head.len() } else { 3 };
    let mut table = Table::new("### Table 1: geometry".to_owned(), &head[..shown]);
    for scene in scenes {
        let own = [scene.vertices, scene.triangles].map(format_grouped);
        let published = PublishedScene::find(&scene.name);
        let theirs = published.map(|theirs| {
            [theirs.name.to_owned(), format_grouped(theirs.vertices), format_grouped(theirs.faces)]
        });
        table.add_row(scene.name.clone(), own.into_iter().chain(theirs.into_iter().flatten()));
    }
    table
}

/// Returns the table of image metrics between both methods (Table 2).
pub(super) fn image_metrics(scenes: &[SceneResult], path: TracePath) -> Table {
    let head = ["camera", "PSNR dB", "lowest", "SSIM", "differing", "paper: PSNR dB", "SSIM"];
    let shown = if has_published(scenes) { head.len() } else { 5 };
    let title = format!("### Table 2, by {}: stand-alone and hybrid images compared", path.name());
    let mut table = Table::new(title, &head[..shown]);
    for scene in scenes {
        let published = PublishedScene::find(&scene.name);
        for cell in scene.cameras_by(path) {
            let theirs = published.and_then(|theirs| theirs.metrics(cell.camera));
            table.add_row(camera(scene, cell.camera), metrics_row(&cell.metrics, theirs));
        }
        let theirs = published.map(|theirs| theirs.mean_metrics());
        table.add_row(format!("{} average", scene.name), metrics_row(&mean_metrics(scene, path), theirs));
    }
    table.add_note("differing: share of pixels that differ by more than 1/255 in a channel");
    table.add_note("average: PSNR of the mean square error over the cameras; the paper averages decibels");
    table
}

/// Returns the table of image metrics between the first two paths; `None` without results.
pub(super) fn paths(scenes: &[SceneResult], paths: &[TracePath]) -> Option<Table> {
    let [first, second, ..] = paths else { return None };
    let head = ["camera", "stand-alone: PSNR dB", "SSIM", "hybrid: PSNR dB", "SSIM"];
    let title = format!("### Images by {} and by {} compared", first.name(), second.name());
    let mut table = Table::new(title, &head);
    for scene in scenes {
        for (number, (standalone, hybrid)) in scene.path_metrics.iter().enumerate() {
            let cells =
                [standalone, hybrid].map(|metrics| [decibels(metrics.psnr), format!("{:.5}", metrics.ssim)]);
            table.add_row(camera(scene, number), cells.into_iter().flatten());
        }
    }
    scenes.iter().any(|scene| !scene.path_metrics.is_empty()).then_some(table)
}

/// Returns the table of times per camera, with a table of the paper (Tables 3 to 7).
pub(super) fn times(
    scenes: &[SceneResult],
    path: TracePath,
    (what, statistic): (&str, Statistic),
    published: &TimesTable,
) -> Table {
    let TimesTable { number, card, .. } = published;
    let beside =
        if has_published(scenes) { format!(", compared with the paper's {card}") } else { String::new() };
    let title = format!("### Table {number}, by {}: {what} in milliseconds{beside}", path.name());
    let theirs = if has_published(scenes) {
        TIMES.map(|column| format!("paper: {column}")).into()
    } else {
        Vec::new()
    };
    let head: Vec<&str> =
        ["camera"].into_iter().chain(TIMES).chain(theirs.iter().map(String::as_str)).collect();
    let mut table = Table::new(title, &head);
    for scene in scenes {
        let scene_published = PublishedScene::find(&scene.name);
        for cell in scene.cameras_by(path) {
            let theirs = scene_published.and_then(|theirs| published.times(&theirs, cell.camera));
            table.add_row(camera(scene, cell.camera), times_row(&statistic.evaluate(&cell.frames), theirs));
        }
        let theirs = scene_published.map(|theirs| published.mean(&theirs));
        table.add_row(format!("{} average", scene.name), times_row(&scene.mean(path, statistic), theirs));
    }
    table
}

/// Returns the table of averages of this device and of the paper's GPUs (Table 8).
pub(super) fn cards(scenes: &[SceneResult], paths: &[TracePath], device: &str) -> Table {
    let head = ["scene, card", "T", "t_a", "t_a/T", "t_b", "t_b/T", "t", "t/T"];
    let mut table = Table::new("### Table 8: averages by card, in milliseconds".to_owned(), &head);
    for scene in scenes {
        for &path in paths {
            let name = format!("{}, {device}, {}", scene.name, path.name());
            table.add_row(name, card_row(&scene.mean(path, Statistic::Average)));
        }
        let Some(theirs) = PublishedScene::find(&scene.name) else { continue };
        for card in published::CARDS {
            table.add_row(format!("{}, {} (paper)", theirs.name, card.card), card_row(&card.mean(&theirs)));
        }
    }
    table
}

/// Returns the table of average frame spans and average pass times.
pub(super) fn spans(scenes: &[SceneResult], path: TracePath) -> Table {
    let head = ["camera", "T", "T span", "t", "t span", "t span - t", "t/T", "t span/T span"];
    let title = format!("### Whole frames as one span, by {}: averages in milliseconds", path.name());
    let mut table = Table::new(title, &head);
    for scene in scenes {
        for cell in scene.cameras_by(path) {
            table.add_row(camera(scene, cell.camera), spans_row(&Statistic::Average.evaluate(&cell.frames)));
        }
        table.add_row(format!("{} average", scene.name), spans_row(&scene.mean(path, Statistic::Average)));
    }
    table
}

/// Returns the table of the spread of frame times.
pub(super) fn spread(scenes: &[SceneResult], path: TracePath) -> Table {
    let head =
        ["camera", "T median", "T 99 %", "T worst/avg", "t median", "t 99 %", "t worst/avg", "t/T median"];
    let title = format!("### Spread of frames, by {}, in milliseconds", path.name());
    let mut table = Table::new(title, &head);
    for scene in scenes {
        for cell in scene.cameras_by(path) {
            let times = |statistic: Statistic| statistic.evaluate(&cell.frames);
            let (median, percentile_99) = (times(Statistic::MEDIAN), times(Statistic::PERCENTILE_99));
            let (average, worst) = (times(Statistic::Average), times(Statistic::WORST));
            let cells = [
                number(median.standalone),
                number(percentile_99.standalone),
                times_over(worst.standalone / average.standalone),
                number(median.hybrid()),
                number(percentile_99.hybrid()),
                times_over(worst.hybrid() / average.hybrid()),
                percent(median.ratio()),
            ];
            table.add_row(camera(scene, cell.camera), cells);
        }
    }
    table
}

/// Returns the table of averages for the terminal.
pub(super) fn summary(title: String, scenes: &[SceneResult], paths: &[TracePath]) -> Table {
    let theirs = has_published(scenes).then_some("paper: t/T");
    let head: Vec<&str> = ["scene"].into_iter().chain(TIMES).chain(["PSNR dB"]).chain(theirs).collect();
    let mut table = Table::new(title, &head);
    for scene in scenes {
        for &path in paths {
            let psnr = mean_metrics(scene, path).psnr;
            let theirs = PublishedScene::find(&scene.name).map(|theirs| published::AVERAGE.mean(&theirs));
            let own = times_cells(&scene.mean(path, Statistic::Average));
            let cells =
                own.into_iter().chain([decibels(psnr)]).chain(theirs.map(|theirs| percent(theirs.ratio())));
            table.add_row(format!("{}, {}", scene.name, path.name()), cells);
        }
    }
    table
}

fn mean_metrics(scene: &SceneResult, path: TracePath) -> ImageMetrics {
    let cells: Vec<ImageMetrics> = scene.cameras_by(path).map(|cell| cell.metrics).collect();
    ImageMetrics::mean(&cells)
}

fn metrics_row(own: &ImageMetrics, theirs: Option<(f64, f64)>) -> Vec<String> {
    let share = format!("{:.4} %", 100.0 * own.differing_share);
    let mut cells = vec![decibels(own.psnr), decibels(own.lowest_psnr), format!("{:.5}", own.ssim), share];
    if let Some((psnr, ssim)) = theirs {
        cells.extend([decibels(psnr), format!("{ssim:.4}")]);
    }
    cells
}

fn times_row(own: &Times, theirs: Option<Times>) -> Vec<String> {
    let mut cells = times_cells(own).to_vec();
    cells.extend(theirs.iter().flat_map(times_cells));
    cells
}

fn times_cells(times: &Times) -> [String; 6] {
    [
        number(times.standalone),
        number(times.rays),
        percent(times.ray_ratio()),
        number(times.geometry),
        number(times.hybrid()),
        percent(times.ratio()),
    ]
}

fn spans_row(times: &Times) -> [String; 7] {
    [
        number(times.standalone),
        number(times.standalone_span),
        number(times.hybrid()),
        number(times.hybrid_span),
        number(times.outside_passes()),
        percent(times.ratio()),
        percent(times.span_ratio()),
    ]
}

fn card_row(times: &Times) -> [String; 7] {
    let [alone, rays, ray_ratio, geometry, hybrid, ratio] = times_cells(times);
    [alone, rays, ray_ratio, geometry, percent(times.geometry_ratio()), hybrid, ratio]
}

fn camera(scene: &SceneResult, camera: usize) -> String {
    format!("{} cam {}", scene.name, camera + 1)
}

/// Formats milliseconds with microsecond precision.
fn number(milliseconds: f64) -> String {
    format!("{milliseconds:.3}")
}

fn times_over(ratio: f64) -> String {
    format!("{ratio:.2}x")
}

fn percent(ratio: f64) -> String {
    format!("{:.1} %", 100.0 * ratio)
}

/// Formats decibels; `equal` for infinite decibels.
pub(super) fn decibels(psnr: f64) -> String {
    if psnr.is_finite() { format!("{psnr:.2}") } else { "equal".to_owned() }
}
