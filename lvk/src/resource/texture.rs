//! Textures: an image, the views shaders and passes need, and its place in the bindless arrays.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use ash::vk;
use bitflags::bitflags;
use gpu_allocator::vulkan::Allocation;

use crate::barrier::{ResourceId, Subresources, TextureShape};
use crate::error::{Error, Result, check_limit};
use crate::format::Format;
use crate::gpu::Gpu;
use crate::gpu::memory::MemoryKind;

bitflags! {
    /// What a texture is used for, besides copies, which are always allowed.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
    pub struct TextureUsage: u32 {
        /// Sampled or fetched by shaders.
        const SAMPLED = 1;
        /// Written and read by shaders as a storage image (mip 0).
        const STORAGE = 1 << 1;
        /// A colour or depth target of render passes.
        const TARGET = 1 << 2;
    }
}

/// Shape of a texture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum TextureKind {
    /// One 2D image: an element of `kTextures2D[]`.
    #[default]
    D2,
    /// Layers of 2D images: an element of `kTextures2DArray[]`.
    D2Array {
        /// Number of layers, at least 1.
        layers: u32,
    },
    /// Six faces in the order +X -X +Y -Y +Z -Z: an element of `kTexturesCube[]`.
    Cube,
}

impl TextureKind {
    /// Images of one mip.
    pub fn layers(self) -> u32 {
        match self {
            Self::D2 => 1,
            Self::D2Array { layers } => layers,
            Self::Cube => 6,
        }
    }
}

/// Describes a texture.
#[derive(Debug, Clone, Copy)]
pub struct TextureDesc<'a> {
    /// Shape.
    pub kind: TextureKind,
    /// Format of the texels.
    pub format: Format,
    /// Width and height of mip 0 in texels.
    pub extent: [u32; 2],
    /// Number of mips; 0 is the whole chain down to one texel.
    pub mips: u32,
    /// What the texture is used for.
    pub usage: TextureUsage,
    /// First contents of mip 0: all layers one after the other, rows tightly packed.
    pub data: Option<&'a [u8]>,
    /// Fills the other mips from `data` by repeated halving (colour formats the device can filter).
    pub generate_mips: bool,
    /// Name in error messages, validation messages and debuggers.
    pub debug_name: &'a str,
}

impl Default for TextureDesc<'_> {
    fn default() -> Self {
        Self {
            kind: TextureKind::D2,
            format: Format::Rgba8Unorm,
            extent: [1, 1],
            mips: 1,
            usage: TextureUsage::SAMPLED,
            data: None,
            generate_mips: false,
            debug_name: "texture",
        }
    }
}

/// Part of a texture: a rectangle of one mip of one layer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct TextureRegion {
    /// Mip level.
    pub mip: u32,
    /// Layer or cube face.
    pub layer: u32,
    /// First column and row, in texels.
    pub offset: [u32; 2],
    /// Width and height in texels; `[0, 0]` is everything from `offset` on.
    pub extent: [u32; 2],
}

/// An image with memory and views, destroyed on drop.
pub(crate) struct Texture {
    pub(crate) raw: vk::Image,
    pub(crate) id: ResourceId,
    pub(crate) kind: TextureKind,
    pub(crate) format: Format,
    pub(crate) extent: [u32; 2],
    pub(crate) shape: TextureShape,
    pub(crate) usage: TextureUsage,
    pub(crate) slot: u32,
    pub(crate) name: String,
    views: Mutex<HashMap<ViewKey, vk::ImageView>>,
    allocation: Option<Allocation>,
    gpu: Arc<Gpu>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum ViewKey {
    Sampled,
    Storage,
    Target { mip: u32, layer: u32 },
}

impl Texture {
    pub(crate) fn new(gpu: &Arc<Gpu>, desc: &TextureDesc<'_>, slot: u32) -> Result<Self> {
        let mips = check_shape(gpu, desc)?;
        let info = image_info(desc, mips);
        check_format(gpu, desc, &info)?;
        // SAFETY: the description is checked against the limits of its format.
        let raw = unsafe { gpu.device.create_image(&info, None) }.map_err(Error::vulkan("vkCreateImage"))?;
        let mut texture = Self {
            raw,
            id: ResourceId::next(),
            kind: desc.kind,
            format: desc.format,
            extent: desc.extent,
            shape: TextureShape { mips, layers: desc.kind.layers() },
            usage: desc.usage,
            slot,
            name: desc.debug_name.to_owned(),
            views: Mutex::default(),
            allocation: None,
            gpu: Arc::clone(gpu),
        };
        texture.bind_memory()?;
        gpu.name(raw, desc.debug_name);
        Ok(texture)
    }

    fn bind_memory(&mut self) -> Result<()> {
        let device = &self.gpu.device;
        // SAFETY: the image was created by this device.
        let requirements = unsafe { device.get_image_memory_requirements(self.raw) };
        let allocation = self.gpu.allocate(&self.name, requirements, MemoryKind::Device, false)?;
        // SAFETY: the allocation was made for this image's requirements and is bound once.
        let bound = unsafe { device.bind_image_memory(self.raw, allocation.memory(), allocation.offset()) };
        self.allocation = Some(allocation);
        bound.map_err(Error::vulkan("vkBindImageMemory"))
    }

    /// The view shaders sample: every mip and layer.
    pub(crate) fn sampled_view(&self) -> Result<vk::ImageView> {
        self.view(ViewKey::Sampled)
    }

    /// The view shaders write: mip 0, every layer.
    pub(crate) fn storage_view(&self) -> Result<vk::ImageView> {
        self.view(ViewKey::Storage)
    }

    /// The view a render pass draws to.
    pub(crate) fn target_view(&self, mip: u32, layer: u32) -> Result<vk::ImageView> {
        self.view(ViewKey::Target { mip, layer })
    }

    fn view(&self, key: ViewKey) -> Result<vk::ImageView> {
        let mut views = self.views.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(view) = views.get(&key) {
            return Ok(*view);
        }
        let info = self.view_info(key);
        // SAFETY: the image is alive and the range lies inside it.
        let view = unsafe { self.gpu.device.create_image_view(&info, None) }
            .map_err(Error::vulkan("vkCreateImageView"))?;
        self.gpu.name(view, &self.name);
        views.insert(key, view);
        Ok(view)
    }

    fn view_info(&self, key: ViewKey) -> vk::ImageViewCreateInfo<'static> {
        let all_layers = match self.kind {
            TextureKind::D2 => vk::ImageViewType::TYPE_2D,
            TextureKind::D2Array { .. } => vk::ImageViewType::TYPE_2D_ARRAY,
            TextureKind::Cube => vk::ImageViewType::CUBE,
        };
        let storage_layers = match self.kind {
            TextureKind::D2 => vk::ImageViewType::TYPE_2D,
            TextureKind::D2Array { .. } | TextureKind::Cube => vk::ImageViewType::TYPE_2D_ARRAY,
        };
        let Subresources { base_mip, mip_count, base_layer, layer_count } = self.view_range(key);
        let (kind, aspect) = match key {
            ViewKey::Sampled => (all_layers, self.format.sampled_aspect()),
            ViewKey::Storage => (storage_layers, self.format.sampled_aspect()),
            ViewKey::Target { .. } => (vk::ImageViewType::TYPE_2D, self.format.aspects()),
        };
        let range = vk::ImageSubresourceRange {
            aspect_mask: aspect,
            base_mip_level: base_mip,
            level_count: mip_count,
            base_array_layer: base_layer,
            layer_count,
        };
        vk::ImageViewCreateInfo::default()
            .image(self.raw)
            .view_type(kind)
            .format(self.format.raw())
            .subresource_range(range)
    }

    fn view_range(&self, key: ViewKey) -> Subresources {
        match key {
            ViewKey::Sampled => self.all(),
            ViewKey::Storage => Subresources { mip_count: 1, ..self.all() },
            ViewKey::Target { mip, layer } => one(mip, layer),
        }
    }

    /// Every mip and layer.
    pub(crate) fn all(&self) -> Subresources {
        let TextureShape { mips, layers } = self.shape;
        Subresources { base_mip: 0, mip_count: mips, base_layer: 0, layer_count: layers }
    }

    /// Width and height of a mip.
    pub(crate) fn mip_extent(&self, mip: u32) -> [u32; 2] {
        self.extent.map(|side| (side >> mip.min(31)).max(1))
    }

    /// Fails unless the mip and the layer exist.
    pub(crate) fn check_subresource(&self, mip: u32, layer: u32) -> Result<()> {
        if mip < self.shape.mips && layer < self.shape.layers {
            return Ok(());
        }
        let TextureShape { mips, layers } = self.shape;
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
        Err(Error::usage(&self.name, format!("create the texture with {usage:?} in its usage")))
    }
}

impl TextureRegion {
    /// Texels of the region, once resolved.
    pub(crate) fn texels(&self) -> u64 {
        u64::from(self.extent[0]) * u64::from(self.extent[1])
    }

    /// The buffer copy of a resolved region whose bytes start at `buffer_offset`, tightly packed.
    pub(crate) fn buffer_copy(&self, format: Format, buffer_offset: u64) -> vk::BufferImageCopy {
        vk::BufferImageCopy {
            buffer_offset,
            buffer_row_length: 0,
            buffer_image_height: 0,
            image_subresource: layers_of(format, self.mip, self.layer),
            image_offset: vk::Offset3D { x: self.offset[0] as i32, y: self.offset[1] as i32, z: 0 },
            image_extent: vk::Extent3D { width: self.extent[0], height: self.extent[1], depth: 1 },
        }
    }
}

impl Drop for Texture {
    fn drop(&mut self) {
        let views = self.views.get_mut().unwrap_or_else(PoisonError::into_inner);
        for (_, view) in views.drain() {
            // SAFETY: the owner has waited until the GPU is done with the texture and its views.
            unsafe { self.gpu.device.destroy_image_view(view, None) };
        }
        // SAFETY: as above.
        unsafe { self.gpu.device.destroy_image(self.raw, None) };
        if let Some(allocation) = self.allocation.take() {
            self.gpu.free(allocation);
        }
    }
}

/// One mip of one layer.
pub(crate) fn one(mip: u32, layer: u32) -> Subresources {
    Subresources { base_mip: mip, mip_count: 1, base_layer: layer, layer_count: 1 }
}

/// One mip of one layer as copies and blits name it.
pub(crate) fn layers_of(format: Format, mip: u32, layer: u32) -> vk::ImageSubresourceLayers {
    vk::ImageSubresourceLayers {
        aspect_mask: format.sampled_aspect(),
        mip_level: mip,
        base_array_layer: layer,
        layer_count: 1,
    }
}

/// Checks the shape and answers the number of mips.
fn check_shape(gpu: &Gpu, desc: &TextureDesc<'_>) -> Result<u32> {
    let name = desc.debug_name;
    let [width, height] = desc.extent;
    let layers = desc.kind.layers();
    if width == 0 || height == 0 || layers == 0 {
        return Err(Error::usage(name, format!("a texture needs texels, not {width} x {height} x {layers}")));
    }
    if desc.usage.is_empty() {
        return Err(Error::usage(name, "give the texture at least one usage"));
    }
    let limits = &gpu.caps.limits;
    let side = u64::from(width.max(height));
    if desc.kind == TextureKind::Cube {
        if width != height {
            return Err(Error::usage(name, format!("faces of a cube are square, not {width} x {height}")));
        }
        check_limit(name, "cube side in texels", side, limits.max_texture_cube.into())?;
    }
    check_limit(name, "texture side in texels", side, limits.max_texture_2d.into())?;
    check_limit(name, "layer count", layers.into(), limits.max_texture_layers.into())?;
    let full = 32 - width.max(height).leading_zeros();
    if desc.mips > full {
        let message = format!("{} mips, but {width} x {height} texels have at most {full}", desc.mips);
        return Err(Error::usage(name, message));
    }
    Ok(if desc.mips == 0 { full } else { desc.mips })
}

fn image_info(desc: &TextureDesc<'_>, mips: u32) -> vk::ImageCreateInfo<'static> {
    let flags = match desc.kind {
        TextureKind::Cube => vk::ImageCreateFlags::CUBE_COMPATIBLE,
        TextureKind::D2 | TextureKind::D2Array { .. } => vk::ImageCreateFlags::empty(),
    };
    vk::ImageCreateInfo::default()
        .flags(flags)
        .image_type(vk::ImageType::TYPE_2D)
        .format(desc.format.raw())
        .extent(vk::Extent3D { width: desc.extent[0], height: desc.extent[1], depth: 1 })
        .mip_levels(mips)
        .array_layers(desc.kind.layers())
        .samples(vk::SampleCountFlags::TYPE_1)
        .tiling(vk::ImageTiling::OPTIMAL)
        .usage(raw_usage(desc))
        .initial_layout(vk::ImageLayout::UNDEFINED)
}

fn raw_usage(desc: &TextureDesc<'_>) -> vk::ImageUsageFlags {
    let target = if desc.format.is_depth() {
        vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT
    } else {
        vk::ImageUsageFlags::COLOR_ATTACHMENT
    };
    let pairs = [
        (TextureUsage::SAMPLED, vk::ImageUsageFlags::SAMPLED),
        (TextureUsage::STORAGE, vk::ImageUsageFlags::STORAGE),
        (TextureUsage::TARGET, target),
    ];
    let always = vk::ImageUsageFlags::TRANSFER_SRC | vk::ImageUsageFlags::TRANSFER_DST;
    pairs.iter().filter(|(bit, _)| desc.usage.contains(*bit)).fold(always, |all, (_, raw)| all | *raw)
}

/// Asks the device whether the format can be used this way, and how large.
fn check_format(gpu: &Gpu, desc: &TextureDesc<'_>, info: &vk::ImageCreateInfo<'_>) -> Result<()> {
    let name = desc.debug_name;
    let limits = gpu.image_limits(info).map_err(|_| {
        let what = format!("texture '{name}' with format {:?} and usage {:?}", desc.format, desc.usage);
        Error::unsupported(
            what,
            "the device's driver refuses the combination; choose another format or usage",
        )
    })?;
    let side = u64::from(desc.extent[0].max(desc.extent[1]));
    let limit = limits.max_extent.width.min(limits.max_extent.height);
    check_limit(name, "texture side in texels for its format", side, limit.into())?;
    let layers = u64::from(info.array_layers);
    check_limit(name, "layer count for its format", layers, limits.max_array_layers.into())?;
    let bytes =
        u64::from(desc.extent[0]) * u64::from(desc.extent[1]) * layers * u64::from(desc.format.texel_bytes());
    check_limit(name, "texture size in bytes", bytes, limits.max_resource_size)
}
