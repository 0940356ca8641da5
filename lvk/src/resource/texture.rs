//! Textures: what handles name. An image or a part of it, with its views and its place in the bindless arrays.

use std::sync::Arc;

use ash::vk;

use super::image::{Image, raw_usage};
use super::texture_desc::{TextureDesc, TextureKind, TextureUsage};
use super::view::{Swizzle, TextureViewDesc, ViewCache, ViewInfo, raw_kind};
use crate::barrier::Subresources;
use crate::error::{Error, Result};
use crate::format::Format;
use crate::gpu::Gpu;

/// Part of a texture: a rectangle of one mip of one layer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct TextureRegion {
    /// Mip level; of a view, counted from its first.
    pub mip: u32,
    /// Layer or cube face; of a view, counted from its first.
    pub layer: u32,
    /// First column and row, in texels.
    pub offset: [u32; 2],
    /// Width and height in texels; `[0, 0]` is everything from `offset` on.
    pub extent: [u32; 2],
}

/// Mips and layers of an image as one kind and format. Several textures may show the same image.
pub(crate) struct Texture {
    /// Dropped before the image.
    views: ViewCache,
    pub(crate) image: Arc<Image>,
    pub(crate) kind: TextureKind,
    pub(crate) format: Format,
    /// The part of the image that is shown.
    pub(crate) range: Subresources,
    pub(crate) usage: TextureUsage,
    pub(crate) slot: u32,
    pub(crate) name: String,
    swizzle: Swizzle,
}

impl Texture {
    /// A texture with an image of its own.
    pub(crate) fn new(gpu: &Arc<Gpu>, desc: &TextureDesc<'_>, slot: u32) -> Result<Self> {
        let image = Arc::new(Image::new(gpu, desc)?);
        Ok(Self {
            views: ViewCache::new(gpu),
            kind: desc.kind,
            format: desc.format,
            range: image.shape.whole(),
            usage: image.usage_in(desc.format),
            slot,
            name: desc.debug_name.to_owned(),
            swizzle: Swizzle::IDENTITY,
            image,
        })
    }

    /// A texture that shows part of this one. The caller has the image [shared](Image::share) before it is used.
    pub(crate) fn view(&self, desc: &TextureViewDesc<'_>, slot: u32) -> Result<Self> {
        let shown = self.check_view(desc)?;
        Ok(Self {
            views: ViewCache::new(self.image.gpu()),
            image: Arc::clone(&self.image),
            kind: shown.kind,
            format: shown.format,
            range: shown.range,
            usage: shown.usage,
            slot,
            name: desc.debug_name.to_owned(),
            swizzle: desc.swizzle.after(self.swizzle),
        })
    }

    /// The view shaders sample: every mip and layer.
    pub(crate) fn sampled_view(&self) -> Result<vk::ImageView> {
        self.raw_view(self.range, raw_kind(self.kind), TextureUsage::SAMPLED)
    }

    /// The view shaders write: mip 0, every layer.
    pub(crate) fn storage_view(&self) -> Result<vk::ImageView> {
        let kind = match self.kind {
            TextureKind::Cube => vk::ImageViewType::TYPE_2D_ARRAY,
            kind => raw_kind(kind),
        };
        self.raw_view(self.stored_part(), kind, TextureUsage::STORAGE)
    }

    /// The view a render pass draws to.
    pub(crate) fn target_view(&self, mip: u32, layer: u32) -> Result<vk::ImageView> {
        self.raw_view(self.part(mip, layer), vk::ImageViewType::TYPE_2D, TextureUsage::TARGET)
    }

    fn raw_view(
        &self,
        range: Subresources,
        kind: vk::ImageViewType,
        usage: TextureUsage,
    ) -> Result<vk::ImageView> {
        let drawn = usage == TextureUsage::TARGET;
        let info = ViewInfo {
            kind,
            format: self.format,
            aspect: if drawn { self.format.aspects() } else { self.format.sampled_aspect() },
            range,
            swizzle: self.swizzle,
            usage: raw_usage(usage, self.format),
        };
        self.views.get(&self.image, info, &self.name)
    }

    /// Number of mips.
    pub(crate) fn mips(&self) -> u32 {
        self.range.mip_count
    }

    /// Number of layers.
    pub(crate) fn layers(&self) -> u32 {
        self.range.layer_count
    }

    /// The part of the image that storage accesses reach: one mip.
    pub(crate) fn stored_part(&self) -> Subresources {
        Subresources { mip_count: 1, ..self.range }
    }

    /// One mip of one layer, counted from the texture's own first ones, as part of the image.
    pub(crate) fn part(&self, mip: u32, layer: u32) -> Subresources {
        let Subresources { base_mip, base_layer, .. } = self.range;
        Subresources {
            base_mip: base_mip + mip,
            mip_count: 1,
            base_layer: base_layer + layer,
            layer_count: 1,
        }
    }

    /// The same as copies and blits name it.
    pub(crate) fn layers_of(&self, mip: u32, layer: u32) -> vk::ImageSubresourceLayers {
        let part = self.part(mip, layer);
        vk::ImageSubresourceLayers {
            aspect_mask: self.image.format.sampled_aspect(),
            mip_level: part.base_mip,
            base_array_layer: part.base_layer,
            layer_count: 1,
        }
    }

    /// Width and height of a mip.
    pub(crate) fn mip_extent(&self, mip: u32) -> [u32; 2] {
        let mip = self.range.base_mip.saturating_add(mip).min(31);
        self.image.extent.map(|side| (side >> mip).max(1))
    }

    /// Fails unless the mip and the layer exist.
    pub(crate) fn check_subresource(&self, mip: u32, layer: u32) -> Result<()> {
        let (mips, layers) = (self.mips(), self.layers());
        if mip < mips && layer < layers {
            return Ok(());
        }
        let message =
            format!("mip {mip} of layer {layer} does not exist: it has {mips} mips and {layers} layers");
        Err(Error::usage(&self.name, message))
    }

    /// Checks a region and resolves its extent.
    pub(crate) fn resolve_region(&self, region: &TextureRegion) -> Result<TextureRegion> {
        self.check_subresource(region.mip, region.layer)?;
        let whole = self.mip_extent(region.mip);
        let mut extent = region.extent;
        for axis in 0..2 {
            if region.extent == [0, 0] {
                extent[axis] = whole[axis].saturating_sub(region.offset[axis]);
            }
            let end = region.offset[axis].checked_add(extent[axis]);
            if extent[axis] == 0 || end.is_none_or(|end| end > whole[axis]) {
                let message = format!("region {region:?} does not lie inside the mip's {whole:?} texels");
                return Err(Error::usage(&self.name, message));
            }
        }
        Ok(TextureRegion { extent, ..*region })
    }

    /// Fails unless the texture was created with `usage`.
    pub(crate) fn check_usage(&self, usage: TextureUsage) -> Result<()> {
        if self.usage.contains(usage) {
            return Ok(());
        }
        let format = self.format;
        let message = if self.image.usage.contains(usage) {
            format!(
                "it cannot be used for {usage:?} as {format:?} with its swizzle and usage; make another view of it"
            )
        } else {
            format!("create the texture with {usage:?} in its usage")
        };
        Err(Error::usage(&self.name, message))
    }

    /// The buffer copy of a resolved region whose bytes start at `buffer_offset`, tightly packed.
    pub(crate) fn buffer_copy(&self, region: &TextureRegion, buffer_offset: u64) -> vk::BufferImageCopy {
        vk::BufferImageCopy {
            buffer_offset,
            buffer_row_length: 0,
            buffer_image_height: 0,
            image_subresource: self.layers_of(region.mip, region.layer),
            image_offset: vk::Offset3D { x: region.offset[0] as i32, y: region.offset[1] as i32, z: 0 },
            image_extent: vk::Extent3D { width: region.extent[0], height: region.extent[1], depth: 1 },
        }
    }

    /// Decides what a view of the texture shows.
    fn check_view(&self, desc: &TextureViewDesc<'_>) -> Result<Shown> {
        let kind = desc.kind.unwrap_or_else(|| match self.kind {
            TextureKind::D2Array { layers } => {
                TextureKind::D2Array { layers: layers.saturating_sub(desc.base_layer) }
            }
            kind => kind,
        });
        let range = self.check_view_range(desc, kind)?;
        let format = desc.format.unwrap_or(self.format);
        let allowed = self.image.usage_in(format);
        let wrong = |message: String| Err(Error::usage(desc.debug_name, message));
        if kind == TextureKind::Cube && !self.image.cube_compatible {
            return wrong(format!(
                "'{}' has no six square layers that the device takes for a cube",
                self.name
            ));
        }
        if !self.image.has_format(format) {
            return wrong(format!("list {format:?} in the view_formats of the texture of '{}'", self.name));
        }
        let stays = desc.swizzle.after(self.swizzle) == Swizzle::IDENTITY;
        let allowed = if stays { allowed } else { allowed & TextureUsage::SAMPLED };
        let usage = desc.usage.unwrap_or(allowed);
        if usage.is_empty() || !allowed.contains(usage) {
            let swizzled = if stays { "" } else { ", with a swizzle" };
            return wrong(format!(
                "'{}' as {format:?}{swizzled} can be used for {allowed:?}, not for {usage:?}",
                self.name
            ));
        }
        Ok(Shown { kind, format, range, usage })
    }

    /// The mips and layers of a view, as part of the image.
    fn check_view_range(&self, desc: &TextureViewDesc<'_>, kind: TextureKind) -> Result<Subresources> {
        let mips = if desc.mips == 0 { self.mips().saturating_sub(desc.base_mip) } else { desc.mips };
        let layers = kind.layers();
        let fits = |base: u32, count: u32, whole: u32| {
            count > 0 && base.checked_add(count).is_some_and(|end| end <= whole)
        };
        if fits(desc.base_mip, mips, self.mips()) && fits(desc.base_layer, layers, self.layers()) {
            return Ok(Subresources {
                base_mip: self.range.base_mip + desc.base_mip,
                mip_count: mips,
                base_layer: self.range.base_layer + desc.base_layer,
                layer_count: layers,
            });
        }
        let message = format!(
            "'{}' has {} mips and {} layers, but the view takes {mips} mips from {} on and {layers} layers from {} on",
            self.name,
            self.mips(),
            self.layers(),
            desc.base_mip,
            desc.base_layer
        );
        Err(Error::usage(desc.debug_name, message))
    }
}

/// What a view shows.
struct Shown {
    kind: TextureKind,
    format: Format,
    range: Subresources,
    usage: TextureUsage,
}

impl TextureRegion {
    /// Texels of the region, once resolved.
    pub(crate) fn texels(&self) -> u64 {
        u64::from(self.extent[0]) * u64::from(self.extent[1])
    }
}
