//! Why the sample cannot render.

use crate::hybrid::HybridError;

/// Why the `reflections` sample cannot render.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReflectionsError {
    /// `lvk` reported an error.
    #[error(transparent)]
    Device(#[from] lvk::Error),
    /// The device cannot trace rays, or not by the path that was asked for.
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
    /// No samples, or too many.
    #[error("--samples {samples} is not possible: 1 to {limit}")]
    BadSamples {
        /// What was asked for.
        samples: u32,
        /// The largest number.
        limit: u32,
    },
}
