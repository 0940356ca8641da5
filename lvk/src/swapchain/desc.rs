//! What callers say of a swapchain, and what they are told.

use std::sync::Arc;

use ash::vk;

use crate::format::Format;
use crate::gpu::start::window::WindowHandles;
use crate::handle::{SwapchainHandle, TextureHandle};
use crate::resource::texture_desc::TextureUsage;

/// When a picture replaces the one before it on the screen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum PresentMode {
    /// With the refresh of the screen, every picture in turn; the application waits where it is faster. Always there.
    #[default]
    Fifo,
    /// As `Fifo`, but a picture that is late comes at once, torn.
    FifoRelaxed,
    /// With the refresh of the screen, the newest picture only.
    Mailbox,
    /// At once, torn.
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

    /// `None` for modes the library does not have, such as shared ones.
    pub(crate) fn from_raw(raw: vk::PresentModeKHR) -> Option<Self> {
        Self::ALL.into_iter().find(|mode| mode.raw() == raw)
    }
}

/// What the numbers in the images of a swapchain mean.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ColorSpace {
    /// sRGB, in a format that encodes what shaders write in linear light (`..Srgb`).
    Srgb,
    /// sRGB, encoded by the shaders (`..Unorm`); storage images are of this kind.
    SrgbEncoded,
    /// Display P3 with the curve of sRGB, in a format that encodes.
    DisplayP3,
    /// Linear light in half floats with the primaries of sRGB, where 1 is the white of standard pictures and more is
    /// brighter (scRGB).
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

    /// Formats that go with it, the best first.
    pub(crate) fn formats(self) -> &'static [Format] {
        match self {
            Self::Srgb | Self::DisplayP3 => &[Format::Bgra8Srgb, Format::Rgba8Srgb],
            Self::SrgbEncoded => &[Format::Bgra8Unorm, Format::Rgba8Unorm, Format::Rgb10A2Unorm],
            Self::ExtendedSrgbLinear => &[Format::Rgba16Float],
            Self::Hdr10 => &[Format::Rgb10A2Unorm, Format::Rgba16Float],
        }
    }
}

/// What a display is told of pictures in [`ColorSpace::Hdr10`] or brighter than white (`VkHdrMetadataEXT`).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HdrMetadata {
    /// CIE 1931 chromaticities of red, green and blue of the display that the pictures were made for.
    pub primaries: [[f32; 2]; 3],
    /// CIE 1931 chromaticity of its white.
    pub white_point: [f32; 2],
    /// Its darkest and brightest light, in cd/m².
    pub luminance: [f32; 2],
    /// The brightest pixel of all pictures, in cd/m².
    pub max_content_light_level: f32,
    /// The brightest mean of a picture, in cd/m².
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
    /// The window; `None` is the one of the context ([`ContextDesc::window`](crate::ContextDesc)). It is kept until the
    /// swapchain is gone. A window has one swapchain.
    pub window: Option<Arc<dyn WindowHandles>>,
    /// Width and height of the window in pixels. Window systems that know better are believed; Wayland leaves it to the
    /// application. A 0 says that the window is minimised.
    pub extent: [u32; 2],
    /// The first of these that there is; [`PresentMode::Fifo`] where there is none of them.
    pub present_modes: &'a [PresentMode],
    /// The first of these that there is; [`ColorSpace::Srgb`], then [`ColorSpace::SrgbEncoded`], where there is none of
    /// them.
    pub color_spaces: &'a [ColorSpace],
    /// What the display is told, where the device can tell it.
    pub hdr: Option<HdrMetadata>,
    /// What the images are used for, besides copies.
    pub usage: TextureUsage,
    /// Number of images, clamped to what there can be; 0 leaves it to the library: one more than the window system needs
    /// itself, and at least three for [`PresentMode::Mailbox`].
    pub image_count: u32,
    /// Name in error messages, validation messages and debuggers.
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

/// What a swapchain is at the moment; see [`Context::swapchain_info`](crate::Context::swapchain_info).
#[derive(Debug, Clone, PartialEq)]
pub struct SwapchainInfo {
    /// Width and height of its images; `[0, 0]` where it has none, as the window was minimised since it was made.
    pub extent: [u32; 2],
    /// Format of its images.
    pub format: Format,
    /// What the numbers in them mean.
    pub color_space: ColorSpace,
    /// How they come to the screen.
    pub present_mode: PresentMode,
    /// The modes there are.
    pub present_modes: Vec<PresentMode>,
    /// Number of images.
    pub image_count: u32,
    /// How often it was made anew since its creation.
    pub rebuilds: u64,
}

/// An image of a swapchain to draw into, between [`Context::next_image`](crate::Context::next_image) and
/// [`Context::present`](crate::Context::present). Dropped or forgotten, it is what `next_image` answers again.
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
    /// The image as a texture, whose contents are undefined until something is drawn. It belongs to the swapchain.
    pub fn texture(&self) -> TextureHandle {
        self.texture
    }

    /// Its bindless number, as of [`Holder::index`](crate::Holder::index).
    pub fn index(&self) -> u32 {
        self.index
    }

    /// Width and height in pixels.
    pub fn extent(&self) -> [u32; 2] {
        self.extent
    }

    /// Format of its texels: pipelines that draw to it need it.
    pub fn format(&self) -> Format {
        self.format
    }
}
