//! The configuration of the sample.

use lvk::Capabilities;

use crate::hybrid::RayPath;
use crate::rtx::RtxConfig;

/// Levels of recursion besides those of mirrored and bent rays: the pixel's ray, and the last hit's shadow rays.
const OTHER_LEVELS: u32 = 2;

/// The configuration of the sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RtxPipelineConfig {
    /// Path and size.
    pub rtx: RtxConfig,
    /// Largest number of reflections and refractions, 0 to [`RtxPipelineConfig::MAX_DEPTH`]; less where the device's
    /// pipelines
    /// cannot trace so deep.
    pub depth: u32,
}

impl RtxPipelineConfig {
    /// The largest depth.
    pub const MAX_DEPTH: u32 = 16;
    /// Levels of recursion at that depth.
    pub(super) const MAX_RECURSION: u32 = Self::MAX_DEPTH + OTHER_LEVELS;

    /// As usual but for path and size.
    #[must_use]
    pub fn new(rtx: RtxConfig) -> Self {
        Self { rtx, depth: 4 }
    }

    /// Returns a path and a depth that the device supports. Pipelines that cannot trace a shadow ray from a hit shader leave it
    /// to queries, if the device has them.
    pub(super) fn valid_for(self, capabilities: &Capabilities) -> Self {
        let levels = capabilities.limits.max_ray_recursion;
        let depth = self.depth.min(Self::MAX_DEPTH);
        match self.rtx.path {
            RayPath::Query => Self { depth, ..self },
            RayPath::Pipeline if levels < OTHER_LEVELS => {
                Self { rtx: RtxConfig { path: RayPath::Query, ..self.rtx }, depth }
            }
            RayPath::Pipeline => Self { depth: depth.min(levels - OTHER_LEVELS), ..self },
        }
    }

    /// Levels of recursion of the pipeline.
    pub(super) fn max_recursion(&self) -> u32 {
        self.depth + OTHER_LEVELS
    }
}
