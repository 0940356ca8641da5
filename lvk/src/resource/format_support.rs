//! What a device can do with a format.

use ash::vk;

use super::image_usage::raw_usage;
use super::texture_desc::TextureUsage;
use crate::format::Format;
use crate::gpu::Gpu;

/// What 2D textures of one format can be used for; the default is nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct FormatSupport {
    /// Sampled and fetched by shaders.
    pub sampled: bool,
    /// Sampled with [`Filter::Linear`](crate::Filter).
    pub linear: bool,
    /// Sampled with the least or greatest texel in place of the mean.
    pub min_max: bool,
    /// Stored to and loaded by shaders.
    pub storage: bool,
    /// Changed by atomic operations of shaders.
    pub storage_atomic: bool,
    /// A colour or depth target of passes.
    pub target: bool,
    /// Blended with as a colour target.
    pub blend: bool,
    /// Scaled from by blits.
    pub blit_source: bool,
    /// Scaled to by blits.
    pub blit_target: bool,
    /// Numbers of samples a pixel that targets may have, added up: 5 is 1 and 4; 0 where there are no targets of it.
    pub samples: u32,
}

impl FormatSupport {
    pub(crate) fn new(gpu: &Gpu, format: Format) -> Self {
        use vk::FormatFeatureFlags as Features;
        let features = gpu.format_features(format);
        let target = Features::COLOR_ATTACHMENT | Features::DEPTH_STENCIL_ATTACHMENT;
        Self {
            sampled: features.contains(Features::SAMPLED_IMAGE),
            linear: features.contains(Features::SAMPLED_IMAGE_FILTER_LINEAR),
            min_max: features.contains(Features::SAMPLED_IMAGE_FILTER_MINMAX),
            storage: features.contains(Features::STORAGE_IMAGE),
            storage_atomic: features.contains(Features::STORAGE_IMAGE_ATOMIC),
            target: features.intersects(target),
            blend: features.contains(Features::COLOR_ATTACHMENT_BLEND),
            blit_source: features.contains(Features::BLIT_SRC),
            blit_target: features.contains(Features::BLIT_DST),
            samples: if features.intersects(target) { samples(gpu, format) } else { 0 },
        }
    }
}

fn samples(gpu: &Gpu, format: Format) -> u32 {
    let info = vk::ImageCreateInfo::default()
        .image_type(vk::ImageType::TYPE_2D)
        .format(format.raw())
        .tiling(vk::ImageTiling::OPTIMAL)
        .usage(raw_usage(TextureUsage::TARGET, format));
    gpu.image_limits(&info).map_or(0, |limits| limits.sample_counts.as_raw())
}
