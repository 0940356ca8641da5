//! The configuration of the sample.

use lvk::{Capabilities, Context};

use crate::app::ray_args::RayTracing;
use crate::app::render_target::RenderTarget;
use crate::app::sample_error::SampleError;
use crate::hybrid::RayPath;

/// The configuration of the sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RtxConfig {
    /// The part of Vulkan that traces rays.
    pub path: RayPath,
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

impl RtxConfig {
    /// The choice of the command line.
    pub(crate) fn from_args(
        wish: RayTracing,
        [width, height]: [u32; 2],
        capabilities: &Capabilities,
    ) -> Result<Self, SampleError> {
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

    /// Checks the configuration and creates the storage image that shaders write to.
    pub(crate) fn create_target(&self, ctx: &Context) -> Result<RenderTarget, SampleError> {
        let target = RenderTarget::storage(ctx, self.extent())?;
        RayPath::choose(Some(self.path), ctx.capabilities())?;
        Ok(target)
    }
}
