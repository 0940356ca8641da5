//! The configuration of the sample.

use crate::app::sample_error::SampleError;
use lvk::Capabilities;

use crate::hybrid::RayPath;

/// The build mode of the skinned character's BLAS.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SkinUpdate {
    /// The structure of the first frame is refitted.
    #[default]
    Refit,
    /// The structure is built anew in every frame, for comparison.
    Rebuild,
}

/// The configuration of the sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReflectionsConfig {
    /// The part of Vulkan that traces rays.
    pub path: RayPath,
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Samples of each pixel, 1 to [`ReflectionsConfig::MAX_SAMPLES`]: they smooth edges, reflections and shadows.
    pub samples: u32,
    /// Instances seen under a smaller angle than this, in radians, are left out of the top-level structure; 0 keeps
    /// them all.
    pub min_angle: f32,
    /// The build mode of the skinned character's BLAS.
    pub skin_update: SkinUpdate,
}

impl ReflectionsConfig {
    /// The largest number of samples.
    pub const MAX_SAMPLES: u32 = 256;
    /// A smallest angle that is about four pixels of a picture of 720 rows.
    pub const DEFAULT_MIN_ANGLE: f32 = 0.005;

    /// A picture of this size by `path`, everything else as usual.
    #[must_use]
    pub fn new(path: RayPath, width: u32, height: u32) -> Self {
        let (samples, min_angle) = (4, Self::DEFAULT_MIN_ANGLE);
        Self { path, width, height, samples, min_angle, skin_update: SkinUpdate::default() }
    }

    pub(super) fn check(&self, capabilities: &Capabilities) -> Result<(), SampleError> {
        SampleError::check_size([self.width, self.height], capabilities)?;
        SampleError::check_range("--samples", self.samples, [1, Self::MAX_SAMPLES])?;
        RayPath::choose(Some(self.path), capabilities)?;
        Ok(())
    }
}
