//! Uses of a format that a device supports.

use ash::vk;

use super::image_usage::raw_usage;
use super::texture_desc::TextureUsage;
use crate::error::Result;
use crate::format::Format;
use crate::gpu::Gpu;

/// Supported uses of 2D textures of one format; the default is none.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct FormatSupport {
    /// Shaders can sample and fetch it.
    pub sampled: bool,
    /// Shaders can sample it with [`Filter::Linear`](crate::Filter).
    pub linear: bool,
    /// Samplers can return the least or greatest texel instead of the mean.
    pub min_max: bool,
    /// Shaders can store to it and load from it.
    pub storage: bool,
    /// Shaders can apply atomic operations to it.
    pub storage_atomic: bool,
    /// Passes can use it as a colour or depth target.
    pub target: bool,
    /// Passes can blend into it as a colour target.
    pub blend: bool,
    /// Blits can read from it.
    pub blit_source: bool,
    /// Blits can write to it.
    pub blit_target: bool,
    /// Sum of the sample counts per pixel that targets may have: 5 is 1 and 4. 0 if the format cannot be a target.
    pub samples: u32,
}

impl FormatSupport {
    pub(crate) fn new(gpu: &Gpu, format: Format) -> Result<Self> {
        use vk::FormatFeatureFlags as Features;
        let features = gpu.format_features(format);
        let target = Features::COLOR_ATTACHMENT | Features::DEPTH_STENCIL_ATTACHMENT;
        Ok(Self {
            sampled: features.contains(Features::SAMPLED_IMAGE),
            linear: features.contains(Features::SAMPLED_IMAGE_FILTER_LINEAR),
            min_max: features.contains(Features::SAMPLED_IMAGE_FILTER_MINMAX),
            storage: features.contains(Features::STORAGE_IMAGE),
            storage_atomic: features.contains(Features::STORAGE_IMAGE_ATOMIC),
            target: features.intersects(target),
            blend: features.contains(Features::COLOR_ATTACHMENT_BLEND),
            blit_source: features.contains(Features::BLIT_SRC),
            blit_target: features.contains(Features::BLIT_DST),
            samples: if features.intersects(target) { samples(gpu, format)? } else { 0 },
        })
    }
}

fn samples(gpu: &Gpu, format: Format) -> Result<u32> {
    let usage = raw_usage(TextureUsage::TARGET, format);
    Ok(gpu.target_samples(format.raw(), usage, &format!("{format:?}"))?.as_raw())
}
