//! Why the sample cannot render.

use crate::hybrid::HybridError;

/// Why the `hybrid_oit` sample cannot render.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum HybridOitError {
    /// `lvk` reported an error.
    #[error(transparent)]
    Device(#[from] lvk::Error),
    /// The device does not trace rays, or not by the path that was asked for.
    #[error(transparent)]
    Path(#[from] HybridError),
    /// The picture has no pixels or more than the device takes.
    #[error(
        "a picture of {width}x{height} pixels with {supersampling}x{supersampling} samples each is not possible: each \
         side must have 1 to {limit} samples"
    )]
    BadSize {
        /// Pixels in a row.
        width: u32,
        /// Rows.
        height: u32,
        /// Samples a pixel along each side.
        supersampling: u32,
        /// Most samples along a side of the picture.
        limit: u32,
    },
    /// More fragments than a counter of 32 bits holds.
    #[error(
        "{samples} samples seen through {spheres} spheres of glass are more than can be counted; make the picture smaller"
    )]
    TooManyFragments {
        /// Samples of the picture.
        samples: u64,
        /// Spheres of glass.
        spheres: usize,
    },
    /// A setting is outside of its range.
    #[error("{what} is {value}, it must be {range}")]
    OutOfRange {
        /// Name of the setting.
        what: &'static str,
        /// What was asked for.
        value: u32,
        /// What is possible.
        range: &'static str,
    },
    /// The scene lacks something the sample is about, or holds numbers that are none.
    #[error("the scene cannot be drawn: {0}")]
    BrokenScene(&'static str),
}
