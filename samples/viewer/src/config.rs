//! The configuration of the sample.

use lvk::Capabilities;
use lvk_samples::app::sample_error::SampleError;
use lvk_samples::hybrid::RayPath;

/// The mapping of radiance to what a display shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ToneMapping {
    /// Khronos PBR Neutral.
    #[default]
    Neutral,
    /// None.
    Linear,
}

/// The configuration of the sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ViewerConfig {
    /// The part of Vulkan that traces rays.
    pub path: RayPath,
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Samples of each pixel, 1 to [`ViewerConfig::MAX_SAMPLES`].
    pub samples: u32,
    /// Surfaces that a path meets at most, at least 1.
    pub bounces: u32,
    /// Exposure in stops.
    pub exposure_stops: f32,
    /// Mapping of radiance to what a display shows.
    pub tone_mapping: ToneMapping,
    /// True if each frame adds a pass to those before while nothing moves, as in a window; else each frame has all its samples.
    pub is_progressive: bool,
}

impl ViewerConfig {
    /// Largest number of samples.
    pub const MAX_SAMPLES: u32 = 65_536;
    /// Usual number of samples.
    pub const DEFAULT_SAMPLES: u32 = 64;
    /// Usual largest number of surfaces of a path.
    pub const DEFAULT_BOUNCES: u32 = 32;

    /// A picture of this size by `path`, everything else as usual.
    #[must_use]
    pub fn new(path: RayPath, width: u32, height: u32) -> Self {
        Self {
            path,
            width,
            height,
            samples: Self::DEFAULT_SAMPLES,
            bounces: Self::DEFAULT_BOUNCES,
            exposure_stops: 0.0,
            tone_mapping: ToneMapping::default(),
            is_progressive: false,
        }
    }

    /// Width and height.
    pub(crate) fn extent(&self) -> [u32; 2] {
        [self.width, self.height]
    }

    pub(crate) fn check(&self, capabilities: &Capabilities) -> Result<(), SampleError> {
        SampleError::check_size(self.extent(), capabilities)?;
        SampleError::check_range("--samples", self.samples, [1, Self::MAX_SAMPLES])?;
        SampleError::check_range("--bounces", self.bounces, [1, u32::MAX - 1])?;
        RayPath::choose(Some(self.path), capabilities)?;
        Ok(())
    }
}
