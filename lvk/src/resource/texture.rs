//! Textures, the objects of texture handles: an image or a part of it, with its views and its bindless slot.

use std::sync::Arc;

use ash::vk;

use super::image::Image;
use super::image_check::check_cube_arrays;
use super::image_usage::raw_usage;
use super::portability::view_needs;
use super::region::{Region, TextureBounds, TextureRange, TextureRegion};
#[cfg(unix)]
use super::sharing::Sharing;
use super::swizzle::Swizzle;
use super::texture_desc::{TextureDesc, TextureKind, TextureUsage};
use super::view::{TextureViewDesc, ViewCache, ViewInfo, raw_kind};
use crate::barrier::Subresources;
use crate::error::{Error, Result};
use crate::format::{Aspect, CopyAspect, Format};
use crate::gpu::Gpu;

/// Mips and layers of an image, with one kind and format. Several textures may share one image.
pub(crate) struct Texture {
    /// Dropped before the image.
    views: ViewCache,
    pub(crate) image: Arc<Image>,
    pub(crate) kind: TextureKind,
    pub(crate) format: Format,
    /// The part of the image that the texture covers.
    pub(crate) range: Subresources,
    /// The part of the image that storage accesses reach: one mip. Cached, because every dispatch needs it.
    pub(crate) stored_part: Subresources,
    pub(crate) usage: TextureUsage,
    pub(crate) slot: u32,
    pub(crate) name: String,
    /// Aspect of the image that the texture covers.
    aspect: Aspect,
    swizzle: Swizzle,
    /// Conversion of Y'CbCr texels; null for all other formats.
    conversion: vk::SamplerYcbcrConversion,
    /// True if the image has an external owner, which alone destroys the texture.
    pub(crate) lent: bool,
}

impl Texture {
    /// Creates a texture with an image of its own.
    pub(crate) fn new(gpu: &Arc<Gpu>, desc: &TextureDesc<'_>, slot: u32) -> Result<Self> {
        Self::with_conversion(gpu, desc, slot, vk::SamplerYcbcrConversion::null())
    }

    /// Creates a texture in Y'CbCr with this conversion; see [`new`](Self::new).
    pub(crate) fn with_conversion(
        gpu: &Arc<Gpu>,
        desc: &TextureDesc<'_>,
        slot: u32,
        conversion: vk::SamplerYcbcrConversion,
    ) -> Result<Self> {
        Ok(Self { conversion, ..Self::from_image(gpu, desc, Image::new(gpu, desc)?, slot) })
    }

    /// Creates a texture of an image that was created outside of the library. The image must match the description.
    pub(crate) fn import(gpu: &Arc<Gpu>, desc: &TextureDesc<'_>, raw: vk::Image, slot: u32) -> Result<Self> {
        Ok(Self::from_image(gpu, desc, Image::import(gpu, desc, raw)?, slot))
    }

    /// Creates a texture with an image of its own, whose memory is shared by a file descriptor.
    #[cfg(unix)]
    pub(crate) fn with_shared_memory(
        gpu: &Arc<Gpu>,
        desc: &TextureDesc<'_>,
        sharing: Sharing,
        slot: u32,
    ) -> Result<Self> {
        Ok(Self::from_image(gpu, desc, Image::with_shared_memory(gpu, desc, sharing)?, slot))
    }

    /// Creates a texture of an image, which must match the description.
    pub(crate) fn from_image(gpu: &Arc<Gpu>, desc: &TextureDesc<'_>, image: Image, slot: u32) -> Self {
        Self {
            views: ViewCache::new(gpu),
            kind: desc.kind,
            format: desc.format,
            range: image.shape.all_subresources(),
            stored_part: one_mip(image.shape.all_subresources()),
            usage: image.usage_in(desc.format),
            slot,
            name: desc.debug_name.to_owned(),
            aspect: Aspect::Main,
            swizzle: desc.swizzle,
            conversion: vk::SamplerYcbcrConversion::null(),
            lent: image.has_external_owner(),
            image: Arc::new(image),
        }
    }

    /// Creates a texture of a part of this one. The caller must call [`Image::add_texture`] before the new texture is
    /// used.
    pub(crate) fn view(&self, desc: &TextureViewDesc<'_>, slot: u32) -> Result<Self> {
        let view_range = self.check_view(desc)?;
        Ok(Self {
            views: ViewCache::new(self.image.gpu()),
            image: Arc::clone(&self.image),
            kind: view_range.kind,
            format: view_range.format,
            range: view_range.range,
            stored_part: one_mip(view_range.range),
            usage: view_range.usage,
            slot,
            name: desc.debug_name.to_owned(),
            aspect: view_range.aspect,
            swizzle: desc.swizzle.compose(self.swizzle),
            conversion: vk::SamplerYcbcrConversion::null(),
            lent: false,
        })
    }

    /// Returns the view that shaders sample: every mip and layer.
    pub(crate) fn sampled_view(&self) -> Result<vk::ImageView> {
        self.raw_view(self.range, raw_kind(self.kind), TextureUsage::SAMPLED)
    }

    /// Returns the view that shaders write: mip 0, every layer.
    pub(crate) fn storage_view(&self) -> Result<vk::ImageView> {
        let kind = match self.kind {
            TextureKind::Cube | TextureKind::CubeArray { .. } => vk::ImageViewType::TYPE_2D_ARRAY,
            kind => raw_kind(kind),
        };
        self.raw_view(self.stored_part, kind, TextureUsage::STORAGE)
    }

    /// Returns the view that a render pass draws to: a mip of a layer, or of a slice.
    pub(crate) fn target_view(&self, mip: u32, layer: u32) -> Result<vk::ImageView> {
        self.raw_view(self.subresource(mip, layer), vk::ImageViewType::TYPE_2D, self.target_usage())
    }

    /// Returns the view of several layers or slices that a render pass draws to.
    pub(crate) fn layered_target_view(&self, mip: u32, layer: u32, count: u32) -> Result<vk::ImageView> {
        let range = Subresources { layer_count: count, ..self.subresource(mip, layer) };
        self.raw_view(range, vk::ImageViewType::TYPE_2D_ARRAY, self.target_usage())
    }

    /// Returns the view that a render pass reads its shading rates from.
    pub(crate) fn rate_view(&self, mip: u32, layer: u32) -> Result<vk::ImageView> {
        self.raw_view(self.subresource(mip, layer), vk::ImageViewType::TYPE_2D, TextureUsage::SHADING_RATE)
    }

    /// Returns the usage of target views. One view serves both as a target and as an input attachment.
    fn target_usage(&self) -> TextureUsage {
        TextureUsage::TARGET | (self.usage & TextureUsage::INPUT)
    }

    /// Returns the view that fragment shaders read in the pass that draws to the texture. The view has one aspect.
    pub(crate) fn input_view(
        &self,
        part: Subresources,
        layered: bool,
        aspect: vk::ImageAspectFlags,
    ) -> Result<vk::ImageView> {
        let info = ViewInfo {
            kind: if layered { vk::ImageViewType::TYPE_2D_ARRAY } else { vk::ImageViewType::TYPE_2D },
            format: self.format,
            aspect,
            conversion: vk::SamplerYcbcrConversion::null(),
            range: part,
            swizzle: Swizzle::IDENTITY,
            usage: raw_usage(self.target_usage(), self.format),
        };
        self.views.get_or_create(&self.image, info, &self.name)
    }

    /// Fails unless a pass can draw to the mip of `count` layers, or slices, from `layer` on.
    pub(crate) fn check_target(&self, mip: u32, layer: u32, count: u32) -> Result<()> {
        let layer = layer.saturating_add(count.saturating_sub(1));
        if !self.kind.is_3d() {
            return self.check_subresource(mip, layer);
        }
        self.check_subresource(mip, 0)?;
        let slices = self.mip_depth(mip);
        if layer < slices {
            return Ok(());
        }
        Err(Error::usage(&self.name, format!("slice {layer} does not exist: mip {mip} has {slices}")))
    }

    /// Returns the part of the image that a pass uses if it draws to the mip of the layers or slices. Slices are not
    /// tracked separately.
    pub(crate) fn attachment_subresources(&self, mip: u32, layer: u32, count: u32) -> Subresources {
        if self.kind.is_3d() {
            return self.subresource(mip, 0);
        }
        Subresources { layer_count: count, ..self.subresource(mip, layer) }
    }

    fn raw_view(
        &self,
        range: Subresources,
        kind: vk::ImageViewType,
        usage: TextureUsage,
    ) -> Result<vk::ImageView> {
        let drawn = usage.contains(TextureUsage::TARGET);
        let sampled = usage == TextureUsage::SAMPLED;
        let info = ViewInfo {
            kind,
            format: self.format,
            aspect: if drawn || self.is_yuv() {
                self.view_aspects()
            } else {
                self.copy_aspect(Aspect::Main)?.aspect
            },
            conversion: self.conversion,
            range,
            swizzle: if sampled { self.swizzle } else { Swizzle::IDENTITY },
            usage: raw_usage(usage, self.format),
        };
        self.views.get_or_create(&self.image, info, &self.name)
    }

    /// Returns the number of mips.
    pub(crate) fn mips(&self) -> u32 {
        self.range.mip_count
    }

    /// Returns the number of layers.
    pub(crate) fn layers(&self) -> u32 {
        self.range.layer_count
    }

    /// Returns one mip of one layer in the numbering of the image. `mip` and `layer` are relative to the first ones of
    /// the texture.
    pub(crate) fn subresource(&self, mip: u32, layer: u32) -> Subresources {
        let Subresources { base_mip, base_layer, .. } = self.range;
        Subresources {
            base_mip: base_mip + mip,
            mip_count: 1,
            base_layer: base_layer + layer,
            layer_count: 1,
        }
    }

    /// Returns width and height of a mip.
    pub(crate) fn mip_extent(&self, mip: u32) -> [u32; 2] {
        let [width, height, _] = self.bounds().mip_extent(mip);
        [width, height]
    }

    /// Returns the slices of a mip: 1 for all kinds but volumes.
    pub(crate) fn mip_depth(&self, mip: u32) -> u32 {
        self.bounds().mip_extent(mip)[2]
    }

    /// Returns the bounds of the texture's regions.
    pub(crate) fn bounds(&self) -> TextureBounds {
        let [width, height] = self.image.extent;
        TextureBounds { view_range: self.range, extent: [width, height, self.image.depth] }
    }

    /// True if shaders access the texture through the sampler of its Y'CbCr conversion.
    pub(crate) fn is_yuv(&self) -> bool {
        self.format.is_yuv()
    }

    /// Returns all aspects that the texture covers. Empty for textures of a plane, which are only copied and sampled.
    pub(crate) fn view_aspects(&self) -> vk::ImageAspectFlags {
        match self.aspect {
            Aspect::Main => self.image.format.aspects(),
            Aspect::Stencil => vk::ImageAspectFlags::STENCIL,
            Aspect::Plane(_) => vk::ImageAspectFlags::empty(),
        }
    }

    /// Returns an aspect of the texture for copies.
    pub(crate) fn copy_aspect(&self, aspect: Aspect) -> Result<CopyAspect> {
        let own = if self.aspect == Aspect::Main { aspect } else { self.aspect };
        let view_range = aspect == Aspect::Main || aspect == own;
        self.image.format.copy_aspect(own).filter(|_| view_range).ok_or_else(|| {
            let message =
                format!("{:?} with the aspect {:?} has no {aspect:?}", self.image.format, self.aspect);
            Error::usage(&self.name, message)
        })
    }

    /// Fails for transient textures, which exist only inside of passes.
    pub(crate) fn check_not_transient(&self) -> Result<()> {
        if !self.image.transient {
            return Ok(());
        }
        let message =
            "the texture is transient: passes clear it and do not store it, and nothing else touches it";
        Err(Error::usage(&self.name, message))
    }

    /// Checks a region and resolves its sizes.
    pub(crate) fn resolve_region(&self, region: &TextureRegion) -> Result<Region> {
        self.check_not_transient()?;
        let part = self.copy_aspect(region.aspect)?;
        self.bounds().resolve(region, part).map_err(|message| Error::usage(&self.name, message))
    }

    /// Checks a range of mips and layers and resolves its counts.
    pub(crate) fn resolve_range(&self, range: &TextureRange) -> Result<Subresources> {
        self.check_not_transient()?;
        self.bounds().resolve_range(range).map_err(|message| Error::usage(&self.name, message))
    }

    /// Fails unless the mip and the layer exist.
    pub(crate) fn check_subresource(&self, mip: u32, layer: u32) -> Result<()> {
        let (mips, layers) = (self.mips(), self.layers());
        if mip < mips && layer < layers {
            return Ok(());
        }
        let message = format!(
            "mip {mip} of layer {layer} does not exist: the texture has {mips} mips and {layers} layers"
        );
        Err(Error::usage(&self.name, message))
    }

    /// Fails unless the texture was created with `usage`.
    #[inline]
    pub(crate) fn check_usage(&self, usage: TextureUsage) -> Result<()> {
        if self.usage.contains(usage) {
            return Ok(());
        }
        let format = self.format;
        let message = if self.image.usage.contains(usage) {
            format!(
                "the texture cannot be used for {usage:?} as {format:?} with its swizzle and usage; make another view of it"
            )
        } else {
            format!("create the texture with {usage:?} in its usage")
        };
        Err(Error::usage(&self.name, message))
    }

    /// Fails for textures with several samples per texel. `what` begins the error message.
    pub(crate) fn check_one_sample(&self, what: &str) -> Result<()> {
        if self.image.samples == 1 {
            return Ok(());
        }
        let message =
            format!("{what} texels of one sample, not of {}; resolve them first", self.image.samples);
        Err(Error::usage(&self.name, message))
    }

    /// Resolves the region of an upload of `bytes`, tightly packed.
    pub(crate) fn check_upload(&self, region: &TextureRegion, bytes: u64) -> Result<Region> {
        let region = self.resolve_region(region)?;
        self.check_one_sample("uploads write")?;
        let expected = region.bytes();
        if bytes == expected {
            return Ok(region);
        }
        let [width, height, depth] = region.extent;
        let (layers, format) = (region.layers, self.format);
        let message = format!(
            "{bytes} bytes were given, but the region takes {expected} bytes: {width} x {height} x {depth} texels of \
             {format:?} in {layers} layer(s); give the bytes of all texels, tightly packed"
        );
        Err(Error::usage(&self.name, message))
    }

    /// Checks the description of a view and resolves its defaults.
    fn check_view(&self, desc: &TextureViewDesc<'_>) -> Result<ResolvedView> {
        let kind = desc.kind.unwrap_or_else(|| match self.kind {
            TextureKind::D2Array { layers } => {
                TextureKind::D2Array { layers: layers.saturating_sub(desc.base_layer) }
            }
            TextureKind::CubeArray { .. } => {
                TextureKind::CubeArray { cubes: self.layers().saturating_sub(desc.base_layer) / 6 }
            }
            TextureKind::D3 { .. } => TextureKind::D3 { depth: self.mip_depth(desc.base_mip) },
            kind => kind,
        });
        let range = self.check_view_range(desc, kind)?;
        let aspect = if desc.aspect == Aspect::Main { self.aspect } else { desc.aspect };
        let plane = match aspect {
            Aspect::Plane(plane) => self.image.format.plane_format(plane),
            Aspect::Main | Aspect::Stencil => None,
        };
        let format = desc.format.or(plane).unwrap_or(self.format);
        let allowed = self.image.usage_in(format);
        let wrong = |message: String| Err(Error::usage(desc.debug_name, message));
        let volume = TextureKind::D3 { depth: self.mip_depth(desc.base_mip) };
        if (kind.is_3d() || self.kind.is_3d()) && (kind != volume || !self.kind.is_3d()) {
            return wrong(format!(
                "'{}' is {:?}, whose mip cannot be viewed as {kind:?}",
                self.name, self.kind
            ));
        }
        if matches!(kind, TextureKind::CubeArray { .. }) {
            check_cube_arrays(self.image.gpu())?;
        }
        if kind.is_cube() && !self.image.cube_compatible {
            return wrong(format!(
                "'{}' has no six square layers of which the device can create a cube view",
                self.name
            ));
        }
        if !self.image.has_format(format) && plane != Some(format) {
            return wrong(format!("list {format:?} in the view_formats of the texture of '{}'", self.name));
        }
        if self.image.format.copy_aspect(aspect).is_none() {
            return wrong(format!("'{}' is {:?}, which has no {aspect:?}", self.name, self.image.format));
        }
        let shows_all = aspect == Aspect::Main && desc.swizzle.compose(self.swizzle) == Swizzle::IDENTITY;
        let changes_nothing = aspect == self.aspect && desc.swizzle == Swizzle::IDENTITY;
        let allowed = match (shows_all, changes_nothing) {
            (true, _) => allowed,
            (false, true) => allowed & self.usage,
            (false, false) => allowed & TextureUsage::SAMPLED,
        };
        let usage = desc.usage.unwrap_or(allowed);
        if usage.is_empty() || !allowed.contains(usage) {
            let swizzled = if shows_all { "" } else { ", with a swizzle or of its stencil" };
            return wrong(format!(
                "'{}' as {format:?}{swizzled} can be used for {allowed:?}, not for {usage:?}",
                self.name
            ));
        }
        let needs = view_needs(desc.swizzle.compose(self.swizzle), format, self.image.format);
        self.image.gpu().require_portable(&format!("texture view '{}'", desc.debug_name), needs)?;
        Ok(ResolvedView { kind, format, range, usage, aspect })
    }

    /// Returns the mips and layers of a view in the numbering of the image.
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

/// A view description with all defaults resolved.
struct ResolvedView {
    kind: TextureKind,
    format: Format,
    range: Subresources,
    usage: TextureUsage,
    aspect: Aspect,
}

/// Returns the first mip of a part.
fn one_mip(part: Subresources) -> Subresources {
    Subresources { mip_count: 1, ..part }
}
