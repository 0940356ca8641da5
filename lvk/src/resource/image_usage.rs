//! Conversion of texture usages to Vulkan, and from the features of formats.

use ash::vk;

use super::texture_desc::TextureUsage;
use crate::format::Format;

/// Returns Vulkan's flags of a usage.
pub(crate) fn raw_usage(usage: TextureUsage, format: Format) -> vk::ImageUsageFlags {
    let target = if format.is_color() {
        vk::ImageUsageFlags::COLOR_ATTACHMENT
    } else {
        vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT
    };
    let pairs = [
        (TextureUsage::SAMPLED, vk::ImageUsageFlags::SAMPLED),
        (TextureUsage::STORAGE, vk::ImageUsageFlags::STORAGE),
        (TextureUsage::TARGET, target),
        (TextureUsage::INPUT, vk::ImageUsageFlags::INPUT_ATTACHMENT),
        (TextureUsage::SHADING_RATE, vk::ImageUsageFlags::FRAGMENT_SHADING_RATE_ATTACHMENT_KHR),
    ];
    let none = vk::ImageUsageFlags::empty();
    pairs.iter().filter(|(bit, _)| usage.contains(*bit)).fold(none, |all, (_, raw)| all | *raw)
}

/// Returns the usages that a format with these features supports.
pub(crate) fn usage_from_features(features: vk::FormatFeatureFlags) -> TextureUsage {
    use vk::FormatFeatureFlags as Features;
    let attachment = Features::COLOR_ATTACHMENT | Features::DEPTH_STENCIL_ATTACHMENT;
    let pairs = [
        (TextureUsage::SAMPLED, Features::SAMPLED_IMAGE),
        (TextureUsage::STORAGE, Features::STORAGE_IMAGE),
        (TextureUsage::TARGET, attachment),
        (TextureUsage::INPUT, attachment),
        (TextureUsage::SHADING_RATE, Features::FRAGMENT_SHADING_RATE_ATTACHMENT_KHR),
    ];
    pairs.iter().filter(|(_, any)| features.intersects(*any)).map(|(usage, _)| *usage).collect()
}
