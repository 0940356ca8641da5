//! The configuration of the sample.

use crate::rtx::RtxConfig;

/// The configuration of the sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RtxAoConfig {
    /// Path and size.
    pub rtx: RtxConfig,
    /// Passes that a call of render adds, 1 to [`RtxAoConfig::MAX_PASSES`].
    pub passes: u32,
    /// Rays to the surroundings of each pixel and pass, 1 to [`RtxAoConfig::MAX_RAYS`].
    pub rays: u32,
    /// Radius of the ambient occlusion in scene units; `None` for a share of the scene's size.
    pub radius: Option<f32>,
}

impl RtxAoConfig {
    /// The largest number of passes.
    pub const MAX_PASSES: u32 = 4096;
    /// The largest number of rays.
    pub const MAX_RAYS: u32 = 64;

    /// As usual but for path and size.
    #[must_use]
    pub fn new(rtx: RtxConfig) -> Self {
        Self { rtx, passes: 16, rays: 2, radius: None }
    }

    /// Numbers out of range count as the nearest that is not.
    pub(super) fn clamped(self) -> Self {
        let (passes, rays) = (self.passes.clamp(1, Self::MAX_PASSES), self.rays.clamp(1, Self::MAX_RAYS));
        Self { passes, rays, ..self }
    }
}
