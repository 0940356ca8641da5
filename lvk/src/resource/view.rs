//! Views: how shaders and passes see a part of an image.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use ash::vk;

use super::image::{Image, raw_range};
use super::texture_desc::{TextureKind, TextureUsage};
use crate::barrier::Subresources;
use crate::error::{Error, Result};
use crate::format::Format;
use crate::gpu::Gpu;
use crate::handle::TextureHandle;

/// Where a channel of what a shader samples comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Channel {
    /// Always 0.
    Zero,
    /// Always 1.
    One,
    /// The first channel of the format.
    Red,
    /// The second channel of the format.
    Green,
    /// The third channel of the format.
    Blue,
    /// The fourth channel of the format.
    Alpha,
}

/// Which channels of a texel the four that a shader samples are (`VkComponentMapping`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Swizzle {
    /// What shaders see as red.
    pub red: Channel,
    /// What shaders see as green.
    pub green: Channel,
    /// What shaders see as blue.
    pub blue: Channel,
    /// What shaders see as alpha.
    pub alpha: Channel,
}

impl Swizzle {
    /// Every channel is itself.
    pub const IDENTITY: Self =
        Self { red: Channel::Red, green: Channel::Green, blue: Channel::Blue, alpha: Channel::Alpha };

    /// What a view with this swizzle of a view with the `first` one shows.
    pub(crate) fn after(self, first: Self) -> Self {
        let through = |channel| match channel {
            Channel::Zero | Channel::One => channel,
            Channel::Red => first.red,
            Channel::Green => first.green,
            Channel::Blue => first.blue,
            Channel::Alpha => first.alpha,
        };
        Self {
            red: through(self.red),
            green: through(self.green),
            blue: through(self.blue),
            alpha: through(self.alpha),
        }
    }

    fn raw(self) -> vk::ComponentMapping {
        vk::ComponentMapping {
            r: raw_channel(self.red),
            g: raw_channel(self.green),
            b: raw_channel(self.blue),
            a: raw_channel(self.alpha),
        }
    }
}

impl Default for Swizzle {
    fn default() -> Self {
        Self::IDENTITY
    }
}

/// Describes a view: a texture that shows mips and layers of another one, perhaps as another kind or format.
#[derive(Debug, Clone, Copy, Default)]
pub struct TextureViewDesc<'a> {
    /// The texture to show, which may be a view itself: mips and layers then count from its first ones.
    pub texture: Option<TextureHandle>,
    /// Shape, which also says how many layers there are from [`base_layer`](Self::base_layer) on: 1, those of the array,
    /// or the 6 of each cube. `None` is the shape of the texture, for arrays with all layers or whole cubes from
    /// `base_layer` on, for volumes with the depth of `base_mip`.
    ///
    /// Cubes can be made of square arrays of at least six layers. Volumes are seen as volumes only, of all their slices.
    pub kind: Option<TextureKind>,
    /// First mip.
    pub base_mip: u32,
    /// Number of mips; 0 is all from [`base_mip`](Self::base_mip) on.
    pub mips: u32,
    /// First layer.
    pub base_layer: u32,
    /// Format shaders and passes take the texels for: the texture's own, or one of its
    /// [`view_formats`](crate::TextureDesc::view_formats). `None` is the texture's.
    pub format: Option<Format>,
    /// Channels as shaders sample them. Storage images and targets show the channels as they are.
    pub swizzle: Swizzle,
    /// What the view is used for, of what its texture was made for. `None` is all of it that the format and the swizzle
    /// allow.
    pub usage: Option<TextureUsage>,
    /// Name in error messages, validation messages and debuggers.
    pub debug_name: &'a str,
}

/// Everything a Vulkan view is made of, beside its image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct ViewInfo {
    pub(crate) kind: vk::ImageViewType,
    pub(crate) format: Format,
    pub(crate) aspect: vk::ImageAspectFlags,
    pub(crate) range: Subresources,
    pub(crate) swizzle: Swizzle,
    pub(crate) usage: vk::ImageUsageFlags,
}

/// The Vulkan views of one texture, made when they are first needed and destroyed on drop.
pub(crate) struct ViewCache {
    made: Mutex<HashMap<ViewInfo, vk::ImageView>>,
    gpu: Arc<Gpu>,
}

impl ViewCache {
    pub(crate) fn new(gpu: &Arc<Gpu>) -> Self {
        Self { made: Mutex::default(), gpu: Arc::clone(gpu) }
    }

    /// The view of this description, of the image that all views of the cache are of.
    pub(crate) fn get(&self, image: &Image, info: ViewInfo, name: &str) -> Result<vk::ImageView> {
        let mut made = self.made.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(view) = made.get(&info) {
            return Ok(*view);
        }
        let mut usage = vk::ImageViewUsageCreateInfo::default().usage(info.usage);
        let create = vk::ImageViewCreateInfo::default()
            .image(image.raw)
            .view_type(info.kind)
            .format(info.format.raw())
            .components(info.swizzle.raw())
            .subresource_range(raw_range(info.aspect, info.range))
            .push_next(&mut usage);
        // SAFETY: the image is alive, the range lies inside it, and it allows the kind, the format and the usage.
        let view = unsafe { self.gpu.device.create_image_view(&create, None) }
            .map_err(Error::vulkan("vkCreateImageView"))?;
        self.gpu.name(view, name);
        made.insert(info, view);
        Ok(view)
    }
}

impl Drop for ViewCache {
    fn drop(&mut self) {
        let made = self.made.get_mut().unwrap_or_else(PoisonError::into_inner);
        for (_, view) in made.drain() {
            // SAFETY: the owner has waited until the GPU is done with the texture and its views.
            unsafe { self.gpu.device.destroy_image_view(view, None) };
        }
    }
}

/// A kind by its Vulkan name.
pub(crate) fn raw_kind(kind: TextureKind) -> vk::ImageViewType {
    match kind {
        TextureKind::D2 => vk::ImageViewType::TYPE_2D,
        TextureKind::D2Array { .. } => vk::ImageViewType::TYPE_2D_ARRAY,
        TextureKind::D3 { .. } => vk::ImageViewType::TYPE_3D,
        TextureKind::Cube => vk::ImageViewType::CUBE,
        TextureKind::CubeArray { .. } => vk::ImageViewType::CUBE_ARRAY,
    }
}

fn raw_channel(channel: Channel) -> vk::ComponentSwizzle {
    match channel {
        Channel::Zero => vk::ComponentSwizzle::ZERO,
        Channel::One => vk::ComponentSwizzle::ONE,
        Channel::Red => vk::ComponentSwizzle::R,
        Channel::Green => vk::ComponentSwizzle::G,
        Channel::Blue => vk::ComponentSwizzle::B,
        Channel::Alpha => vk::ComponentSwizzle::A,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const REVERSED: Swizzle =
        Swizzle { red: Channel::Alpha, green: Channel::Blue, blue: Channel::Green, alpha: Channel::Red };

    #[test]
    fn swizzles_are_taken_one_after_the_other() {
        let ones = Swizzle { red: Channel::One, green: Channel::Red, ..Swizzle::IDENTITY };
        assert_eq!(REVERSED.after(REVERSED), Swizzle::IDENTITY);
        assert_eq!(ones.after(Swizzle::IDENTITY), ones);
        let both =
            Swizzle { red: Channel::One, green: Channel::Alpha, blue: Channel::Green, alpha: Channel::Red };
        assert_eq!(ones.after(REVERSED), both);
    }
}
