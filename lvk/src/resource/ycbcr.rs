//! Textures in Y'CbCr: how their texels become colours. The conversions are fixed when the context is made, as their samplers
//! lie in the layout of the descriptor set.

use std::sync::Arc;

use ash::vk;

use super::sampler::Filter;
use crate::error::{Error, Result};
use crate::format::Format;
use crate::gpu::Gpu;

/// The matrix between Y'CbCr and colours.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum YuvModel {
    /// BT.601, of standard definition.
    Bt601,
    /// BT.709, of high definition.
    #[default]
    Bt709,
    /// BT.2020 without constant luminance, of ultra high definition.
    Bt2020,
}

/// Which numbers of a plane are black and white.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum YuvRange {
    /// 16 to 235 of 255, and 16 to 240 of colour differences; of 10 bits four times as much.
    #[default]
    Narrow,
    /// All.
    Full,
}

/// Where a colour difference lies among the two texels of an axis that share it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum ChromaSite {
    /// At the first.
    #[default]
    Cosited,
    /// Between them.
    Midpoint,
}

/// How texels in Y'CbCr become colours when they are sampled (`VkSamplerYcbcrConversion`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct YuvConversion {
    /// One of the formats that [are in Y'CbCr](Format::is_yuv).
    pub format: Format,
    /// The matrix.
    pub model: YuvModel,
    /// Which numbers are black and white.
    pub range: YuvRange,
    /// Where colour differences lie along x and y.
    pub chroma: [ChromaSite; 2],
    /// How texels and colour differences are interpolated. Addresses beyond the edge are clamped to it.
    pub filter: Filter,
}

impl YuvConversion {
    /// What a context has unless it is told otherwise: every format by BT.709 with the narrow range.
    pub const DEFAULT: [Self; 4] = [
        Self::new(Format::Nv12),
        Self::new(Format::Yuv420p8),
        Self::new(Format::P010),
        Self::new(Format::Yuv420p10),
    ];

    /// A format by BT.709 with the narrow range.
    pub const fn new(format: Format) -> Self {
        let chroma = [ChromaSite::Cosited; 2];
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
            .x_chroma_offset(raw_site(self.chroma[0]))
            .y_chroma_offset(raw_site(self.chroma[1]))
            .chroma_filter(self.filter.raw())
    }

    /// What a device with these features of the format lacks for the conversion.
    fn missing_feature(&self, features: vk::FormatFeatureFlags) -> Option<&'static str> {
        use vk::FormatFeatureFlags as Features;
        let linear =
            Features::SAMPLED_IMAGE_FILTER_LINEAR | Features::SAMPLED_IMAGE_YCBCR_CONVERSION_LINEAR_FILTER;
        if !self.format.is_yuv() {
            Some("the format is not in Y'CbCr")
        } else if !features.contains(Features::SAMPLED_IMAGE) {
            Some("the device cannot sample the format")
        } else if self.chroma.contains(&ChromaSite::Cosited)
            && !features.contains(Features::COSITED_CHROMA_SAMPLES)
        {
            Some("the device takes no cosited colour differences; say ChromaSite::Midpoint")
        } else if self.chroma.contains(&ChromaSite::Midpoint)
            && !features.contains(Features::MIDPOINT_CHROMA_SAMPLES)
        {
            Some("the device takes no colour differences at midpoints; say ChromaSite::Cosited")
        } else if self.filter == Filter::Linear && !features.contains(linear) {
            Some("the device does not interpolate the format; say Filter::Nearest")
        } else {
            None
        }
    }
}

/// A conversion that the device has, with its sampler; destroyed on drop.
pub(crate) struct YuvSampler {
    pub(crate) conversion: vk::SamplerYcbcrConversion,
    pub(crate) sampler: vk::Sampler,
    /// Descriptors that one texture takes of the pool.
    pub(crate) descriptors: u32,
    gpu: Arc<Gpu>,
}

impl YuvSampler {
    /// The sampler, or what the device lacks for it.
    pub(crate) fn new(gpu: &Arc<Gpu>, desc: &YuvConversion) -> Result<Result<Self, &'static str>> {
        if let Some(lack) = desc.missing_feature(gpu.format_features(desc.format)) {
            return Ok(Err(lack));
        }
        let device = &gpu.device;
        // SAFETY: the device has the format with this filter and these sites, and the feature is on.
        let conversion = unsafe { device.create_sampler_ycbcr_conversion(&desc.info(), None) }
            .map_err(Error::vulkan("vkCreateSamplerYcbcrConversion"))?;
        let descriptors = descriptor_count(gpu, desc.format);
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
        made.sampler =
            unsafe { device.create_sampler(&info, None) }.map_err(Error::vulkan("vkCreateSampler"))?;
        gpu.name(made.sampler, "yuv sampler");
        Ok(Ok(made))
    }
}

impl Drop for YuvSampler {
    fn drop(&mut self) {
        // SAFETY: the set whose layout names the sampler is gone, and so are the views of the conversion.
        unsafe {
            self.gpu.device.destroy_sampler(self.sampler, None);
            self.gpu.device.destroy_sampler_ycbcr_conversion(self.conversion, None);
        }
    }
}

/// Descriptors that a texture of the format takes (`combinedImageSamplerDescriptorCount`).
fn descriptor_count(gpu: &Gpu, format: Format) -> u32 {
    let info = vk::PhysicalDeviceImageFormatInfo2::default()
        .format(format.raw())
        .ty(vk::ImageType::TYPE_2D)
        .tiling(vk::ImageTiling::OPTIMAL)
        .usage(vk::ImageUsageFlags::SAMPLED)
        .flags(vk::ImageCreateFlags::MUTABLE_FORMAT);
    let mut yuv = vk::SamplerYcbcrConversionImageFormatProperties::default();
    let mut all = vk::ImageFormatProperties2::default().push_next(&mut yuv);
    // SAFETY: the physical device belongs to the instance; where it refuses, nothing was written.
    let asked = unsafe {
        gpu.instance.raw.get_physical_device_image_format_properties2(gpu.physical(), &info, &mut all)
    };
    if asked.is_ok() { yuv.combined_image_sampler_descriptor_count.max(1) } else { 3 }
}

fn raw_site(site: ChromaSite) -> vk::ChromaLocation {
    match site {
        ChromaSite::Cosited => vk::ChromaLocation::COSITED_EVEN,
        ChromaSite::Midpoint => vk::ChromaLocation::MIDPOINT,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_conversion_lacks_is_named() {
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
        let midpoint = YuvConversion { chroma: [ChromaSite::Cosited, ChromaSite::Midpoint], ..nearest };
        assert!(lack(midpoint, F::SAMPLED_IMAGE | F::COSITED_CHROMA_SAMPLES).contains("Cosited"));
        assert!(
            lack(YuvConversion { format: Format::R8Unorm, ..plain }, F::SAMPLED_IMAGE).contains("Y'CbCr")
        );
    }
}
