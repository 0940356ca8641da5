//! The configuration of the sample.

use crate::app::sample_error::SampleError;
use clap::ValueEnum;
use lvk::{Context, OptionalFeature};

/// The configuration of the sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SponzaConfig {
    /// Width and height of the picture in pixels.
    pub extent: [u32; 2],
    /// Samples a pixel: 1 or 4.
    pub samples: u32,
    /// True if draws outside of the frusta are left out.
    pub culls: bool,
    /// Source of the number of draws; `None` for the one that suits the device.
    pub draws: Option<DrawPath>,
    /// Texels on an edge of the shadow map, 16 to [`SponzaConfig::MAX_SHADOW_SIZE`].
    pub shadow_size: u32,
    /// Texels to each side that shadows are filtered over: 0 for one comparison, at most [`SponzaConfig::MAX_FILTER`].
    pub filter: u32,
    /// Most triangles of a draw, at least 1.
    pub triangles_per_draw: u32,
    /// True if surfaces have the relief of their normal maps.
    pub normal_maps: bool,
}

/// Source of the number of draws after culling.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum DrawPath {
    /// As many as the shader has counted (`drawIndirectCount`).
    Counted,
    /// All there are, where those that were culled have no vertices: for devices without the other.
    Padded,
}

impl SponzaConfig {
    /// The largest shadow map.
    pub const MAX_SHADOW_SIZE: u32 = 8192;
    /// The largest filter.
    pub const MAX_FILTER: u32 = 4;

    /// As usual but for the size of the picture.
    #[must_use]
    pub fn new(extent: [u32; 2]) -> Self {
        let (shadow_size, filter) = (2048, 2);
        Self {
            extent,
            samples: 4,
            culls: true,
            draws: None,
            shadow_size,
            filter,
            triangles_per_draw: 256,
            normal_maps: true,
        }
    }

    /// Within the bounds of its numbers, with draws that the device has.
    ///
    /// # Errors
    /// [`SampleError::Missing`] for counted draws on a device without them, and for samples that are neither 1 nor 4.
    pub(super) fn valid_for(self, ctx: &Context) -> Result<Self, SampleError> {
        let has_counts = ctx.capabilities().has(OptionalFeature::DrawIndirectCount);
        let best = if has_counts { DrawPath::Counted } else { DrawPath::Padded };
        let draws = self.draws.unwrap_or(best);
        let what = "draws whose number is in a buffer (drawIndirectCount)";
        SampleError::require(draws == DrawPath::Padded || has_counts, ctx, what, "use --draws padded")?;
        let what = "pictures of this many samples a pixel";
        SampleError::require(matches!(self.samples, 1 | 4), ctx, what, "use --msaa 1 or 4")?;
        let limit = Self::MAX_SHADOW_SIZE.min(ctx.capabilities().limits.max_texture_2d);
        Ok(Self {
            draws: Some(draws),
            shadow_size: self.shadow_size.clamp(16, limit.max(16)),
            filter: self.filter.min(Self::MAX_FILTER),
            triangles_per_draw: self.triangles_per_draw.max(1),
            ..self
        })
    }
}
