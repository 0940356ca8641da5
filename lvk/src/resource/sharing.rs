//! Objects whose memory is shared by file descriptors: export, import, and images in dma-bufs.

use ash::vk;

use super::texture_desc::{TextureDesc, TextureKind, TextureMemory};
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::gpu::answers::image_support;
use crate::gpu::memory::allocator::ObjectMemory;
use crate::gpu::memory::external::{
    DedicatedTo, DrmLayout, DrmPlane, MemoryFd, MemoryFdType, check_shareable,
};

/// Direction in which memory is shared.
pub(crate) enum Sharing {
    /// New memory that can be exported.
    Export(MemoryFdType),
    /// Memory of another device, process or API.
    Import(MemoryFd),
}

impl Sharing {
    pub(crate) fn fd_type(&self) -> MemoryFdType {
        match self {
            Self::Export(fd_type) => *fd_type,
            Self::Import(memory) => memory.fd_type,
        }
    }

    fn direction(&self) -> vk::ExternalMemoryFeatureFlags {
        match self {
            Self::Export(_) => vk::ExternalMemoryFeatureFlags::EXPORTABLE,
            Self::Import(_) => vk::ExternalMemoryFeatureFlags::IMPORTABLE,
        }
    }

    /// Fails unless the driver shares the memory of `object` in this direction.
    pub(crate) fn check(&self, object: &str, found: vk::ExternalMemoryFeatureFlags) -> Result<()> {
        check_shareable(object, self.fd_type(), found, self.direction())
    }

    /// Allocates or imports the memory of an object.
    pub(crate) fn memory(
        self,
        gpu: &Gpu,
        name: &str,
        requirements: vk::MemoryRequirements,
        owner: DedicatedTo,
    ) -> Result<ObjectMemory> {
        match self {
            Self::Export(fd_type) => gpu.allocate_exportable(name, requirements, owner, fd_type),
            Self::Import(memory) => gpu.import_memory(name, requirements, owner, memory),
        }
    }
}

/// Fails if a texture cannot have shared memory. Dma-bufs hold plain 2D colour images.
pub(crate) fn check_shared_texture(desc: &TextureDesc<'_>, sharing: &Sharing) -> Result<()> {
    let name = desc.debug_name;
    if desc.format.is_yuv() {
        return Err(Error::usage(
            name,
            "textures in Y'CbCr have no shared memory; share the planes as textures",
        ));
    }
    if desc.memory != TextureMemory::Device {
        return Err(Error::usage(name, "shared memory is TextureMemory::Device"));
    }
    if sharing.fd_type() != MemoryFdType::DmaBuf {
        return Ok(());
    }
    let plain = desc.kind == TextureKind::D2 && desc.mips == 1 && desc.samples == 1;
    if !plain || !desc.view_formats.is_empty() || !desc.format.is_color() {
        let message =
            "a texture in a dma-buf is D2, has a colour format, 1 mip, 1 sample and no view formats";
        return Err(Error::usage(name, message));
    }
    match sharing {
        Sharing::Import(MemoryFd { drm_layout: None, .. }) => {
            Err(Error::usage(name, "give MemoryFd::drm_layout, which a texture in a dma-buf needs"))
        }
        Sharing::Import(MemoryFd { drm_layout: Some(layout), .. })
            if !(1..=4).contains(&layout.planes.len()) =>
        {
            let message = format!("a DRM layout has 1 to 4 planes, not {}", layout.planes.len());
            Err(Error::usage(name, message))
        }
        _ => Ok(()),
    }
}

/// Returns the DRM format modifiers with which the device shares an image of this description. `name` is the object in the error.
pub(crate) fn shareable_modifiers(
    gpu: &Gpu,
    info: &vk::ImageCreateInfo<'_>,
    sharing: &Sharing,
    name: &str,
) -> Result<Vec<u64>> {
    let all = format_modifiers(gpu, info.format);
    let wanted: Vec<_> = match sharing {
        Sharing::Export(_) => all.iter().map(|found| found.drm_format_modifier).collect(),
        Sharing::Import(memory) => memory.drm_layout.iter().map(|layout| layout.modifier).collect(),
    };
    let mut usable = Vec::new();
    for modifier in wanted {
        let is_known = all.iter().any(|found| found.drm_format_modifier == modifier);
        if is_known
            && external_features(gpu, info, sharing.fd_type(), Some(modifier), name)?
                .contains(sharing.direction())
        {
            usable.push(modifier);
        }
    }
    Ok(usable)
}

fn format_modifiers(gpu: &Gpu, format: vk::Format) -> Vec<vk::DrmFormatModifierPropertiesEXT> {
    let (instance, physical) = (&gpu.instance.raw, gpu.physical());
    let mut list = vk::DrmFormatModifierPropertiesListEXT::default();
    let mut all = vk::FormatProperties2::default().push_next(&mut list);
    // SAFETY: the physical device belongs to the instance and has the extension of the list.
    unsafe { instance.get_physical_device_format_properties2(physical, format, &mut all) };
    let mut found =
        vec![vk::DrmFormatModifierPropertiesEXT::default(); list.drm_format_modifier_count as usize];
    let mut list =
        vk::DrmFormatModifierPropertiesListEXT::default().drm_format_modifier_properties(&mut found);
    let mut all = vk::FormatProperties2::default().push_next(&mut list);
    // SAFETY: as above; the list has room for the modifiers.
    unsafe { instance.get_physical_device_format_properties2(physical, format, &mut all) };
    found
}

/// Returns in which directions the memory of an image can be shared: none if the driver does not support the image. `name` is the
/// object in the error.
pub(crate) fn external_features(
    gpu: &Gpu,
    info: &vk::ImageCreateInfo<'_>,
    fd_type: MemoryFdType,
    modifier: Option<u64>,
    name: &str,
) -> Result<vk::ExternalMemoryFeatureFlags> {
    let mut external = vk::PhysicalDeviceExternalImageFormatInfo::default().handle_type(fd_type.raw());
    let mut drm = vk::PhysicalDeviceImageDrmFormatModifierInfoEXT::default();
    let mut query = vk::PhysicalDeviceImageFormatInfo2::default()
        .format(info.format)
        .ty(info.image_type)
        .tiling(info.tiling)
        .usage(info.usage)
        .flags(info.flags)
        .push_next(&mut external);
    if let Some(modifier) = modifier {
        drm.drm_format_modifier = modifier;
        query = query.tiling(vk::ImageTiling::DRM_FORMAT_MODIFIER_EXT).push_next(&mut drm);
    }
    let mut found = vk::ExternalImageFormatProperties::default();
    let mut all = vk::ImageFormatProperties2::default().push_next(&mut found);
    // SAFETY: the physical device belongs to the instance and has the extensions of the chain.
    let answer = unsafe {
        let instance = &gpu.instance.raw;
        instance.get_physical_device_image_format_properties2(gpu.physical(), &query, &mut all)
    };
    let supported = image_support(answer, "vkGetPhysicalDeviceImageFormatProperties2", name)?;
    Ok(supported.map_or_else(vk::ExternalMemoryFeatureFlags::empty, |()| {
        found.external_memory_properties.external_memory_features
    }))
}

/// Returns the planes in Vulkan's form, for the creation of an imported image.
pub(crate) fn plane_layouts(layout: &DrmLayout) -> Vec<vk::SubresourceLayout> {
    let raw = |plane: &DrmPlane| vk::SubresourceLayout {
        offset: plane.offset_bytes,
        row_pitch: plane.row_pitch_bytes,
        ..Default::default()
    };
    layout.planes.iter().map(raw).collect()
}

/// Returns the layout of the image `name` in a dma-buf (`vkGetImageDrmFormatModifierPropertiesEXT`).
pub(crate) fn drm_layout(gpu: &Gpu, image: vk::Image, format: vk::Format, name: &str) -> Result<DrmLayout> {
    let functions = ash::ext::image_drm_format_modifier::Device::new(&gpu.instance.raw, &gpu.device);
    let mut found = vk::ImageDrmFormatModifierPropertiesEXT::default();
    // SAFETY: the image belongs to the device and was created with a modifier.
    unsafe { functions.get_image_drm_format_modifier_properties(image, &mut found) }
        .map_err(Error::vulkan("vkGetImageDrmFormatModifierPropertiesEXT", name))?;
    let modifier = found.drm_format_modifier;
    let all = format_modifiers(gpu, format);
    let known = all.iter().find(|known| known.drm_format_modifier == modifier);
    let count = known.map_or(1, |known| known.drm_format_modifier_plane_count);
    let planes = (0..count.min(4)).map(|plane| {
        let aspect =
            vk::ImageAspectFlags::from_raw(vk::ImageAspectFlags::MEMORY_PLANE_0_EXT.as_raw() << plane);
        let part = vk::ImageSubresource::default().aspect_mask(aspect);
        // SAFETY: the image belongs to the device, and the modifier has this plane.
        let layout = unsafe { gpu.device.get_image_subresource_layout(image, part) };
        DrmPlane { offset_bytes: layout.offset, row_pitch_bytes: layout.row_pitch }
    });
    Ok(DrmLayout { modifier, planes: planes.collect() })
}
