//! Why the experiment did not end.

use crate::app::sample_error::SampleError;
use std::path::{Path, PathBuf};

use crate::app::metrics::SizeError;
use crate::app::png::PngError;

/// Why the experiment did not end.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PaperError {
    /// A method could not render.
    #[error(transparent)]
    Hybrid(#[from] SampleError),
    /// A picture could not be written.
    #[error(transparent)]
    Png(#[from] PngError),
    /// Two pictures could not be compared.
    #[error(transparent)]
    Size(#[from] SizeError),
    /// A file of the report could not be written.
    #[error("cannot write {}: {source}; choose another --out", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A plot could not be drawn.
    #[error("cannot draw {name}: {what}")]
    Plot {
        /// Name of the plot.
        name: String,
        /// What the drawing library said.
        what: String,
    },
    /// Without timestamps there is nothing to measure with.
    #[error("{device} has no timestamps, by which the experiment measures; choose another one with --device")]
    NoTimestamps {
        /// Name of the device.
        device: String,
    },
    /// The device was opened with other ray queries than are to be measured.
    #[error(
        "the plan is to trace by {planned}, but the device was opened to trace by {found}; see ContextDesc::ray_query"
    )]
    OtherPath {
        /// Name of the path in the plan.
        planned: &'static str,
        /// Name of what the device does.
        found: &'static str,
    },
}

impl PaperError {
    /// For `map_err` of what writes `path`.
    pub(super) fn write(path: &Path) -> impl Fn(std::io::Error) -> Self {
        move |source| Self::Write { path: path.to_owned(), source }
    }

    /// Whether the user can mend it by other arguments.
    #[must_use]
    pub fn is_input(&self) -> bool {
        matches!(self, Self::Png(_) | Self::Write { .. })
    }
}
