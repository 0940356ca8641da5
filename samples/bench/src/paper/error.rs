//! Errors of the experiment.

use std::path::{Path, PathBuf};

use lvk_samples::app::metrics::SizeError;
use lvk_samples::app::png::PngError;
use lvk_samples::app::sample_error::SampleError;

/// An error of the experiment.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PaperError {
    /// A renderer failed.
    #[error(transparent)]
    Hybrid(#[from] SampleError),
    /// An image could not be written.
    #[error(transparent)]
    Png(#[from] PngError),
    /// Two images could not be compared.
    #[error(transparent)]
    Size(#[from] SizeError),
    /// A file of the report could not be written.
    #[error("cannot write {}: {source}; choose another --out", lvk::readable_name(path))]
    Write {
        /// The file.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// A plot could not be drawn.
    #[error("cannot draw {name}: {what}")]
    Plot {
        /// Name of the plot.
        name: String,
        /// Message of the drawing library.
        what: String,
    },
    /// The device has no timestamp queries, which the experiment requires.
    #[error(
        "{device} has no timestamp queries, which the experiment requires; choose another device with --device"
    )]
    NoTimestamps {
        /// Name of the device.
        device: String,
    },
    /// The context uses another implementation of ray queries than the plan.
    #[error(
        "the plan is to trace by {planned}, but the context traces by {found}; see ContextDesc::ray_query"
    )]
    OtherPath {
        /// Name of the path in the plan.
        planned: &'static str,
        /// Name of the path of the context.
        found: &'static str,
    },
}

impl PaperError {
    /// Returns a closure for `map_err` of an operation that writes `path`.
    pub(super) fn write(path: &Path) -> impl Fn(std::io::Error) -> Self {
        move |source| Self::Write { path: path.to_owned(), source }
    }

    /// True if other arguments can avoid the error.
    #[must_use]
    pub fn is_input(&self) -> bool {
        matches!(self, Self::Png(_) | Self::Write { .. })
    }
}
