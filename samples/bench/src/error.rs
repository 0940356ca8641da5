//! Errors of the benchmarks.

use std::path::PathBuf;

use lvk::ash::vk;

use crate::embree::EmbreeError;
use crate::paper::PaperError;
use lvk_dev_driver::DriverError;
use lvk_samples::app::interrupt;
use lvk_samples::app::run_error::RunError;
use lvk_samples::scene::SceneError;

/// An error of a benchmark.
#[derive(Debug, thiserror::Error)]
pub(super) enum BenchError {
    #[error(transparent)]
    Scene(#[from] SceneError),
    #[error(transparent)]
    Driver(#[from] DriverError),
    #[error(transparent)]
    Device(#[from] lvk::Error),
    #[error(transparent)]
    Paper(#[from] PaperError),
    #[error("{call} failed in the hand-written code: {result}")]
    HandWritten { call: &'static str, result: vk::Result },
    #[error("{device} can trace rays neither by pipeline nor by query; choose another device with --device")]
    NoRayTracing { device: String },
    #[error("{device} wrote no timestamp")]
    NoTimestamp { device: String },
    #[error("{device} did not finish a compaction within {tries} submissions")]
    NoCompaction { device: String, tries: u32 },
    #[error("interrupted; {done} of {of} scenes are in {}", lvk::readable_name(page))]
    Interrupted { done: usize, of: usize, page: PathBuf },
    #[error("no benchmark is named; `bench --help` lists them")]
    NoBenchmark,
    #[error("cannot create a folder for the BVH cache: {0}")]
    NoFolder(#[from] std::io::Error),
    #[error(transparent)]
    Embree(#[from] EmbreeError),
    #[error("cannot write {}: {source}; choose another folder", lvk::readable_name(path))]
    Write { path: PathBuf, source: std::io::Error },
    #[error("cannot draw {name}: {what}")]
    Plot { name: String, what: String },
    #[error("the process that loads an OBJ file ended with {0}")]
    Child(String),
    #[error("{0}")]
    Peers(String),
    #[error(
        "`peers` takes the first device without --device and --profile; VK_DRIVER_FILES chooses the driver"
    )]
    PeersDevice,
    #[error(transparent)]
    Listing(#[from] RunError),
    #[error("number of messages that validation reported: {}; the first: {}", .0.len(), .0.first().map_or("", String::as_str))]
    Validation(Vec<String>),
}

impl BenchError {
    /// Returns a closure for `map_err` of a Vulkan call of the hand-written code.
    pub(super) fn hand_written(call: &'static str) -> impl Fn(vk::Result) -> Self {
        move |result| Self::HandWritten { call, result }
    }

    /// Returns the exit status: 2 for wrong arguments or input, 1 for a device error, 130 after Ctrl-C.
    pub(super) fn status(&self) -> u8 {
        match self {
            Self::Interrupted { .. } => interrupt::STATUS,
            Self::NoBenchmark | Self::PeersDevice | Self::Embree(EmbreeError::Library { .. }) => 2,
            Self::Listing(error) => error.status(),
            Self::Paper(error) if error.is_input() => 2,
            Self::Write { .. } | Self::Scene(_) | Self::Driver(DriverError::Variable { .. }) => 2,
            _ => 1,
        }
    }
}
