//! Descriptions and properties of swapchains.

use std::sync::Arc;

use ash::vk;

use crate::format::Format;
use crate::gpu::start::window::WindowHandles;
use crate::handle::{SwapchainHandle, TextureHandle};
use crate::resource::texture_desc::TextureUsage;

/// Present mode: the moment when an image replaces the previous one on the screen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum PresentMode {
    /// At the screen refresh, every image in order. The application waits if it is faster. Always supported.
    #[default]
    Fifo,
    /// As `Fifo`, but a late image is presented at once, with tearing.
    FifoRelaxed,
    /// At the screen refresh, only the newest image.
    Mailbox,
    /// At once, with tearing.
    Immediate,
}

impl PresentMode {
    const ALL: [Self; 4] = [Self::Fifo, Self::FifoRelaxed, Self::Mailbox, Self::Immediate];

    pub(crate) fn raw(self) -> vk::PresentModeKHR {
        match self {
            Self::Fifo => vk::PresentModeKHR::FIFO,
            Self::FifoRelaxed => vk::PresentModeKHR::FIFO_RELAXED,
            Self::Mailbox => vk::PresentModeKHR::MAILBOX,
            Self::Immediate => vk::PresentModeKHR::IMMEDIATE,
        }
    }

    /// Returns `None` for modes that the library does not support, such as shared ones.
    pub(crate) fn from_raw(raw: vk::PresentModeKHR) -> Option<Self> {
        Self::ALL.into_iter().find(|mode| mode.raw() == raw)
    }
}

/// Meaning of the values in swapchain images.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ColorSpace {
    /// sRGB, in a format that encodes linear shader output (`..Srgb`).
    Srgb,
    /// sRGB, encoded by the shaders (`..Unorm`). Required for storage images.
    SrgbEncoded,
    /// Display P3 with the sRGB curve, in a format that encodes linear shader output.
    DisplayP3,
    /// Linear light in half floats with the sRGB primaries (scRGB). 1 is the white of standard dynamic range, and
    /// larger values are brighter.
    ExtendedSrgbLinear,
    /// BT.2020 with the PQ curve of SMPTE ST 2084 (HDR10), encoded by the shaders.
    Hdr10,
}

impl ColorSpace {
    pub(crate) fn raw(self) -> vk::ColorSpaceKHR {
        match self {
            Self::Srgb | Self::SrgbEncoded => vk::ColorSpaceKHR::SRGB_NONLINEAR,
            Self::DisplayP3 => vk::ColorSpaceKHR::DISPLAY_P3_NONLINEAR_EXT,
            Self::ExtendedSrgbLinear => vk::ColorSpaceKHR::EXTENDED_SRGB_LINEAR_EXT,
            Self::Hdr10 => vk::ColorSpaceKHR::HDR10_ST2084_EXT,
        }
    }

    /// Returns the formats for this colour space, the best first.
    pub(crate) fn formats(self) -> &'static [Format] {
        match self {
            Self::Srgb | Self::DisplayP3 => &[Format::Bgra8Srgb, Format::Rgba8Srgb],
            Self::SrgbEncoded => &[Format::Bgra8Unorm, Format::Rgba8Unorm, Format::Rgb10A2Unorm],
            Self::ExtendedSrgbLinear => &[Format::Rgba16Float],
            Self::Hdr10 => &[Format::Rgb10A2Unorm, Format::Rgba16Float],
        }
    }
}

/// HDR metadata of images in [`ColorSpace::Hdr10`] or brighter than white, for the display (`VkHdrMetadataEXT`). All
/// numbers are finite, and none is negative.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HdrMetadata {
    /// CIE 1931 chromaticities of red, green and blue of the mastering display. Default: those of BT.2020.
    pub primaries: [[f32; 2]; 3],
    /// CIE 1931 chromaticity of the white point of the mastering display. Default: `[0.3127, 0.3290]`, D65.
    pub white_point: [f32; 2],
    /// Minimum and maximum luminance of the mastering display, in cd/m². Default: `[0.001, 1000.0]`.
    pub luminance: [f32; 2],
    /// Maximum luminance of any pixel of all images, in cd/m². Default: 1000.
    pub max_content_light_level: f32,
    /// Maximum of the average luminance of an image, in cd/m². Default: 400.
    pub max_frame_average_light_level: f32,
}

impl Default for HdrMetadata {
    /// BT.2020 with the white D65, from 0.001 to 1000 cd/m².
    fn default() -> Self {
        Self {
            primaries: [[0.708, 0.292], [0.170, 0.797], [0.131, 0.046]],
            white_point: [0.3127, 0.3290],
            luminance: [0.001, 1000.0],
            max_content_light_level: 1000.0,
            max_frame_average_light_level: 400.0,
        }
    }
}

impl HdrMetadata {
    /// Fails unless all numbers are finite and none is negative.
    pub(crate) fn check(&self) -> Result<(), String> {
        let Self { primaries, white_point, luminance, .. } = self;
        let levels = [self.max_content_light_level, self.max_frame_average_light_level];
        let mut numbers = primaries.iter().chain([white_point, luminance, &levels]).flatten();
        match numbers.find(|number| !(number.is_finite() && **number >= 0.0)) {
            None => Ok(()),
            Some(number) => Err(format!("HDR metadata are finite numbers from 0, not {number}")),
        }
    }

    pub(crate) fn raw(&self) -> vk::HdrMetadataEXT<'static> {
        let point = |[x, y]: [f32; 2]| vk::XYColorEXT { x, y };
        vk::HdrMetadataEXT::default()
            .display_primary_red(point(self.primaries[0]))
            .display_primary_green(point(self.primaries[1]))
            .display_primary_blue(point(self.primaries[2]))
            .white_point(point(self.white_point))
            .min_luminance(self.luminance[0])
            .max_luminance(self.luminance[1])
            .max_content_light_level(self.max_content_light_level)
            .max_frame_average_light_level(self.max_frame_average_light_level)
    }
}

/// Describes a swapchain.
#[derive(Debug, Clone)]
pub struct SwapchainDesc<'a> {
    /// The window; `None` for the window of the context ([`ContextDesc::window`](crate::ContextDesc)). The swapchain
    /// keeps the window alive. A window has one swapchain. Default: none.
    pub window: Option<Arc<dyn WindowHandles>>,
    /// Width and height of the window in pixels. The size reported by the window system takes precedence; Wayland
    /// leaves the size to the application. A 0 means that the window is minimised. Default: `[640, 480]`.
    pub extent: [u32; 2],
    /// Requested present modes. The first supported one is used, or [`PresentMode::Fifo`] if none is. Default: empty.
    pub present_modes: &'a [PresentMode],
    /// Requested colour spaces. The first supported one is used. If none is, [`ColorSpace::Srgb`] and then
    /// [`ColorSpace::SrgbEncoded`] are tried. Default: empty.
    pub color_spaces: &'a [ColorSpace],
    /// HDR metadata for the display, if the device can set them. Default: none.
    pub hdr: Option<HdrMetadata>,
    /// Uses of the images, besides copies. Default: [`TextureUsage::TARGET`].
    pub usage: TextureUsage,
    /// Number of images, clamped to the supported range. With 0 the library chooses: one more than the window system
    /// needs itself, and at least three for [`PresentMode::Mailbox`]. Default: 0.
    pub image_count: u32,
    /// Name in error messages, validation messages and debuggers. Default: `"swapchain"`.
    pub debug_name: &'a str,
}

impl Default for SwapchainDesc<'_> {
    fn default() -> Self {
        Self {
            window: None,
            extent: [640, 480],
            present_modes: &[],
            color_spaces: &[],
            hdr: None,
            usage: TextureUsage::TARGET,
            image_count: 0,
            debug_name: "swapchain",
        }
    }
}

/// Current properties of a swapchain; see [`Context::swapchain_info`](crate::Context::swapchain_info).
#[derive(Debug, Clone, PartialEq)]
pub struct SwapchainInfo {
    /// Width and height of its images. `[0, 0]` if there are no images, because the window was minimised since its
    /// creation.
    pub extent: [u32; 2],
    /// Format of its images.
    pub format: Format,
    /// Colour space of its images.
    pub color_space: ColorSpace,
    /// Present mode of its images.
    pub present_mode: PresentMode,
    /// Supported present modes.
    pub present_modes: Vec<PresentMode>,
    /// Number of images.
    pub image_count: u32,
    /// Number of recreations since its creation.
    pub rebuilds: u64,
}

/// An image of a swapchain to draw into, between [`Context::next_image`](crate::Context::next_image) and
/// [`Context::present`](crate::Context::present). If it is dropped or forgotten, `next_image` returns the same image
/// again.
#[derive(Debug)]
pub struct SwapchainImage {
    pub(crate) swapchain: SwapchainHandle,
    pub(crate) texture: TextureHandle,
    pub(crate) index: u32,
    pub(crate) extent: [u32; 2],
    pub(crate) format: Format,
    pub(crate) ticket: u64,
}

impl SwapchainImage {
    /// Returns the texture of the image. Its contents are undefined until it is drawn to. It belongs to the swapchain.
    pub fn texture(&self) -> TextureHandle {
        self.texture
    }

    /// Returns the bindless index of the texture, as [`Holder::index`](crate::Holder::index) does.
    pub fn index(&self) -> u32 {
        self.index
    }

    /// Returns width and height in pixels.
    pub fn extent(&self) -> [u32; 2] {
        self.extent
    }

    /// Returns the format of the image. Pipelines that render to it need the format.
    pub fn format(&self) -> Format {
        self.format
    }
}
