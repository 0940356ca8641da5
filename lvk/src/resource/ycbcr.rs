//! Conversion of Y'CbCr textures to colours. The conversions are fixed at the creation of the context, because their
//! samplers are part of the layout of the descriptor set.

use std::sync::Arc;

use ash::vk;

use super::sampler::Filter;
use crate::error::{Error, Result};
use crate::format::Format;
use crate::gpu::Gpu;
use crate::gpu::answers::image_support;

/// The matrix between Y'CbCr and colours (`VkSamplerYcbcrModelConversion`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum YuvModel {
    /// BT.601, for standard definition.
    Bt601,
    /// BT.709, for high definition.
    #[default]
    Bt709,
    /// BT.2020 without constant luminance, for ultra high definition.
    Bt2020,
}

/// Range of the numbers of a plane between black and white (`VkSamplerYcbcrRange`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum YuvRange {
    /// 16 to 235 of 255, and 16 to 240 for colour differences; with 10 bits four times these numbers.
    #[default]
    Narrow,
    /// All numbers.
    Full,
}

/// Position of a colour difference between the two texels of an axis that share it (`VkChromaLocation`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum ChromaLocation {
    /// At the first texel.
    #[default]
    Cosited,
    /// Between both texels.
    Midpoint,
}

/// Conversion of Y'CbCr texels to colours during sampling (`VkSamplerYcbcrConversion`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct YuvConversion {
    /// One of the [Y'CbCr formats](Format::is_yuv).
    pub format: Format,
    /// The matrix.
    pub model: YuvModel,
    /// Range of the numbers between black and white.
    pub range: YuvRange,
    /// Position of colour differences along x and y.
    pub chroma: [ChromaLocation; 2],
    /// Interpolation of texels and colour differences. Addresses beyond the edge are clamped to the edge.
    pub filter: Filter,
}

impl YuvConversion {
    /// Default conversions of a context: every format by BT.709 with the narrow range.
    pub const DEFAULT: [Self; 4] = [
        Self::new(Format::Nv12),
        Self::new(Format::Yuv420p8),
        Self::new(Format::P010),
        Self::new(Format::Yuv420p10),
    ];

    /// Returns the conversion of a format by BT.709 with the narrow range.
    pub const fn new(format: Format) -> Self {
        let chroma = [ChromaLocation::Cosited; 2];
        Self { format, model: YuvModel::Bt709, range: YuvRange::Narrow, chroma, filter: Filter::Linear }
    }

    fn info(&self) -> vk::SamplerYcbcrConversionCreateInfo<'static> {
        vk::SamplerYcbcrConversionCreateInfo::default()
            .format(self.format.raw())
            .ycbcr_model(match self.model {
                YuvModel::Bt601 => vk::SamplerYcbcrModelConversion::YCBCR_601,
                YuvModel::Bt709 => vk::SamplerYcbcrModelConversion::YCBCR_709,
                YuvModel::Bt2020 => vk::SamplerYcbcrModelConversion::YCBCR_2020,
            })
            .ycbcr_range(match self.range {
                YuvRange::Narrow => vk::SamplerYcbcrRange::ITU_NARROW,
                YuvRange::Full => vk::SamplerYcbcrRange::ITU_FULL,
            })
            .x_chroma_offset(raw_chroma_location(self.chroma[0]))
            .y_chroma_offset(raw_chroma_location(self.chroma[1]))
            .chroma_filter(self.filter.raw())
    }

    /// Returns a message if the conversion needs more than these features of the format.
    fn missing_feature(&self, features: vk::FormatFeatureFlags) -> Option<&'static str> {
        use vk::FormatFeatureFlags as Features;
        let linear =
            Features::SAMPLED_IMAGE_FILTER_LINEAR | Features::SAMPLED_IMAGE_YCBCR_CONVERSION_LINEAR_FILTER;
        if !self.format.is_yuv() {
            Some("the format is not in Y'CbCr")
        } else if !features.contains(Features::SAMPLED_IMAGE) {
            Some("the device cannot sample the format")
        } else if self.chroma.contains(&ChromaLocation::Cosited)
            && !features.contains(Features::COSITED_CHROMA_SAMPLES)
        {
            Some("the device does not support cosited colour differences; use ChromaLocation::Midpoint")
        } else if self.chroma.contains(&ChromaLocation::Midpoint)
            && !features.contains(Features::MIDPOINT_CHROMA_SAMPLES)
        {
            Some("the device does not support colour differences at midpoints; use ChromaLocation::Cosited")
        } else if self.filter == Filter::Linear && !features.contains(linear) {
            Some("the device does not interpolate the format; use Filter::Nearest")
        } else {
            None
        }
    }
}

/// A supported conversion with its sampler, destroyed on drop.
pub(crate) struct YuvSampler {
    pub(crate) conversion: vk::SamplerYcbcrConversion,
    pub(crate) sampler: vk::Sampler,
    /// Descriptors of the pool that one texture needs.
    pub(crate) descriptors: u32,
    gpu: Arc<Gpu>,
}

impl YuvSampler {
    /// Creates the sampler. The inner error names the feature that the device lacks.
    pub(crate) fn new(gpu: &Arc<Gpu>, desc: &YuvConversion) -> Result<Result<Self, &'static str>> {
        if let Some(lack) = desc.missing_feature(gpu.format_features(desc.format)) {
            return Ok(Err(lack));
        }
        let device = &gpu.device;
        let descriptors = descriptor_count(gpu, desc.format)?;
        // SAFETY: the device has the format with this filter and these chroma locations, and the feature is on.
        let conversion = unsafe { device.create_sampler_ycbcr_conversion(&desc.info(), None) }
            .map_err(Error::vulkan("vkCreateSamplerYcbcrConversion", "yuv sampler"))?;
        let mut made = Self { conversion, sampler: vk::Sampler::null(), descriptors, gpu: Arc::clone(gpu) };
        let mut chain = vk::SamplerYcbcrConversionInfo::default().conversion(conversion);
        let edge = vk::SamplerAddressMode::CLAMP_TO_EDGE;
        let info = vk::SamplerCreateInfo::default()
            .mag_filter(desc.filter.raw())
            .min_filter(desc.filter.raw())
            .address_mode_u(edge)
            .address_mode_v(edge)
            .address_mode_w(edge)
            .max_lod(vk::LOD_CLAMP_NONE)
            .push_next(&mut chain);
        // SAFETY: the description suits the conversion.
        made.sampler = unsafe { device.create_sampler(&info, None) }
            .map_err(Error::vulkan("vkCreateSampler", "yuv sampler"))?;
        gpu.name(made.sampler, "yuv sampler");
        Ok(Ok(made))
    }
}

impl Drop for YuvSampler {
    fn drop(&mut self) {
        // SAFETY: the set whose layout contains the sampler is destroyed, and so are the views with the conversion.
        unsafe {
            self.gpu.device.destroy_sampler(self.sampler, None);
            self.gpu.device.destroy_sampler_ycbcr_conversion(self.conversion, None);
        }
    }
}

/// Returns the number of descriptors that a texture of the format needs (`combinedImageSamplerDescriptorCount`). The most that any
/// format has, 3, if the driver supports no such texture.
fn descriptor_count(gpu: &Gpu, format: Format) -> Result<u32> {
    let info = vk::PhysicalDeviceImageFormatInfo2::default()
        .format(format.raw())
        .ty(vk::ImageType::TYPE_2D)
        .tiling(vk::ImageTiling::OPTIMAL)
        .usage(vk::ImageUsageFlags::SAMPLED)
        .flags(vk::ImageCreateFlags::MUTABLE_FORMAT);
    let mut yuv = vk::SamplerYcbcrConversionImageFormatProperties::default();
    let mut all = vk::ImageFormatProperties2::default().push_next(&mut yuv);
    // SAFETY: the physical device belongs to the instance; on failure nothing was written.
    let asked = unsafe {
        gpu.instance.raw.get_physical_device_image_format_properties2(gpu.physical(), &info, &mut all)
    };
    let supported = image_support(asked, "vkGetPhysicalDeviceImageFormatProperties2", "yuv sampler")?;
    Ok(supported.map_or(3, |()| yuv.combined_image_sampler_descriptor_count.max(1)))
}

fn raw_chroma_location(location: ChromaLocation) -> vk::ChromaLocation {
    match location {
        ChromaLocation::Cosited => vk::ChromaLocation::COSITED_EVEN,
        ChromaLocation::Midpoint => vk::ChromaLocation::MIDPOINT,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_error_names_missing_features_of_a_conversion() {
        use vk::FormatFeatureFlags as F;
        let linear = F::SAMPLED_IMAGE_FILTER_LINEAR | F::SAMPLED_IMAGE_YCBCR_CONVERSION_LINEAR_FILTER;
        let plain = YuvConversion::new(Format::Nv12);
        let lack = |desc: YuvConversion, features| desc.missing_feature(features).unwrap_or("nothing");
        assert_eq!(lack(plain, F::SAMPLED_IMAGE | F::COSITED_CHROMA_SAMPLES | linear), "nothing");
        assert!(lack(plain, F::empty()).contains("sample"));
        assert!(lack(plain, F::SAMPLED_IMAGE | F::MIDPOINT_CHROMA_SAMPLES | linear).contains("Midpoint"));
        assert!(lack(plain, F::SAMPLED_IMAGE | F::COSITED_CHROMA_SAMPLES).contains("Nearest"));
        let nearest = YuvConversion { filter: Filter::Nearest, ..plain };
        assert_eq!(lack(nearest, F::SAMPLED_IMAGE | F::COSITED_CHROMA_SAMPLES), "nothing");
        let midpoint =
            YuvConversion { chroma: [ChromaLocation::Cosited, ChromaLocation::Midpoint], ..nearest };
        assert!(lack(midpoint, F::SAMPLED_IMAGE | F::COSITED_CHROMA_SAMPLES).contains("Cosited"));
        assert!(
            lack(YuvConversion { format: Format::R8Unorm, ..plain }, F::SAMPLED_IMAGE).contains("Y'CbCr")
        );
    }
}
