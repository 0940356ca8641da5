//! Why one of the samples cannot render.

use lvk::Context;

use crate::app::run_error::RunError;

/// Why one of the samples cannot render.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RasterError {
    /// `lvk` reported an error.
    #[error(transparent)]
    Device(#[from] lvk::Error),
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
    /// A scene made by hand breaks the invariants of [`Scene`](crate::scene::Scene).
    #[error("{0}")]
    Scene(String),
    /// The device lacks what the sample, or the way to draw that was asked for, is about.
    #[error("{device} has no {what}; {remedy}")]
    Missing {
        /// Name of the device.
        device: String,
        /// What it lacks.
        what: &'static str,
        /// What the user can do.
        remedy: &'static str,
    },
}

impl RasterError {
    /// A scene that cannot be drawn.
    pub(crate) fn scene(error: crate::hybrid::HybridError) -> Self {
        Self::Scene(error.to_string())
    }

    /// Fails unless the device `has` something.
    ///
    /// # Errors
    /// [`RasterError::Missing`].
    pub fn require(has: bool, ctx: &Context, what: &'static str, remedy: &'static str) -> Result<(), Self> {
        let device = || ctx.capabilities().device_name.clone();
        if has { Ok(()) } else { Err(Self::Missing { device: device(), what, remedy }) }
    }
}

impl From<RasterError> for RunError {
    fn from(error: RasterError) -> Self {
        match error {
            RasterError::BadSize { .. } | RasterError::Scene(_) => Self::input(error),
            RasterError::Device(_) | RasterError::Missing { .. } => Self::device(error),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn programs_tell_wrong_input_from_devices_that_cannot() {
        let size = RasterError::BadSize { width: 0, height: 1, limit: 2 };
        let missing = RasterError::Missing { device: "Toy".to_owned(), what: "wings", remedy: "walk" };
        assert_eq!(missing.to_string(), "Toy has no wings; walk");
        assert_eq!([size, missing].map(|error| RunError::from(error).status()), [2, 1]);
    }
}
