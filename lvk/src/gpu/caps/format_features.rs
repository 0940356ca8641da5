//! What the device can do with formats. Each is asked for once: a device never changes its answer.

use std::sync::OnceLock;

use ash::vk;

use super::optional_features::OptionalFeature;
use crate::format::Format;
use crate::gpu::device::Gpu;

/// The answers so far, by [`Format::ALL`].
pub(crate) struct FormatFeatureCache([OnceLock<vk::FormatFeatureFlags>; Format::ALL.len()]);

impl Default for FormatFeatureCache {
    fn default() -> Self {
        Self([const { OnceLock::new() }; Format::ALL.len()])
    }
}

impl Gpu {
    /// What the device can do with images of `format` in optimal tiling; nothing where a feature that the format needs is
    /// off.
    pub(crate) fn format_features(&self, format: Format) -> vk::FormatFeatureFlags {
        *self.format_answers.0[format as usize].get_or_init(|| match required_feature(format) {
            Some(feature) if !self.caps.has(feature) => vk::FormatFeatureFlags::empty(),
            _ => self.format_properties(format.raw()).optimal_tiling_features,
        })
    }

    /// What the device can do with buffers of `format`.
    pub(crate) fn buffer_features(&self, format: vk::Format) -> vk::FormatFeatureFlags {
        self.format_properties(format).buffer_features
    }

    fn format_properties(&self, format: vk::Format) -> vk::FormatProperties {
        // SAFETY: the physical device belongs to the instance, and the extension of the format is on.
        unsafe { self.instance.raw.get_physical_device_format_properties(self.physical(), format) }
    }
}

/// The feature by which there is the format, beyond what Vulkan has anyway.
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
