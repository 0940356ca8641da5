//! Queries of texture formats and texture support.

use ash::vk;

use super::Context;
use super::create_texture::check_data_size;
use crate::error::Result;
use crate::format::Format;
use crate::gpu::caps::shading_rate::FragmentSize;
use crate::resource::check_image;
use crate::resource::format_support::FormatSupport;
use crate::resource::texture_desc::TextureDesc;

/// Depth formats, the best first.
const DEPTH: [Format; 3] = [Format::D32Float, Format::X8D24Unorm, Format::D16Unorm];
/// Depth-stencil formats, the best first.
const DEPTH_STENCIL: [Format; 2] = [Format::D32FloatS8, Format::D24UnormS8];

impl Context {
    /// Returns the uses of 2D textures of a format that the device supports (`vkGetPhysicalDeviceFormatProperties`).
    ///
    /// # Errors
    /// Those of `vkGetPhysicalDeviceImageFormatProperties`, such as [`Error::OutOfHostMemory`](crate::Error::OutOfHostMemory), which
    /// say nothing about the format.
    pub fn format_support(&self, format: Format) -> Result<FormatSupport> {
        FormatSupport::new(&self.device_state().gpu, format)
    }

    /// Checks that [`create_texture`](Self::create_texture) supports the description, apart from memory and free
    /// texture slots (`vkGetPhysicalDeviceImageFormatProperties`).
    ///
    /// # Errors
    /// Those of `create_texture`.
    pub fn supports_texture(&self, desc: &TextureDesc<'_>) -> Result<()> {
        let plan = check_image(&self.device_state().gpu, desc)?;
        check_data_size(desc, plan.mips)
    }

    /// Returns the fragment sizes that the device supports, from large to small. Empty without
    /// [`OptionalFeature::PipelineShadingRate`](crate::OptionalFeature::PipelineShadingRate)
    /// (`vkGetPhysicalDeviceFragmentShadingRatesKHR`).
    pub fn shading_rates(&self) -> &[FragmentSize] {
        self.device_state().gpu.shading_rates.as_ref().map_or(&[], |rates| &rates.sizes)
    }

    /// Returns the best depth format, with or without stencil, that can be rendered to and sampled on this device.
    /// `None` if there is none (`vkGetPhysicalDeviceFormatProperties`).
    pub fn depth_format(&self, stencil: bool) -> Option<Format> {
        let formats: &[Format] = if stencil { &DEPTH_STENCIL } else { &DEPTH };
        let needed = vk::FormatFeatureFlags::DEPTH_STENCIL_ATTACHMENT | vk::FormatFeatureFlags::SAMPLED_IMAGE;
        let gpu = &self.device_state().gpu;
        formats.iter().copied().find(|format| gpu.format_features(*format).contains(needed))
    }
}
