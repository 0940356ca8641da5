//! Why one of the samples cannot render.

use crate::app::run_error::RunError;
use crate::hybrid::HybridError;

/// Why one of the samples cannot render.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RtxError {
    /// `lvk` reported an error.
    #[error(transparent)]
    Device(#[from] lvk::Error),
    /// The device cannot trace rays or not by the path that was asked for, or the scene is beyond it.
    #[error(transparent)]
    Rays(#[from] HybridError),
    /// The picture has no pixels or more than the device takes.
    #[error("a picture of {width}x{height} pixels is not possible: each side must be 1 to {limit}")]
    BadSize {
        /// Pixels in a row.
        width: u32,
        /// Rows.
        height: u32,
        /// Most pixels a side.
        limit: u32,
    },
}

impl From<RtxError> for RunError {
    fn from(error: RtxError) -> Self {
        match error {
            RtxError::BadSize { .. } => Self::input(error),
            RtxError::Rays(error) => error.into(),
            RtxError::Device(_) => Self::device(error),
        }
    }
}
