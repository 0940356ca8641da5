//! Format features of the device. Each format is queried once, because the result never changes.

use std::sync::OnceLock;

use ash::vk;

use super::capabilities::Capabilities;
use super::optional_features::OptionalFeature;
use crate::format::Format;

/// Cached results, in the order of [`Format::ALL`].
pub(crate) struct FormatFeatureCache([OnceLock<vk::FormatFeatureFlags>; Format::ALL.len()]);

impl Default for FormatFeatureCache {
    fn default() -> Self {
        Self([const { OnceLock::new() }; Format::ALL.len()])
    }
}

impl FormatFeatureCache {
    /// Returns the features of images of `format` in optimal tiling. Empty if a feature that the format needs
    /// is disabled.
    pub(crate) fn image_features(
        &self,
        instance: &ash::Instance,
        device: vk::PhysicalDevice,
        caps: &Capabilities,
        format: Format,
    ) -> vk::FormatFeatureFlags {
        *self.0[format as usize].get_or_init(|| match required_feature(format) {
            Some(feature) if !caps.has(feature) => vk::FormatFeatureFlags::empty(),
            _ => format_properties(instance, device, format.raw()).optimal_tiling_features,
        })
    }
}

/// Returns the properties of a format (`vkGetPhysicalDeviceFormatProperties`).
pub(crate) fn format_properties(
    instance: &ash::Instance,
    device: vk::PhysicalDevice,
    format: vk::Format,
) -> vk::FormatProperties {
    // SAFETY: the physical device belongs to the instance, and the extension of the format is enabled.
    unsafe { instance.get_physical_device_format_properties(device, format) }
}

/// Returns the optional feature that the format needs. `None` for formats of core Vulkan.
fn required_feature(format: Format) -> Option<OptionalFeature> {
    let name = format.raw().as_raw();
    let between = |first: vk::Format, last: vk::Format| (first.as_raw()..=last.as_raw()).contains(&name);
    if between(vk::Format::BC1_RGB_UNORM_BLOCK, vk::Format::BC7_SRGB_BLOCK) {
        Some(OptionalFeature::TextureCompressionBc)
    } else if between(vk::Format::ETC2_R8G8B8_UNORM_BLOCK, vk::Format::EAC_R11G11_SNORM_BLOCK) {
        Some(OptionalFeature::TextureCompressionEtc2)
    } else if between(vk::Format::ASTC_4X4_UNORM_BLOCK, vk::Format::ASTC_12X12_SRGB_BLOCK) {
        Some(OptionalFeature::TextureCompressionAstcLdr)
    } else if matches!(format, Format::A8Unorm | Format::A1Bgr5Unorm) {
        Some(OptionalFeature::Maintenance5)
    } else if format.is_yuv() {
        Some(OptionalFeature::YcbcrConversion)
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_format_has_an_answer_of_its_own() {
        for (place, format) in Format::ALL.iter().enumerate() {
            assert_eq!(*format as usize, place, "{format:?}");
        }
    }

    #[test]
    fn compressed_formats_need_features_of_their_own() {
        for format in Format::ALL {
            let other = [Some(OptionalFeature::Maintenance5), Some(OptionalFeature::YcbcrConversion), None];
            assert_eq!(!other.contains(&required_feature(*format)), format.is_compressed(), "{format:?}");
        }
    }
}
