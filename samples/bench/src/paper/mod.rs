//! The experiment of Kim and Baek's paper: stand-alone and hybrid ray tracing along the paths of five cameras of each scene,
//! what their passes take on the device, and how alike their pictures are - with the paper's own numbers beside.
//!
//! `bench paper` is the program. For others there are [`measure`], which measures a scene on a device that is open, and
//! [`Experiment`], which writes the report.

mod args;
mod bar_chart;
mod command;
mod csv;
mod date;
mod error;
mod goals;
mod legend;
mod likeness;
mod line_chart;
mod measured;
mod pictures;
mod plots;
mod published;
mod report;
mod tables;
mod times;
mod trace_path;

pub use args::PaperArgs;
pub(super) use command::run;
pub use error::PaperError;
pub use likeness::Likeness;
pub use measured::{CAMERA_COUNT, Cell, Plan, SceneResult, measure};
pub use pictures::Pictures;
pub use report::{Experiment, PICTURES};
pub use times::{Statistic, Times};
pub use trace_path::TracePath;
