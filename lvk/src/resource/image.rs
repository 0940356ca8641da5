//! An image with its memory, shared by the textures that show it or parts of it.

use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use ash::vk;
use gpu_allocator::vulkan::Allocation;

use super::texture_desc::{TextureDesc, TextureKind, TextureUsage};
use crate::barrier::{ResourceId, Subresources, TextureShape};
use crate::error::{Error, Result, check_limit};
use crate::format::Format;
use crate::gpu::Gpu;
use crate::gpu::memory::MemoryKind;
use crate::handle::{Handle, TextureHandle};

/// An image with memory, destroyed on drop. The tracker knows it by `id`, whichever texture names it.
pub(crate) struct Image {
    pub(crate) raw: vk::Image,
    pub(crate) id: ResourceId,
    pub(crate) format: Format,
    /// Width and height of mip 0.
    pub(crate) extent: [u32; 2],
    /// Slices of mip 0.
    pub(crate) depth: u32,
    volume: bool,
    pub(crate) shape: TextureShape,
    pub(crate) usage: TextureUsage,
    /// Samples a texel.
    pub(crate) samples: u32,
    /// What other formats views may have.
    pub(crate) view_formats: Vec<Format>,
    /// Whether six layers can be seen as a cube.
    pub(crate) cube_compatible: bool,
    /// Textures with a handle, or waiting to be destroyed, that show the image.
    handles: AtomicU32,
    allocation: Option<Allocation>,
    gpu: Arc<Gpu>,
}

/// An image as barriers and clears name its parts.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BarrierImage {
    pub(crate) raw: vk::Image,
    aspects: vk::ImageAspectFlags,
    volume: bool,
}

impl BarrierImage {
    /// A part of the image with all its aspects. Of volumes all slices are meant, which is what one layer may mean too.
    pub(crate) fn range(&self, part: Subresources) -> vk::ImageSubresourceRange {
        let layer_count = if self.volume { vk::REMAINING_ARRAY_LAYERS } else { part.layer_count };
        vk::ImageSubresourceRange { layer_count, ..raw_range(self.aspects, part) }
    }
}

impl Image {
    /// An image for one texture.
    pub(crate) fn new(gpu: &Arc<Gpu>, desc: &TextureDesc<'_>) -> Result<Self> {
        let mips = check_shape(gpu, desc)?;
        check_view_formats(desc)?;
        let flags = flags(gpu, desc, mips);
        let formats: Vec<_> = [desc.format].iter().chain(desc.view_formats).map(|f| f.raw()).collect();
        let mut list = vk::ImageFormatListCreateInfo::default().view_formats(&formats);
        let mut info = image_info(desc, mips).flags(flags);
        check_format(gpu, desc, &info)?;
        if !desc.view_formats.is_empty() {
            info = info.push_next(&mut list);
        }
        // SAFETY: the description is checked against the limits of its format.
        let raw = unsafe { gpu.device.create_image(&info, None) }.map_err(Error::vulkan("vkCreateImage"))?;
        let mut image = Self {
            raw,
            id: ResourceId::next(),
            format: desc.format,
            extent: desc.extent,
            depth: desc.kind.depth(),
            volume: desc.kind.is_3d(),
            shape: TextureShape { mips, layers: desc.kind.layers() },
            usage: desc.usage,
            samples: desc.samples,
            view_formats: desc.view_formats.to_vec(),
            cube_compatible: flags.contains(vk::ImageCreateFlags::CUBE_COMPATIBLE),
            handles: AtomicU32::new(1),
            allocation: None,
            gpu: Arc::clone(gpu),
        };
        image.bind_memory(desc.debug_name)?;
        gpu.name(raw, desc.debug_name);
        Ok(image)
    }

    fn bind_memory(&mut self, name: &str) -> Result<()> {
        let device = &self.gpu.device;
        // SAFETY: the image was created by this device.
        let requirements = unsafe { device.get_image_memory_requirements(self.raw) };
        let allocation = self.gpu.allocate(name, requirements, MemoryKind::Device, false)?;
        // SAFETY: the allocation was made for this image's requirements and is bound once.
        let bound = unsafe { device.bind_image_memory(self.raw, allocation.memory(), allocation.offset()) };
        self.allocation = Some(allocation);
        bound.map_err(Error::vulkan("vkBindImageMemory"))
    }

    /// One more texture shows the image. Fails where the last one is already gone.
    pub(crate) fn share(&self) -> Result<()> {
        let more = |count: u32| (count > 0).then_some(count + 1);
        match self.handles.fetch_update(Ordering::AcqRel, Ordering::Acquire, more) {
            Ok(_) => Ok(()),
            Err(_) => Err(Error::StaleHandle { kind: TextureHandle::KIND }),
        }
    }

    /// A texture of the image is gone; answers whether it was the last.
    pub(crate) fn release(&self) -> bool {
        self.handles.fetch_sub(1, Ordering::AcqRel) == 1
    }

    /// Which of the image's usages a view in `format` can have.
    pub(crate) fn usage_in(&self, format: Format) -> TextureUsage {
        if self.view_formats.is_empty() {
            return self.usage;
        }
        self.usage & usage_of(self.gpu.image_features(format.raw()))
    }

    /// Whether views may have this format.
    pub(crate) fn has_format(&self, format: Format) -> bool {
        format == self.format || self.view_formats.contains(&format)
    }

    /// What barriers have to know of the image.
    pub(crate) fn for_barriers(&self) -> BarrierImage {
        BarrierImage { raw: self.raw, aspects: self.format.aspects(), volume: self.volume }
    }

    pub(crate) fn gpu(&self) -> &Arc<Gpu> {
        &self.gpu
    }
}

impl Drop for Image {
    fn drop(&mut self) {
        // SAFETY: the owners have waited until the GPU is done with the image, and their views are gone.
        unsafe { self.gpu.device.destroy_image(self.raw, None) };
        if let Some(allocation) = self.allocation.take() {
            self.gpu.free(allocation);
        }
    }
}

/// A part of an image by its Vulkan name.
pub(crate) fn raw_range(aspect_mask: vk::ImageAspectFlags, part: Subresources) -> vk::ImageSubresourceRange {
    vk::ImageSubresourceRange {
        aspect_mask,
        base_mip_level: part.base_mip,
        level_count: part.mip_count,
        base_array_layer: part.base_layer,
        layer_count: part.layer_count,
    }
}

/// A usage by its Vulkan name.
pub(crate) fn raw_usage(usage: TextureUsage, format: Format) -> vk::ImageUsageFlags {
    let target = if format.is_depth() {
        vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT
    } else {
        vk::ImageUsageFlags::COLOR_ATTACHMENT
    };
    let pairs = [
        (TextureUsage::SAMPLED, vk::ImageUsageFlags::SAMPLED),
        (TextureUsage::STORAGE, vk::ImageUsageFlags::STORAGE),
        (TextureUsage::TARGET, target),
    ];
    let none = vk::ImageUsageFlags::empty();
    pairs.iter().filter(|(bit, _)| usage.contains(*bit)).fold(none, |all, (_, raw)| all | *raw)
}

/// What a format with these features can be used for.
fn usage_of(features: vk::FormatFeatureFlags) -> TextureUsage {
    use vk::FormatFeatureFlags as Features;
    let pairs = [
        (TextureUsage::SAMPLED, Features::SAMPLED_IMAGE),
        (TextureUsage::STORAGE, Features::STORAGE_IMAGE),
        (TextureUsage::TARGET, Features::COLOR_ATTACHMENT | Features::DEPTH_STENCIL_ATTACHMENT),
    ];
    pairs.iter().filter(|(_, any)| features.intersects(*any)).map(|(usage, _)| *usage).collect()
}

/// Checks the shape and answers the number of mips.
fn check_shape(gpu: &Gpu, desc: &TextureDesc<'_>) -> Result<u32> {
    let name = desc.debug_name;
    let [width, height] = desc.extent;
    let (layers, depth) = (desc.kind.layers(), desc.kind.depth());
    if width == 0 || height == 0 || layers == 0 || depth == 0 {
        let count = layers.min(depth);
        return Err(Error::usage(name, format!("a texture needs texels, not {width} x {height} x {count}")));
    }
    if desc.usage.is_empty() {
        return Err(Error::usage(name, "give the texture at least one usage"));
    }
    check_sides(gpu, desc)?;
    check_limit(name, "layer count", layers.into(), gpu.caps.limits.max_texture_layers.into())?;
    check_samples(desc)?;
    let full = 32 - width.max(height).max(depth).leading_zeros();
    if desc.mips > full {
        let message =
            format!("{} mips, but {width} x {height} x {depth} texels have at most {full}", desc.mips);
        return Err(Error::usage(name, message));
    }
    Ok(if desc.mips == 0 { full } else { desc.mips })
}

/// Fails unless the texture may have as many samples a texel, for all that does not depend on the device.
fn check_samples(desc: &TextureDesc<'_>) -> Result<()> {
    let wrong =
        |message: &str| Err(Error::usage(desc.debug_name, format!("{} samples: {message}", desc.samples)));
    if !desc.samples.is_power_of_two() || desc.samples > 64 {
        return wrong("a texel has 1, 2, 4, 8, 16, 32 or 64");
    }
    if desc.samples == 1 {
        return Ok(());
    }
    if !matches!(desc.kind, TextureKind::D2 | TextureKind::D2Array { .. }) || desc.mips != 1 {
        return wrong("multisampled textures are D2 or D2Array, with one mip");
    }
    if desc.usage.contains(TextureUsage::STORAGE) {
        return wrong("storage images have one; resolve to another texture");
    }
    if desc.data.is_some() {
        return wrong("data cannot be uploaded; draw to the texture, or clear it");
    }
    Ok(())
}

fn check_sides(gpu: &Gpu, desc: &TextureDesc<'_>) -> Result<()> {
    let (name, limits) = (desc.debug_name, &gpu.caps.limits);
    let [width, height] = desc.extent;
    let side = u64::from(width.max(height));
    if let TextureKind::D3 { depth } = desc.kind {
        let side = side.max(depth.into());
        return check_limit(name, "volume side in texels", side, limits.max_texture_3d.into());
    }
    if desc.kind.is_cube() {
        if width != height {
            return Err(Error::usage(name, format!("faces of a cube are square, not {width} x {height}")));
        }
        check_limit(name, "cube side in texels", side, limits.max_texture_cube.into())?;
    }
    check_limit(name, "texture side in texels", side, limits.max_texture_2d.into())?;
    if matches!(desc.kind, TextureKind::CubeArray { .. }) { check_cube_arrays(gpu) } else { Ok(()) }
}

/// Fails unless the device has arrays of cubes.
pub(crate) fn check_cube_arrays(gpu: &Gpu) -> Result<()> {
    if gpu.caps.cube_arrays { Ok(()) } else { Err(gpu.lacks("arrays of cubes (imageCubeArray)")) }
}

/// Fails unless all formats are colours of texels of one size.
fn check_view_formats(desc: &TextureDesc<'_>) -> Result<()> {
    let alike = |other: &Format| {
        !desc.format.is_depth() && !other.is_depth() && other.texel_bytes() == desc.format.texel_bytes()
    };
    match desc.view_formats.iter().find(|other| !alike(other)) {
        None => Ok(()),
        Some(other) => {
            let message = format!(
                "texels of {:?} cannot be seen as {other:?}: both must be colours of the same number of bytes",
                desc.format
            );
            Err(Error::usage(desc.debug_name, message))
        }
    }
}

/// Views of other formats and kinds have to be allowed when the image is made.
fn flags(gpu: &Gpu, desc: &TextureDesc<'_>, mips: u32) -> vk::ImageCreateFlags {
    use vk::ImageCreateFlags as Flags;
    let formats = match desc.view_formats {
        [] => Flags::empty(),
        _ => Flags::MUTABLE_FORMAT | Flags::EXTENDED_USAGE,
    };
    let cube = formats | Flags::CUBE_COMPATIBLE;
    match desc.kind {
        TextureKind::Cube | TextureKind::CubeArray { .. } => cube,
        // Passes draw to slices by 2D views of them.
        TextureKind::D3 { .. } if desc.usage.contains(TextureUsage::TARGET) => {
            formats | Flags::TYPE_2D_ARRAY_COMPATIBLE
        }
        TextureKind::D2Array { layers }
            if layers >= 6 && desc.extent[0] == desc.extent[1] && desc.samples == 1 =>
        {
            let small = desc.extent[0] <= gpu.caps.limits.max_texture_cube;
            let allowed = gpu.image_limits(&image_info(desc, mips).flags(cube));
            let allowed = allowed.is_ok_and(|limits| limits.max_array_layers >= layers);
            if small && allowed { cube } else { formats }
        }
        TextureKind::D2 | TextureKind::D2Array { .. } | TextureKind::D3 { .. } => formats,
    }
}

fn image_info(desc: &TextureDesc<'_>, mips: u32) -> vk::ImageCreateInfo<'static> {
    let copies = vk::ImageUsageFlags::TRANSFER_SRC | vk::ImageUsageFlags::TRANSFER_DST;
    vk::ImageCreateInfo::default()
        .image_type(if desc.kind.is_3d() { vk::ImageType::TYPE_3D } else { vk::ImageType::TYPE_2D })
        .format(desc.format.raw())
        .extent(vk::Extent3D { width: desc.extent[0], height: desc.extent[1], depth: desc.kind.depth() })
        .mip_levels(mips)
        .array_layers(desc.kind.layers())
        .samples(vk::SampleCountFlags::from_raw(desc.samples))
        .tiling(vk::ImageTiling::OPTIMAL)
        .usage(raw_usage(desc.usage, desc.format) | copies)
        .initial_layout(vk::ImageLayout::UNDEFINED)
}

/// Asks the device whether the format can be used this way, and how large.
fn check_format(gpu: &Gpu, desc: &TextureDesc<'_>, info: &vk::ImageCreateInfo<'_>) -> Result<()> {
    let name = desc.debug_name;
    let refused = || {
        let also = match desc.view_formats {
            [] => String::new(),
            formats => format!(", views of {formats:?}"),
        };
        let what = format!("texture '{name}' with format {:?}{also} and usage {:?}", desc.format, desc.usage);
        Error::unsupported(
            what,
            "the device's driver refuses the combination; choose another format or usage",
        )
    };
    let limits = gpu.image_limits(info).map_err(|_| refused())?;
    let formats = [desc.format].into_iter().chain(desc.view_formats.iter().copied());
    let usages: TextureUsage = formats.map(|format| usage_of(gpu.image_features(format.raw()))).collect();
    if !desc.view_formats.is_empty() && !usages.contains(desc.usage) {
        return Err(refused());
    }
    if !limits.sample_counts.contains(info.samples) {
        let what =
            format!("texture '{name}' of {} samples a texel with format {:?}", desc.samples, desc.format);
        let counts = limits.sample_counts.as_raw();
        let counts: Vec<_> = (0..7).map(|bit| 1_u32 << bit).filter(|count| counts & count != 0).collect();
        return Err(Error::unsupported(what, format!("with this usage the device takes {counts:?}")));
    }
    let side = u64::from(desc.extent[0].max(desc.extent[1]));
    let limit = limits.max_extent.width.min(limits.max_extent.height);
    check_limit(name, "texture side in texels for its format", side, limit.into())?;
    let depth = u64::from(desc.kind.depth());
    check_limit(name, "texture depth in texels for its format", depth, limits.max_extent.depth.into())?;
    check_limit(name, "mip count for its format", info.mip_levels.into(), limits.max_mip_levels.into())?;
    let layers = u64::from(info.array_layers);
    check_limit(name, "layer count for its format", layers, limits.max_array_layers.into())?;
    let texels = desc.extent.map(u64::from).into_iter().chain([depth, layers, desc.samples.into()]);
    let bytes = texels.fold(desc.format.texel_bytes().into(), u64::saturating_mul);
    check_limit(name, "texture size in bytes", bytes, limits.max_resource_size)
}
