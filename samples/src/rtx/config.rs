//! What to render, and by which means of the device.

use lvk::Capabilities;

use super::RtxError;
use crate::app::ray_args::RayTracing;
use crate::hybrid::RayPath;

/// What to render.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RtxConfig {
    /// By which part of Vulkan rays are traced.
    pub path: RayPath,
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

impl RtxConfig {
    /// What the command line asks for.
    pub(crate) fn from_args(
        wish: RayTracing,
        [width, height]: [u32; 2],
        capabilities: &Capabilities,
    ) -> Result<Self, RtxError> {
        let path = RayPath::choose(RayPath::from_args(wish), capabilities)?;
        Ok(Self { path, width, height })
    }

    /// The same for a picture of `extent` pixels.
    pub(crate) fn sized(self, [width, height]: [u32; 2]) -> Self {
        Self { width, height, ..self }
    }

    /// Width and height.
    pub(crate) fn extent(&self) -> [u32; 2] {
        [self.width, self.height]
    }

    pub(crate) fn check(&self, capabilities: &Capabilities) -> Result<(), RtxError> {
        let limit = capabilities.limits.max_texture_2d;
        let [width, height] = self.extent();
        if width == 0 || height == 0 || width > limit || height > limit {
            return Err(RtxError::BadSize { width, height, limit });
        }
        RayPath::choose(Some(self.path), capabilities)?;
        Ok(())
    }
}
