//! Writes the report folder: a Markdown page, CSV files, plots and images.

use std::fmt::Write as _;
use std::path::Path;

use lvk::Capabilities;
use lvk::temporary_file::{remove_replacements, replace_file};

use super::error::PaperError;
use super::measure::{ExperimentPlan, SceneResult};
use super::published::{self, TimesTable};
use super::report_images::sheet_name;
use super::times::Statistic;
use super::trace_path::TracePath;
use super::{csv, goals, plots, tables};
use lvk_samples::app::device::{driver_text, query_text};

/// The experiment: device, settings and results.
#[derive(Debug, Clone, PartialEq)]
pub struct Experiment {
    /// Name of the device.
    pub device: String,
    /// Driver and Vulkan version of the device.
    pub driver: String,
    /// Date of the measurement in UTC, for example 2026-02-03.
    pub date: String,
    /// Command line that repeats the experiment.
    pub command: String,
    /// Settings of the experiment.
    pub plan: ExperimentPlan,
    /// Duration of the run so far, in seconds.
    pub wall_seconds: f64,
    /// Results of the scenes.
    pub scenes: Vec<SceneResult>,
    /// Further notes for the reader.
    pub notes: Vec<String>,
}

/// Image folder inside the report folder.
pub const IMAGE_FOLDER: &str = "pictures";

/// The statistic of each table of times, with the paper's table. The last two repeat the averages with other GPUs of the
/// paper.
const TIMES: [((&str, Statistic), TimesTable); 5] = [
    (("averages", Statistic::Average), published::AVERAGE),
    (("best frames", Statistic::BEST), published::BEST),
    (("worst frames", Statistic::WORST), published::WORST),
    (("averages", Statistic::Average), published::RTX_2080),
    (("averages", Statistic::Average), published::RX_6600),
];

impl Experiment {
    /// Creates an experiment without results.
    #[must_use]
    pub fn new(capabilities: &Capabilities, command: String, plan: ExperimentPlan) -> Self {
        let profile = capabilities.profile.as_ref().map_or_else(String::new, |name| format!(", as {name}"));
        let notes = software_note(capabilities, &plan).into_iter().collect();
        Self {
            device: format!("{}{profile}", capabilities.device_name),
            driver: driver_text(capabilities),
            date: super::date::today(),
            command,
            plan,
            wall_seconds: 0.0,
            scenes: Vec::new(),
            notes,
        }
    }

    /// Writes the report into the existing `folder`: `report.md`, `times.csv`, `frames.csv`, `image_metrics.csv` and
    /// plots as SVG. [`measure`](super::measure) writes the images.
    ///
    /// # Errors
    /// [`PaperError::Write`] if a file cannot be written, [`PaperError::Plot`] if a plot cannot be drawn.
    pub fn write(&self, folder: &Path) -> Result<(), PaperError> {
        let mut files = plots::all(&self.scenes, &self.plan.paths)?;
        files.extend([
            ("times.csv".to_owned(), csv::times(&self.scenes)),
            ("frames.csv".to_owned(), csv::frames(&self.scenes)),
            ("image_metrics.csv".to_owned(), csv::image_metrics(&self.scenes)),
            ("report.md".to_owned(), self.page()),
        ]);
        for (name, text) in files {
            let path = folder.join(&name);
            remove_replacements(folder, |file| file == name);
            replace_file(&path, text.as_bytes()).map_err(PaperError::write(&path))?;
        }
        Ok(())
    }

    /// Returns the Markdown page.
    #[must_use]
    pub fn page(&self) -> String {
        let mut page = self.head();
        let _ = writeln!(page, "{}", goals::table(&self.scenes, &self.plan.paths));
        page.push_str("![Hybrid / stand-alone](ratio.svg)\n\n## Tables\n\n");
        let _ = writeln!(page, "{}", tables::geometry(&self.scenes));
        for &path in &self.plan.paths {
            self.add_path(&mut page, path);
        }
        let _ = writeln!(page, "{}", tables::cards(&self.scenes, &self.plan.paths, &self.device));
        if let Some(table) = tables::paths(&self.scenes, &self.plan.paths) {
            let _ = writeln!(page, "{table}");
        }
        self.add_images(&mut page);
        page
    }

    fn head(&self) -> String {
        let ExperimentPlan { size: [width, height], frames, runs, compared, max_depth, .. } = &self.plan;
        let mut text = format!(
            "# The paper's experiment\n\nKim and Baek, \"A Hybrid Approach for Vulkan-Based Ray Tracing \
             Implementations\", 2026, repeated.\n\n- device: {}\n- driver: {}\n- date: {}\n- command: `{}`\n- \
             images: {width}x{height}, up to {max_depth} bounces; {frames} frames along a path around each of five \
             cameras, each rendered {runs} times by each method, of which the median counts; {compared} frames of \
             each camera compared\n",
            self.device, self.driver, self.date, self.command
        );
        if self.wall_seconds > 0.0 {
            let seconds = self.wall_seconds.round() as u64;
            let _ =
                writeln!(text, "- took {} min {} s with loading and building", seconds / 60, seconds % 60);
        }
        for scene in &self.scenes {
            for (path, choice) in &scene.rasterisers {
                let _ = writeln!(text, "- {} by {}: {choice}", scene.name, path.name());
            }
        }
        self.notes.iter().for_each(|note| {
            let _ = writeln!(text, "- {note}");
        });
        text.push_str(METHOD_NOTES);
        text
    }

    fn add_path(&self, page: &mut String, path: TracePath) {
        let _ = writeln!(page, "## By {}\n\n![Times]({})\n", path.name(), plots::times_name(path));
        let _ = writeln!(page, "{}", tables::image_metrics(&self.scenes, path));
        let shown = if tables::has_published(&self.scenes) { TIMES.len() } else { 3 };
        for (what, published) in &TIMES[..shown] {
            let _ = writeln!(page, "{}", tables::times(&self.scenes, path, *what, published));
        }
        let _ = writeln!(page, "{}", tables::spans(&self.scenes, path));
        let _ = writeln!(page, "{}", tables::spread(&self.scenes, path));
        for scene in &self.scenes {
            let _ = writeln!(page, "![Frame times of {}]({})\n", scene.name, plots::frames_name(scene, path));
        }
    }

    fn add_images(&self, page: &mut String) {
        page.push_str("## Images (Figures 8 to 10)\n\nStand-alone, hybrid, and their difference, inverted and multiplied by 32.\n");
        for scene in &self.scenes {
            for &path in &self.plan.paths {
                let _ = write!(page, "\n{} by {}:\n\n", scene.name, path.name());
                let _ = writeln!(page, "![{}]({IMAGE_FOLDER}/{})", scene.name, sheet_name(&scene.name, path));
            }
        }
    }
}

/// Returns the reason for software ray queries if the plan uses them.
fn software_note(capabilities: &Capabilities, plan: &ExperimentPlan) -> Option<String> {
    let is_planned = plan.paths.contains(&TracePath::SoftwareQuery);
    let text = || format!("software query: {}", query_text(capabilities, "a compute shader"));
    is_planned.then(text)
}

/// Explanation of symbols and method in the report.
const METHOD_NOTES: &str = "
T is the time of the stand-alone method, t_a of the hybrid method's ray pass, t_b of its geometry pass, and t = t_a + t_b.
All times come from GPU timestamps around the commands. A span is a whole frame, from the first timestamp before the geometry
pass to the last timestamp after the ray pass. It therefore includes the barriers between the passes. The span of a frame that
is rendered in several tiles is the sum of the tiles' spans, without the CPU, which waits for each tile. The paper adds the
times of its passes, so t is a sum here, too; the spans have their own table. Both methods alternate frame by frame. The best
and the worst frame are selected per method; t_a, t_b and the span belong to the same frame of the hybrid method. Rows named
average are averages over the cameras, as in the paper. The paper rendered 1280x720 on its GPUs. Its scenes are other exports of
the same models, the kitchen replaces its gallery, and its camera positions are unknown, so the columns are similar, not equal.

";

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper::{CameraResult, ImageMetrics, Times};

    fn experiment(names: &[&str], paths: &[TracePath]) -> Experiment {
        let alike = ImageMetrics { psnr: 50.0, lowest_psnr: 49.0, ssim: 0.9995, differing_share: 1e-4 };
        let frames = |slow: f64| {
            (0..2500)
                .map(|i| Times {
                    standalone: slow,
                    rays: 0.2 + 1e-5 * f64::from(i),
                    geometry: 0.1,
                    standalone_span: slow + 0.25,
                    hybrid_span: 0.4 + 1e-5 * f64::from(i),
                })
                .collect()
        };
        let cells = |&path: &TracePath| {
            (0..5).map(move |camera| CameraResult {
                path,
                camera,
                frames: frames(1.0 + camera as f64),
                metrics: alike,
            })
        };
        let scene = |name: &&str| SceneResult {
            name: (*name).to_owned(),
            vertices: 12_345,
            triangles: 54_321,
            cells: paths.iter().flat_map(cells).collect(),
            rasterisers: paths.iter().map(|path| (*path, "compute rasteriser (exact)".to_owned())).collect(),
            path_metrics: if paths.len() > 1 { vec![(alike, alike); 5] } else { Vec::new() },
        };
        let paths = paths.to_vec();
        let plan = ExperimentPlan {
            size: [32, 18],
            frames: 2500,
            runs: 1,
            warm_up: 0,
            compared: 1,
            max_depth: 1,
            paths,
        };
        let capabilities = Capabilities { device_name: "Thing 3000".to_owned(), ..Capabilities::default() };
        let scenes = names.iter().map(scene).collect();
        Experiment { scenes, ..Experiment::new(&capabilities, "bench paper".to_owned(), plan) }
    }

    /// Cells of the row whose first cell is `name`, of the first table whose title contains `title`.
    fn row(page: &str, title: &str, name: &str) -> Vec<String> {
        let table = page.split("\n### ").find(|table| table.lines().next().unwrap().contains(title)).unwrap();
        let line = table.lines().find(|line| line.starts_with(&format!("| {name} "))).unwrap();
        line.trim_matches('|').split('|').map(|cell| cell.trim().to_owned()).collect()
    }

    #[test]
    fn the_papers_numbers_stand_beside_ones_own() {
        let page = experiment(&["living_room", "kitchen", "teapot"], &[TracePath::Pipeline]).page();
        let average = row(&page, "Table 3", "living_room cam 5");
        assert_eq!(average[1], "5.000");
        assert_eq!(average[7..], ["1.047", "0.672", "64.2 %", "0.366", "1.038", "99.1 %"]);
        let worst = row(&page, "Table 5", "kitchen cam 1");
        assert_eq!(worst[2..7], ["0.225", "22.5 %", "0.100", "0.325", "32.5 %"]);
        assert_eq!(worst[12], "231.6 %");
        assert_eq!(row(&page, "Table 7", "kitchen average")[12], "72.2 %");
        assert_eq!(row(&page, "Table 2", "living_room cam 1")[5..], ["45.25", "0.9858"]);
        assert_eq!(
            row(&page, "Table 2", "living_room average")[1..],
            ["50.00", "49.00", "0.99950", "0.0100 %", "46.30", "0.9892"]
        );
        assert_eq!(
            row(&page, "as one span", "living_room cam 4")[1..],
            ["4.000", "4.250", "0.312", "0.412", "0.100", "7.8 %", "9.7 %"]
        );
        assert!(page.contains("- kitchen by pipeline: compute rasteriser (exact)\n"), "{page}");
        assert_eq!(row(&page, "Table 1", "kitchen")[3..], ["Gallery", "648,417", "998,831"]);
        assert_eq!(row(&page, "Table 3", "teapot cam 2")[7..], ["", "", "", "", "", ""]);
        assert_eq!(row(&page, "Table 8", "Gallery, RX 6600 (paper)")[6..], ["2.060", "72.2 %"]);
        for number in 1..=8 {
            assert_eq!(page.matches(&format!("### Table {number}")).count(), 1, "table {number}");
        }
    }

    #[test]
    fn scenes_that_the_paper_does_not_have_leave_its_columns_out() {
        let page = experiment(&["teapot"], &[TracePath::Pipeline, TracePath::Query]).page();
        assert!(!page.contains("paper:") && !page.contains("Table 6"), "{page}");
        assert_eq!(row(&page, "Table 3, by query", "teapot cam 2").len(), 7);
        assert_eq!(row(&page, "pipeline and by query", "teapot cam 2")[1], "50.00");
    }

    #[test]
    fn software_queries_bear_their_own_name() {
        use TracePath::{Pipeline, SoftwareQuery};
        let experiment = experiment(&["teapot"], &[Pipeline, SoftwareQuery]);
        let page = experiment.page();
        assert!(page.contains("## By software query\n") && page.contains("\n- software query: "), "{page}");
        assert!(!page.contains("by query") && !page.contains(": query"), "{page}");
        assert_eq!(row(&page, "by pipeline and by software query", "teapot cam 2")[1], "50.00");
        assert!(page.contains("](times_software_query.svg)"), "{page}");
        assert!(csv::times(&experiment.scenes).contains("\nteapot,software query,1,average,"));
        let plots = plots::all(&experiment.scenes, &experiment.plan.paths).unwrap();
        for name in ["ratio.svg", "times_software_query.svg", "frames_teapot_software_query.svg"] {
            let plot = plots.iter().find(|(known, _)| known == name);
            assert!(plot.is_some_and(|(_, text)| text.contains("software query")), "{name}");
        }
    }

    #[test]
    fn plots_are_svg_and_small_whatever_the_number_of_frames() {
        let experiment = experiment(&["conference", "a <b>"], &[TracePath::Pipeline, TracePath::Query]);
        let plots = plots::all(&experiment.scenes, &experiment.plan.paths).unwrap();
        assert_eq!(plots.len(), 1 + 2 * 3);
        for (name, text) in plots {
            assert!(text.starts_with("<svg") && text.trim_end().ends_with("</svg>"), "{name}");
            assert!(
                text.len() < 200_000 && !text.contains("a <b>") && !text.contains("NaN"),
                "{name} {}",
                text.len()
            );
        }
    }
}
