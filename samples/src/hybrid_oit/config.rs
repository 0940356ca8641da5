//! The configuration of the sample.

use crate::app::sample_error::SampleError;
use lvk::Capabilities;

use crate::hybrid::RayPath;

/// The configuration of the sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct HybridOitConfig {
    /// The part of Vulkan that traces rays.
    pub path: RayPath,
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Samples a pixel along each side, 1 to [`HybridOitConfig::MAX_SUPERSAMPLING`].
    pub supersampling: u32,
    /// Shadow rays a sample, 1 to [`HybridOitConfig::MAX_SHADOW_RAYS`]; a single one aims at the middle of the sun.
    pub shadow_rays: u32,
    /// Nodes in the pool of the glass lists, 0 and up; `None` for [`HybridOitConfig::NODES_PER_SAMPLE`] a sample. Glass
    /// that finds no node is left out and counted; which, is up to the device.
    pub node_capacity: Option<u32>,
}

impl HybridOitConfig {
    /// The largest supersampling.
    pub const MAX_SUPERSAMPLING: u32 = 4;
    /// Most shadow rays a sample.
    pub const MAX_SHADOW_RAYS: u32 = 64;
    /// Nodes in the pool for each sample of the picture unless told otherwise: about three times what the built-in
    /// scene asks for.
    pub const NODES_PER_SAMPLE: u32 = 2;

    /// A picture of `width` times `height` pixels with four samples each, and four shadow rays a sample.
    #[must_use]
    pub fn new(path: RayPath, width: u32, height: u32) -> Self {
        Self { path, width, height, supersampling: 2, shadow_rays: 4, node_capacity: None }
    }

    /// Width and height in samples.
    pub(super) fn extent(&self) -> [u32; 2] {
        [self.width, self.height].map(|side| side.saturating_mul(self.supersampling))
    }

    /// Nodes in the pool.
    pub(super) fn nodes(&self) -> u32 {
        let [width, height] = self.extent();
        let usual = width.saturating_mul(height).saturating_mul(Self::NODES_PER_SAMPLE);
        self.node_capacity.unwrap_or(usual)
    }

    /// Checks everything against what the device with `capabilities` can do, for `glass_count` spheres of glass.
    pub(super) fn check(&self, capabilities: &Capabilities, glass_count: usize) -> Result<(), SampleError> {
        SampleError::check_range("supersampling", self.supersampling, [1, Self::MAX_SUPERSAMPLING])?;
        SampleError::check_range("the number of shadow rays", self.shadow_rays, [1, Self::MAX_SHADOW_RAYS])?;
        let limit = capabilities.limits.max_texture_2d;
        let [wide, high] = self.extent();
        if wide == 0 || high == 0 || wide > limit || high > limit {
            let Self { width, height, supersampling, .. } = *self;
            return Err(SampleError::BadSampleCount { width, height, supersampling, limit });
        }
        let samples = u64::from(wide) * u64::from(high);
        if samples.saturating_mul(2 * glass_count as u64) > u64::from(u32::MAX) {
            return Err(SampleError::TooManyFragments { samples, spheres: glass_count });
        }
        RayPath::choose(Some(self.path), capabilities)?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use lvk::Limits;

    use super::*;

    fn device() -> Capabilities {
        Capabilities {
            ray_query: true,
            limits: Limits { max_texture_2d: 16_384, ..Limits::default() },
            ..Capabilities::default()
        }
    }

    #[test]
    fn impossible_pictures_are_refused() {
        let good = HybridOitConfig::new(RayPath::Query, 640, 360);
        assert!(good.check(&device(), 12).is_ok());
        assert_eq!((good.extent(), good.nodes()), ([1280, 720], 1_843_200));
        for (width, height, supersampling) in [(0, 9, 1), (9, 0, 2), (16_384, 9, 2), (u32::MAX, u32::MAX, 4)]
        {
            let bad = HybridOitConfig { width, height, supersampling, ..good };
            assert!(matches!(bad.check(&device(), 12), Err(SampleError::BadSampleCount { .. })), "{bad:?}");
        }
        let vast = HybridOitConfig { width: 16_384, height: 16_384, supersampling: 1, ..good };
        assert!(matches!(vast.check(&device(), 8), Err(SampleError::TooManyFragments { .. })));
        assert!(vast.check(&device(), 7).is_ok());
    }

    #[test]
    fn settings_have_a_range() {
        let good = HybridOitConfig::new(RayPath::Query, 64, 36);
        for bad in [
            HybridOitConfig { supersampling: 0, ..good },
            HybridOitConfig { supersampling: 5, ..good },
            HybridOitConfig { shadow_rays: 0, ..good },
            HybridOitConfig { shadow_rays: 65, ..good },
        ] {
            assert!(matches!(bad.check(&device(), 1), Err(SampleError::OutOfRange { .. })), "{bad:?}");
        }
        let pipeline = HybridOitConfig { path: RayPath::Pipeline, ..good };
        assert!(matches!(pipeline.check(&device(), 1), Err(SampleError::PathMissing { .. })));
    }
}
