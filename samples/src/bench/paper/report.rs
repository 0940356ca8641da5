//! The report as a folder: one page of markdown, numbers for other programs, plots and pictures.

use std::fmt::Write as _;
use std::path::Path;

use lvk::Capabilities;

use super::super::setup::path_name;
use super::error::PaperError;
use super::measured::{Plan, SceneResult};
use super::pictures::sheet_name;
use super::published::{self, TimesTable};
use super::times::Statistic;
use super::{csv, goals, plots, tables};
use crate::app::device::driver_text;
use crate::hybrid::RayPath;

/// What was measured, on what and how.
#[derive(Debug, Clone, PartialEq)]
pub struct Experiment {
    /// Name of the device.
    pub device: String,
    /// Its driver and Vulkan.
    pub driver: String,
    /// Day of the measurement, as 2026-02-03, in UTC.
    pub date: String,
    /// How to repeat it.
    pub command: String,
    /// How much was measured.
    pub plan: Plan,
    /// What was found.
    pub scenes: Vec<SceneResult>,
    /// What else the reader has to know.
    pub notes: Vec<String>,
}

/// Folder of the pictures inside the report's.
pub const PICTURES: &str = "pictures";

/// The paper's tables of times: what they are of, and which one stands beside.
const TIMES: [((&str, Statistic), TimesTable); 5] = [
    (("averages", Statistic::Average), published::AVERAGE),
    (("best frames", Statistic::BEST), published::BEST),
    (("worst frames", Statistic::WORST), published::WORST),
    (("averages", Statistic::Average), published::RTX_2080),
    (("averages", Statistic::Average), published::RX_6600),
];

impl Experiment {
    /// An experiment that nothing was measured of yet.
    #[must_use]
    pub fn new(capabilities: &Capabilities, command: String, plan: Plan) -> Self {
        Self {
            device: capabilities.device_name.clone(),
            driver: driver_text(capabilities),
            date: super::date::today(),
            command,
            plan,
            scenes: Vec::new(),
            notes: Vec::new(),
        }
    }

    /// Writes the report into `folder`, which is there: `report.md`, `times.csv`, `frames.csv`, `likeness.csv` and
    /// plots as SVG. Pictures are written while measuring.
    ///
    /// # Errors
    /// [`PaperError::Write`] and [`PaperError::Plot`].
    pub fn write(&self, folder: &Path) -> Result<(), PaperError> {
        let mut files = plots::all(&self.scenes, &self.plan.paths)?;
        files.extend([
            ("times.csv".to_owned(), csv::times(&self.scenes)),
            ("frames.csv".to_owned(), csv::frames(&self.scenes)),
            ("likeness.csv".to_owned(), csv::likeness(&self.scenes)),
            ("report.md".to_owned(), self.page()),
        ]);
        for (name, text) in files {
            let path = folder.join(name);
            std::fs::write(&path, text).map_err(PaperError::write(&path))?;
        }
        Ok(())
    }

    /// The page.
    #[must_use]
    pub fn page(&self) -> String {
        let mut page = self.head();
        let _ = writeln!(page, "{}", goals::table(&self.scenes, &self.plan.paths));
        page.push_str("![Hybrid over stand-alone](ratio.svg)\n\n## Tables\n\n");
        let _ = writeln!(page, "{}", tables::geometry(&self.scenes));
        for &path in &self.plan.paths {
            self.add_path(&mut page, path);
        }
        let _ = writeln!(page, "{}", tables::cards(&self.scenes, &self.plan.paths, &self.device));
        if let Some(table) = tables::paths(&self.scenes) {
            let _ = writeln!(page, "{table}");
        }
        self.add_pictures(&mut page);
        page
    }

    fn head(&self) -> String {
        let Plan { size: [width, height], frames, runs, compared, max_depth, .. } = &self.plan;
        let mut text = format!(
            "# The paper's experiment\n\nKim and Baek, \"A Hybrid Approach for Vulkan-Based Ray Tracing \
             Implementations\", 2026, repeated.\n\n- device: {}\n- driver: {}\n- date: {}\n- command: `{}`\n- \
             pictures: {width}x{height}, up to {max_depth} bounces; {frames} frames along a path around each of five \
             cameras, each rendered {runs} times by each method, of which the median counts; {compared} frames of \
             each camera compared\n",
            self.device, self.driver, self.date, self.command
        );
        self.notes.iter().for_each(|note| {
            let _ = writeln!(text, "- {note}");
        });
        text.push_str(HOW);
        text
    }

    fn add_path(&self, page: &mut String, path: RayPath) {
        let _ = writeln!(page, "## By {}\n\n![Times]({})\n", path_name(path), plots::times_name(path));
        let _ = writeln!(page, "{}", tables::likeness(&self.scenes, path));
        for (what, published) in &TIMES {
            let _ = writeln!(page, "{}", tables::times(&self.scenes, path, *what, published));
        }
        let _ = writeln!(page, "{}", tables::spread(&self.scenes, path));
        for scene in &self.scenes {
            let _ = writeln!(page, "![Every frame of {}]({})\n", scene.name, plots::frames_name(scene, path));
        }
    }

    fn add_pictures(&self, page: &mut String) {
        page.push_str("## Pictures (Figures 8 to 10)\n\nStand-alone, hybrid, and their difference, inverted and times 32.\n");
        for scene in &self.scenes {
            for &path in &self.plan.paths {
                let _ = write!(page, "\n{} by {}:\n\n", scene.name, path_name(path));
                let _ = writeln!(page, "![{}]({PICTURES}/{})", scene.name, sheet_name(&scene.name, path));
            }
        }
    }
}

/// What the symbols mean.
const HOW: &str = "
T is the stand-alone method's time, t_a that of the hybrid method's ray pass, t_b that of its geometry pass, t = t_a + t_b,
all from timestamps on the device around the commands. Both methods take turns frame by frame. The best and the worst frame
are those of each method by itself, t_a and t_b those of the hybrid method's frame. Rows called average are averages over the
cameras, as in the paper. The paper rendered 1280x720 on its cards; its scenes are other exports of the same models, the
kitchen stands beside its gallery, and its camera positions are not known, so columns compare like with similar.

";
