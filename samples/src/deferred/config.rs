//! The configuration of the sample.

use crate::app::sample_error::SampleError;
use clap::ValueEnum;
use lvk::{Context, OptionalFeature};

/// The path of surface data to the lighting shaders.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Passes {
    /// One pass, whose shaders read the pass's own targets
    One,
    /// Several passes; later ones sample the targets of earlier ones as textures
    Several,
}

impl Passes {
    /// All of them that a device can do, the best first.
    #[must_use]
    pub fn supported(ctx: &Context) -> &'static [Self] {
        let one = ctx.capabilities().has(OptionalFeature::LocalRead);
        if one { &[Self::One, Self::Several] } else { &[Self::Several] }
    }

    /// Returns the requested passes, or the best.
    pub(super) fn choose(asked: Option<Self>, ctx: &Context) -> Result<Self, SampleError> {
        let there = Self::supported(ctx);
        let passes = asked.unwrap_or(there[0]);
        let what = "shaders that read what their own pass has drawn (dynamicRenderingLocalRead)";
        SampleError::require(there.contains(&passes), ctx, what, "--passes several shows the same picture")?;
        Ok(passes)
    }
}

/// The quantity that images show.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum View {
    /// Surfaces in the light
    #[default]
    Picture,
    /// Their colours
    Albedo,
    /// Their normals
    Normals,
    /// Their roughness
    Roughness,
    /// Their depth
    Depth,
}

impl View {
    /// All of them, as shaders number them.
    pub const ALL: [Self; 5] = [Self::Picture, Self::Albedo, Self::Normals, Self::Roughness, Self::Depth];
}

/// The configuration of the sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeferredConfig {
    /// Width and height of the picture in pixels.
    pub extent: [u32; 2],
    /// `None` for the best that the device can do.
    pub passes: Option<Passes>,
    /// Number of lights, 1 to [`DeferredConfig::MAX_LIGHTS`].
    pub lights: u32,
    /// The quantity that the image shows.
    pub view: View,
}

impl DeferredConfig {
    /// The largest number of lights.
    pub const MAX_LIGHTS: u32 = 4096;
    /// As many as the picture was made for.
    pub const LIGHTS: u32 = 700;

    /// As usual but for the size.
    #[must_use]
    pub fn new(extent: [u32; 2]) -> Self {
        Self { extent, passes: None, lights: Self::LIGHTS, view: View::Picture }
    }
}
