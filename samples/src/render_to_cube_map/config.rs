//! What to render, and how.

use crate::app::sample_error::SampleError;
use lvk::{Capabilities, Context, OptionalFeature};

use super::cube_map::FACES;
use super::info::FacesArg;

/// How the faces of the cube map are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Faces {
    /// A pass for each.
    SixPasses,
    /// All in one pass, with a view for each (`VK_KHR_multiview`): draws are recorded once, and the device repeats them.
    OnePass,
}

/// What to render, and how.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RenderToCubeMapConfig {
    /// Width and height of the picture in pixels.
    pub extent: [u32; 2],
    /// How the faces are drawn.
    pub faces: Faces,
    /// Side of a face in pixels, 1 to [`MAX_FACE_SIZE`](Self::MAX_FACE_SIZE).
    pub face_size: u32,
    /// How blurred the drop mirrors, 0 to 1: the part of the mips that is skipped.
    pub roughness: f32,
}

impl RenderToCubeMapConfig {
    /// What the sides of cube maps are at least allowed to be, on every device.
    pub const MAX_FACE_SIZE: u32 = 4096;

    /// As usual but for the size of the picture and the way that faces are drawn.
    #[must_use]
    pub fn new(extent: [u32; 2], faces: Faces) -> Self {
        Self { extent, faces, face_size: 512, roughness: 0.0 }
    }
}

impl Faces {
    /// What the command line asks for.
    pub(super) fn from_args(wish: FacesArg, capabilities: &Capabilities) -> Self {
        match wish {
            FacesArg::SixPasses => Self::SixPasses,
            FacesArg::OnePass => Self::OnePass,
            FacesArg::Auto if has_six_views(capabilities) => Self::OnePass,
            FacesArg::Auto => Self::SixPasses,
        }
    }

    /// Fails where the device cannot.
    pub(super) fn check(self, ctx: &Context) -> Result<(), SampleError> {
        let can = self == Self::SixPasses || has_six_views(ctx.capabilities());
        SampleError::require(can, ctx, "passes of six views", "draw the faces by --faces six-passes")
    }
}

/// Whether a pass can draw all faces at once.
pub(super) fn has_six_views(capabilities: &Capabilities) -> bool {
    capabilities.has(OptionalFeature::Multiview) && capabilities.limits.max_views >= FACES
}
