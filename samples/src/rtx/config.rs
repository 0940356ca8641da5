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

    /// Creates the target of images of `extent` pixels. Takes over the extent, unless this fails.
    pub(crate) fn resize(
        &mut self,
        ctx: &Context,
        [width, height]: [u32; 2],
    ) -> Result<RenderTarget, SampleError> {
        let resized = Self { width, height, ..*self };
        let target = resized.create_target(ctx)?;
        *self = resized;
        Ok(target)
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
