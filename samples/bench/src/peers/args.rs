//! The command line.

use std::path::PathBuf;

use clap::Args;
use clap::builder::PossibleValuesParser;

use super::row::Row;
use super::workload::Workload;
use crate::args::ImageSizeArgs;

/// Options of the comparison.
#[derive(Debug, Clone, PartialEq, Args)]
pub struct PeersArgs {
    /// Wavefront OBJ file for the frames of rays [default: a generated scene]
    #[arg(long, value_name = "FILE")]
    pub(super) scene: Option<PathBuf>,

    #[command(flatten)]
    pub(super) image: ImageSizeArgs,

    /// Rows to measure, separated by commas [default: all]
    #[arg(long, value_name = "ROW,...", value_delimiter = ',')]
    #[arg(value_parser = PossibleValuesParser::new(Row::ALL.map(Row::key)))]
    pub(super) rows: Vec<String>,

    /// Libraries beside ash, separated by commas [default: all of this program]
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    pub(super) peers: Vec<String>,

    /// Also build the triangle of each library in an empty folder, which takes minutes
    #[arg(long)]
    pub(super) builds: bool,

    /// File for the table, beside standard output
    #[arg(long, value_name = "FILE")]
    pub(super) out: Option<PathBuf>,

    /// The peer of a child process
    #[arg(long, hide = true, requires = "row")]
    pub(super) serve: Option<String>,

    /// The row of a child process
    #[arg(long, hide = true, value_parser = PossibleValuesParser::new(Row::ALL.map(Row::key)))]
    pub(super) row: Option<String>,

    /// The amount of work of a child process
    #[arg(long, hide = true, default_value = "gpu", value_parser = ["quick", "cpu", "gpu"])]
    pub(super) class: String,
}

/// The amount of work, by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum WorkClass {
    Quick,
    Cpu,
    Gpu,
}

impl WorkClass {
    pub(super) const fn key(self) -> &'static str {
        match self {
            Self::Quick => "quick",
            Self::Cpu => "cpu",
            Self::Gpu => "gpu",
        }
    }

    /// Returns the number of rounds that count.
    pub(super) const fn rounds(self) -> u32 {
        match self {
            Self::Quick => 2,
            Self::Cpu => 11,
            Self::Gpu => 21,
        }
    }
}

impl PeersArgs {
    /// Returns the rows to measure.
    pub(super) fn selected(&self) -> Vec<Row> {
        if self.rows.is_empty() {
            return Row::ALL.to_vec();
        }
        Row::ALL.into_iter().filter(|row| self.rows.iter().any(|key| key == row.key())).collect()
    }

    /// Returns the workload of this class with the options of the command line.
    pub(super) fn workload(&self, class: &str) -> Workload {
        let mut work = match class {
            "quick" => Workload::QUICK,
            "cpu" => Workload::CPU,
            _ => Workload::GPU,
        };
        work.scene.clone_from(&self.scene);
        let [width, height] = work.image;
        work.image = [self.image.width.unwrap_or(width), self.image.height.unwrap_or(height)];
        work
    }

    /// Returns the arguments of a child process.
    pub(super) fn child(&self, peer: &str, row: Row, class: WorkClass) -> Vec<String> {
        let mut args = vec!["--serve".to_owned(), peer.to_owned()];
        args.extend(["--row", row.key(), "--class", class.key()].map(str::to_owned));
        if let Some(scene) = &self.scene {
            args.extend(["--scene".to_owned(), scene.display().to_string()]);
        }
        for (name, number) in [("--width", self.image.width), ("--height", self.image.height)] {
            args.extend(number.iter().flat_map(|number| [name.to_owned(), number.to_string()]));
        }
        args
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        peers: PeersArgs,
    }

    fn parsed(line: &str) -> PeersArgs {
        Line::try_parse_from(std::iter::once("peers").chain(line.split_whitespace())).unwrap().peers
    }

    #[test]
    fn selected_work_keeps_the_order_of_the_table() {
        assert_eq!(parsed("").selected(), Row::ALL);
        assert_eq!(parsed("--rows tlas,draws").selected(), [Row::Draws, Row::TlasBuild]);
        assert!(Line::try_parse_from(["peers", "--rows", "everything"]).is_err());
    }

    #[test]
    fn a_child_has_the_workload_of_its_parent() {
        let parent = parsed("--scene a.obj --width 64 --height 36 --rows draws");
        for class in [WorkClass::Quick, WorkClass::Cpu, WorkClass::Gpu] {
            let child = parsed(&parent.child("ash", Row::Uploads, class).join(" "));
            assert_eq!((child.serve.as_deref(), child.row.as_deref()), (Some("ash"), Some("uploads")));
            assert_eq!(child.workload(&child.class), parent.workload(class.key()));
        }
        assert_eq!(parent.workload("cpu").image, [64, 36]);
        assert_ne!(parent.workload("cpu").mesh_triangles, parent.workload("gpu").mesh_triangles);
    }
}
