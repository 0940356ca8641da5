//! The configuration of the sample.

use crate::app::sample_error::SampleError;
use lvk::{Capabilities, Context, OptionalFeature};

use super::cube_map::FACES;
use super::info::FacesArg;

/// The number of passes that draw the faces of the cube map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CubeMapFaces {
    /// A pass for each.
    SixPasses,
    /// All in one pass, with a view for each (`VK_KHR_multiview`): draws are recorded once, and the device repeats them.
    OnePass,
}

/// The configuration of the sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RenderToCubeMapConfig {
    /// Width and height of the picture in pixels.
    pub extent: [u32; 2],
    /// The number of passes that draw the faces.
    pub faces: CubeMapFaces,
    /// Side of a face in pixels, 1 to [`MAX_FACE_SIZE`](Self::MAX_FACE_SIZE).
    pub face_size: u32,
    /// Roughness of the drop, 0 to 1: the share of the mips that is skipped.
    pub roughness: f32,
}

impl RenderToCubeMapConfig {
    /// Largest side of cube maps that every device supports.
    pub const MAX_FACE_SIZE: u32 = 4096;

    /// As usual but for the size of the picture and the way that faces are drawn.
    #[must_use]
    pub fn new(extent: [u32; 2], faces: CubeMapFaces) -> Self {
        Self { extent, faces, face_size: 512, roughness: 0.0 }
    }
}

impl CubeMapFaces {
    /// The choice of the command line.
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

/// True if a pass can draw all faces at once.
pub(super) fn has_six_views(capabilities: &Capabilities) -> bool {
    capabilities.has(OptionalFeature::Multiview) && capabilities.limits.max_views >= FACES
}
