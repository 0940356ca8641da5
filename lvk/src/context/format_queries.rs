//! What textures the device can make.

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
/// The same with stencil.
const DEPTH_STENCIL: [Format; 2] = [Format::D32FloatS8, Format::D24UnormS8];

impl Context {
    /// What the device can do with 2D textures of a format (`vkGetPhysicalDeviceFormatProperties`).
    pub fn format_support(&self, format: Format) -> FormatSupport {
        FormatSupport::new(&self.device_state().gpu, format)
    }

    /// Whether [`create_texture`](Self::create_texture) would take the description, short of memory and of numbers for
    /// shaders (`vkGetPhysicalDeviceImageFormatProperties`).
    ///
    /// # Errors
    /// Those that it would answer.
    pub fn supports_texture(&self, desc: &TextureDesc<'_>) -> Result<()> {
        let plan = check_image(&self.device_state().gpu, desc)?;
        check_data_size(desc, plan.mips)
    }

    /// The sizes of fragments that the device has, from large to small; empty where it lacks
    /// [`OptionalFeature::PipelineShadingRate`](crate::OptionalFeature::PipelineShadingRate)
    /// (`vkGetPhysicalDeviceFragmentShadingRatesKHR`).
    pub fn shading_rates(&self) -> &[FragmentSize] {
        self.device_state().gpu.shading_rates.as_ref().map_or(&[], |rates| &rates.sizes)
    }

    /// The best format of depth, with stencil or without, that can be drawn to and sampled here; `None` where there is none.
    pub fn depth_format(&self, stencil: bool) -> Option<Format> {
        let formats: &[Format] = if stencil { &DEPTH_STENCIL } else { &DEPTH };
        formats.iter().copied().find(|format| {
            let support = self.format_support(*format);
            support.target && support.sampled
        })
    }
}
