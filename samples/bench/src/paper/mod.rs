//! The experiment of Kim and Baek's paper: GPU times and image metrics of stand-alone and hybrid ray tracing along five camera
//! paths per scene, compared with the paper's numbers.
//!
//! `bench paper` runs the experiment. Other programs can call [`measure`], which measures a scene on an open context, and
//! [`Experiment`], which writes the report.

mod args;
mod bar_chart;
mod command;
mod csv;
mod date;
mod error;
mod goals;
mod image_metrics;
mod legend;
mod line_chart;
mod measure;
mod plots;
mod published;
mod report;
mod report_images;
mod tables;
mod times;
mod trace_path;

pub use args::PaperArgs;
pub(super) use command::run;
pub(super) use date::today;
pub use error::PaperError;
pub use image_metrics::ImageMetrics;
pub use measure::{CAMERA_COUNT, CameraResult, ExperimentPlan, SceneResult, measure};
pub use report::{Experiment, IMAGE_FOLDER};
pub use report_images::ReportImages;
pub use times::{Statistic, Times};
pub use trace_path::TracePath;
