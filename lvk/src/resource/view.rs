//! Views: the form in which shaders and passes access a part of an image.

use std::collections::HashMap;
use std::sync::{Arc, OnceLock};

use ash::vk;

use super::image::{Image, raw_range};
use super::swizzle::Swizzle;
use super::texture_desc::{TextureKind, TextureUsage};
use crate::barrier::Subresources;
use crate::error::{Error, Result};
use crate::format::{Aspect, Format};
use crate::gpu::Gpu;
use crate::handle::TextureHandle;
use crate::lock_order::{Mutex, Rank};

/// Describes a view: a texture of some mips and layers of another texture, optionally with another kind or format.
#[derive(Debug, Clone, Copy, Default)]
pub struct TextureViewDesc<'a> {
    /// The viewed texture. It may be a view itself; mips and layers are then relative to its first ones. Default: none.
    pub texture: Option<TextureHandle>,
    /// Shape of the view. It also defines the number of layers from [`base_layer`](Self::base_layer) on: 1, the layers
    /// of an array, or 6 for each cube. `None` is the shape of the texture. Arrays then have all layers, or whole
    /// cubes, from `base_layer` on. Volumes have the depth of `base_mip`.
    ///
    /// Cube views are possible of square arrays of at least six layers. Views of volumes are volumes with all slices.
    /// Default: none.
    pub kind: Option<TextureKind>,
    /// First mip. Default: 0.
    pub base_mip: u32,
    /// Number of mips; 0 is all from [`base_mip`](Self::base_mip) on. Default: 0.
    pub mips: u32,
    /// First layer. Default: 0.
    pub base_layer: u32,
    /// Format of the texels for shaders and passes: the texture's own, or one of its
    /// [`view_formats`](crate::TextureDesc::view_formats). `None` is the texture's own. Default: none.
    pub format: Option<Format>,
    /// Aspect of the texels that shaders sample. The stencil of a format with stencil is an element of
    /// `kTexturesU2D[]`. A plane of a Y'CbCr format is a texture of [its own format](Format::plane_format).
    /// Default: [`Aspect::Main`].
    pub aspect: Aspect,
    /// Sources of the channels that shaders sample. Storage images and targets are not swizzled.
    /// Default: [`Swizzle::IDENTITY`].
    pub swizzle: Swizzle,
    /// Allowed uses of the view, a subset of the uses of its texture. `None` is every use that the format and the
    /// swizzle allow. Default: none.
    pub usage: Option<TextureUsage>,
    /// Name in error messages, validation messages and debuggers. Default: empty.
    pub debug_name: &'a str,
}

/// Properties of a Vulkan view, without its image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct ViewInfo {
    pub(crate) kind: vk::ImageViewType,
    pub(crate) format: Format,
    pub(crate) aspect: vk::ImageAspectFlags,
    pub(crate) range: Subresources,
    pub(crate) swizzle: Swizzle,
    pub(crate) usage: vk::ImageUsageFlags,
    /// Conversion of Y'CbCr texels; null for all other formats.
    pub(crate) conversion: vk::SamplerYcbcrConversion,
}

/// The Vulkan views of one texture, created on first use and destroyed on drop.
pub(crate) struct ViewCache {
    /// The view that was created first; most textures have no other.
    first: OnceLock<(ViewInfo, vk::ImageView)>,
    others: Mutex<HashMap<ViewInfo, vk::ImageView>>,
    gpu: Arc<Gpu>,
}

impl ViewCache {
    pub(crate) fn new(gpu: &Arc<Gpu>) -> Self {
        let others = Mutex::new(Rank::Views, HashMap::new());
        Self { first: OnceLock::new(), others, gpu: Arc::clone(gpu) }
    }

    /// Returns the view of this description. All views of the cache must be of the same image.
    pub(crate) fn get_or_create(&self, image: &Image, info: ViewInfo, name: &str) -> Result<vk::ImageView> {
        if let Some(view) = self.find_cached(&info) {
            return Ok(view);
        }
        let mut others = self.others.lock();
        // Another thread may have created the view while this one waited.
        if let Some(view) = self.find_cached(&info).or_else(|| others.get(&info).copied()) {
            return Ok(view);
        }
        let view = self.create(image, info, name)?;
        if self.first.set((info, view)).is_err() {
            others.insert(info, view);
        }
        Ok(view)
    }

    fn find_cached(&self, info: &ViewInfo) -> Option<vk::ImageView> {
        self.first.get().filter(|(known, _)| known == info).map(|(_, view)| *view)
    }

    fn create(&self, image: &Image, info: ViewInfo, name: &str) -> Result<vk::ImageView> {
        let mut usage = vk::ImageViewUsageCreateInfo::default().usage(info.usage);
        let mut conversion = vk::SamplerYcbcrConversionInfo::default().conversion(info.conversion);
        let mut create = vk::ImageViewCreateInfo::default()
            .image(image.raw)
            .view_type(info.kind)
            .format(info.format.raw())
            .components(info.swizzle.raw())
            .subresource_range(raw_range(info.aspect, info.range))
            .push_next(&mut usage);
        if info.conversion != vk::SamplerYcbcrConversion::null() {
            create = create.push_next(&mut conversion);
        }
        // SAFETY: the image is alive, the range lies inside it, and it allows the kind, the format and the usage.
        let view = unsafe { self.gpu.device.create_image_view(&create, None) }
            .map_err(Error::vulkan("vkCreateImageView", name))?;
        self.gpu.name(view, name);
        Ok(view)
    }
}

impl Drop for ViewCache {
    fn drop(&mut self) {
        let others = self.others.get_mut().drain().map(|(_, view)| view);
        for view in self.first.take().map(|(_, view)| view).into_iter().chain(others) {
            // SAFETY: the owner has waited until the GPU is done with the texture and its views.
            unsafe { self.gpu.device.destroy_image_view(view, None) };
        }
    }
}

/// Returns Vulkan's view type of a kind.
pub(crate) fn raw_kind(kind: TextureKind) -> vk::ImageViewType {
    match kind {
        TextureKind::D1 => vk::ImageViewType::TYPE_1D,
        TextureKind::D2 => vk::ImageViewType::TYPE_2D,
        TextureKind::D2Array { .. } => vk::ImageViewType::TYPE_2D_ARRAY,
        TextureKind::D3 { .. } => vk::ImageViewType::TYPE_3D,
        TextureKind::Cube => vk::ImageViewType::CUBE,
        TextureKind::CubeArray { .. } => vk::ImageViewType::CUBE_ARRAY,
    }
}
