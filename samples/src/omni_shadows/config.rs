//! The configuration of the sample.

use crate::app::sample_error::SampleError;
use clap::ValueEnum;
use lvk::{Context, OptionalFeature};

/// The number of passes that draw the faces of the cube map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ShadowFaces {
    /// All at once where the device can, else one after the other.
    Auto,
    /// All at once, by multiview.
    Multiview,
    /// One after the other.
    Single,
}

/// The filter of the shadow, in the order of `shaders/omni_shadows/frame.glsl`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ShadowFilter {
    /// No shadow.
    Off,
    /// One comparison.
    Hard,
    /// Four, weighted by the sampler.
    Linear,
    /// As wide as the lamp's size, the blocker and the surface say.
    Soft,
}

/// The configuration of the sample. Numbers out of range count as the nearest number in range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OmniShadowsConfig {
    /// Pixels in a row, and rows.
    pub extent: [u32; 2],
    /// Texels on an edge of the cube map, 16 to [`OmniShadowsConfig::MAX_SHADOW_SIZE`].
    pub shadow_size: u32,
    /// The number of passes that draw its faces.
    pub faces: ShadowFaces,
    /// The filter of the shadow.
    pub filter: ShadowFilter,
    /// Radius of the lamp in metres, which soft shadows follow from: 0 to 0.1.
    pub lamp_radius: f32,
    /// Density of the haze, 0 for clear to 1.
    pub haze: f32,
    /// True if the cube map is shown in a corner.
    pub shows_cube: bool,
}

impl OmniShadowsConfig {
    /// Most texels on an edge of the cube map: every device has that many.
    pub const MAX_SHADOW_SIZE: u32 = 4096;

    /// As usual but for the size.
    #[must_use]
    pub fn new(extent: [u32; 2]) -> Self {
        Self {
            extent,
            shadow_size: 1024,
            faces: ShadowFaces::Auto,
            filter: ShadowFilter::Soft,
            lamp_radius: 0.012,
            haze: 0.005,
            shows_cube: false,
        }
    }

    /// Clamps every number to its range.
    pub(super) fn clamped(self) -> Self {
        let within = |value: f32, most| if value.is_nan() { 0.0 } else { value.clamp(0.0, most) };
        Self {
            shadow_size: self.shadow_size.clamp(16, Self::MAX_SHADOW_SIZE),
            lamp_radius: within(self.lamp_radius, 0.1),
            haze: within(self.haze, 1.0),
            ..self
        }
    }
}

impl ShadowFaces {
    /// True if the device can draw all at once.
    pub(super) fn can_be_one_pass(ctx: &Context) -> bool {
        let capabilities = ctx.capabilities();
        capabilities.has(OptionalFeature::Multiview) && capabilities.limits.max_views >= 6
    }

    /// True if all are drawn at once.
    ///
    /// # Errors
    /// [`SampleError::Missing`] where that is asked for and the device cannot.
    pub(super) fn are_one_pass(self, ctx: &Context) -> Result<bool, SampleError> {
        let can = Self::can_be_one_pass(ctx);
        if self == Self::Multiview {
            let remedy = "--faces single draws one face after the other";
            SampleError::require(can, ctx, "multiview of six views", remedy)?;
        }
        Ok(can && self != Self::Single)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_kept_in_range() {
        let config = OmniShadowsConfig::new([8, 8]);
        assert_eq!(config.clamped(), config);
        let wild = OmniShadowsConfig { shadow_size: 0, lamp_radius: f32::NAN, haze: -1.0, ..config };
        let OmniShadowsConfig { shadow_size, lamp_radius, haze, .. } = wild.clamped();
        assert_eq!((shadow_size, lamp_radius, haze), (16, 0.0, 0.0));
        let wild =
            OmniShadowsConfig { shadow_size: u32::MAX, lamp_radius: 9.0, haze: f32::INFINITY, ..config };
        let OmniShadowsConfig { shadow_size, lamp_radius, haze, .. } = wild.clamped();
        assert_eq!((shadow_size, lamp_radius, haze), (4096, 0.1, 1.0));
    }
}
