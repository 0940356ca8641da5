//! An image with its memory, shared by all textures that are views of it.

use std::any::Any;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use ash::vk;

use super::host_copy;
use super::image_check::{ImagePlan, check_image};
use super::image_usage::usage_from_features;
#[cfg(unix)]
use super::sharing::{Sharing, check_shared_texture, external_features, plane_layouts, shareable_modifiers};
use super::texture_desc::{TextureDesc, TextureMemory, TextureUsage};
use super::transient_heap::{SharedBlock, TransientPlace};
use crate::barrier::{ResourceId, Subresources, TextureShape};
use crate::error::{Error, Result};
use crate::format::Format;
use crate::gpu::Gpu;
#[cfg(unix)]
use crate::gpu::caps::optional_features::OptionalFeature;
use crate::gpu::memory::allocator::{MemoryKind, ObjectMemory};
#[cfg(unix)]
use crate::gpu::memory::external::{DedicatedTo, MemoryFd, MemoryFdType};
use crate::handle::{Handle, TextureHandle};

/// An image with memory, destroyed on drop. The tracker identifies it by `id`, no matter which texture is used.
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
    /// Samples per texel.
    pub(crate) samples: u32,
    /// Other formats that views may have.
    pub(crate) view_formats: Vec<Format>,
    /// True if cube views of six layers are possible.
    pub(crate) cube_compatible: bool,
    /// Number of textures of the image that have a handle or wait for their destruction.
    handles: AtomicU32,
    /// True if the image exists only inside of passes.
    pub(crate) transient: bool,
    /// `Some` for a texture of a transient heap, which shares its memory with other textures.
    pub(crate) transient_place: Option<TransientPlace>,
    memory: Option<Memory>,
    /// True if one queue family owns the image at a time.
    is_exclusive: bool,
    /// True if the host writes the initial contents.
    pub(crate) host_filled: bool,
    /// True if the image was created outside of the library, which then does not destroy it.
    is_external: bool,
    /// Type of the file descriptors that share the memory, if it is shared.
    #[cfg(unix)]
    shared_as: Option<MemoryFdType>,
    /// External owner of the image, if it must be kept alive.
    owner: Option<Arc<dyn Any + Send + Sync>>,
    gpu: Arc<Gpu>,
}

/// Memory of an image.
enum Memory {
    Managed(ObjectMemory),
    /// Lazily allocated memory, which exists only while a pass needs it.
    Lazy(vk::DeviceMemory),
    /// A part of a block that other images use too, from this offset on.
    Shared(Arc<SharedBlock>, u64),
}

/// An image with the properties that barriers and clears need.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BarrierImage {
    pub(crate) raw: vk::Image,
    /// True if one queue family owns the image at a time.
    pub(crate) is_exclusive: bool,
    aspects: vk::ImageAspectFlags,
    volume: bool,
}

impl BarrierImage {
    /// Returns a part of the image with all its aspects. For volumes the range covers all slices, which one layer may
    /// mean too.
    pub(crate) fn range(&self, part: Subresources) -> vk::ImageSubresourceRange {
        let layer_count = if self.volume { vk::REMAINING_ARRAY_LAYERS } else { part.layer_count };
        vk::ImageSubresourceRange { layer_count, ..raw_range(self.aspects, part) }
    }
}

impl Image {
    /// Creates an image for one texture.
    pub(crate) fn new(gpu: &Arc<Gpu>, desc: &TextureDesc<'_>) -> Result<Self> {
        let mut image = Self::without_memory(gpu, desc)?;
        image.bind_memory(desc.debug_name)?;
        Ok(image)
    }

    /// Creates an image for one texture. The caller must bind memory before any other use.
    pub(crate) fn without_memory(gpu: &Arc<Gpu>, desc: &TextureDesc<'_>) -> Result<Self> {
        let plan = check_image(gpu, desc)?;
        let formats: Vec<_> = [desc.format].iter().chain(desc.view_formats).map(|f| f.raw()).collect();
        let mut list = vk::ImageFormatListCreateInfo::default().view_formats(&formats);
        let mut info = plan.info(desc);
        let families = gpu.queues.families();
        if families.len() > 1 && is_shared(desc) {
            info = info.sharing_mode(vk::SharingMode::CONCURRENT).queue_family_indices(families);
        }
        if !desc.view_formats.is_empty() {
            info = info.push_next(&mut list);
        }
        let host_filled = host_copy::can_fill_from_host(gpu, desc, &info)?;
        if host_filled {
            info.usage |= vk::ImageUsageFlags::HOST_TRANSFER_EXT;
        }
        // SAFETY: the description is checked against the limits of its format.
        let raw = unsafe { gpu.device.create_image(&info, None) }
            .map_err(Error::vulkan("vkCreateImage", desc.debug_name))?;
        let mut image = Self::from_raw(gpu, desc, &plan, raw, false);
        image.host_filled = host_filled;
        gpu.name(raw, desc.debug_name);
        Ok(image)
    }

    /// Creates an image for one texture, whose memory is shared by a file descriptor.
    #[cfg(unix)]
    pub(crate) fn with_shared_memory(
        gpu: &Arc<Gpu>,
        desc: &TextureDesc<'_>,
        sharing: Sharing,
    ) -> Result<Self> {
        let name = desc.debug_name;
        let fd_type = sharing.fd_type();
        gpu.require_memory_fd(fd_type, &format!("texture '{name}' with shared memory"))?;
        check_shared_texture(desc, &sharing)?;
        let plan = check_image(gpu, desc)?;
        let raw = match fd_type {
            MemoryFdType::DmaBuf => create_in_dma_buf(gpu, desc, &plan, &sharing)?,
            MemoryFdType::Opaque => create_opaque(gpu, desc, &plan, &sharing)?,
        };
        let mut image = Self::from_raw(gpu, desc, &plan, raw, false);
        image.shared_as = Some(fd_type);
        // SAFETY: the image was created by this device.
        let requirements = unsafe { gpu.device.get_image_memory_requirements(raw) };
        let memory = sharing.memory(gpu, name, requirements, DedicatedTo::Image(raw))?;
        image.bind_to(Memory::Managed(memory), name)?;
        gpu.name(raw, name);
        Ok(image)
    }

    /// True if the image was created with `VK_SHARING_MODE_CONCURRENT`.
    #[cfg(unix)]
    pub(crate) fn is_concurrent(&self) -> bool {
        !self.is_external && self.gpu.queues.families().len() > 1 && self.usage == TextureUsage::SAMPLED
    }

    /// Returns the memory and the type of its file descriptors, if the memory is shared.
    #[cfg(unix)]
    pub(crate) fn shared_memory(&self) -> Option<(&ObjectMemory, MemoryFdType)> {
        match (&self.memory, self.shared_as) {
            (Some(Memory::Managed(memory)), Some(fd_type)) => Some((memory, fd_type)),
            _ => None,
        }
    }

    /// Wraps an image that was created outside of the library, for one texture. The image must match the description.
    pub(crate) fn import(gpu: &Arc<Gpu>, desc: &TextureDesc<'_>, raw: vk::Image) -> Result<Self> {
        Ok(Self::from_raw(gpu, desc, &check_image(gpu, desc)?, raw, true))
    }

    fn from_raw(
        gpu: &Arc<Gpu>,
        desc: &TextureDesc<'_>,
        plan: &ImagePlan,
        raw: vk::Image,
        is_external: bool,
    ) -> Self {
        Self {
            raw,
            id: ResourceId::next(),
            format: desc.format,
            extent: desc.extent,
            depth: desc.kind.depth(),
            volume: desc.kind.is_3d(),
            shape: TextureShape { mips: plan.mips, layers: desc.kind.layers() },
            usage: desc.usage,
            samples: desc.samples,
            view_formats: desc.view_formats.to_vec(),
            cube_compatible: plan.flags.contains(vk::ImageCreateFlags::CUBE_COMPATIBLE),
            handles: AtomicU32::new(1),
            transient: desc.memory == TextureMemory::Transient,
            transient_place: None,
            memory: None,
            is_exclusive: !is_external && gpu.queues.has_several_domains() && !is_shared(desc),
            host_filled: false,
            is_external,
            #[cfg(unix)]
            shared_as: None,
            owner: None,
            gpu: Arc::clone(gpu),
        }
    }

    /// Adds an owner that is kept alive as long as the image is used.
    #[cfg(feature = "window")]
    pub(crate) fn with_external_owner(mut self, owner: Arc<dyn Any + Send + Sync>) -> Self {
        self.owner = Some(owner);
        self
    }

    /// True if the image has an external owner, which decides when the image can be used and when it is destroyed.
    pub(crate) fn has_external_owner(&self) -> bool {
        self.owner.is_some()
    }

    /// Binds memory that no other image uses.
    fn bind_memory(&mut self, name: &str) -> Result<()> {
        let requirements = self.memory_requirements();
        if self.transient && self.bind_lazy(name, requirements)? {
            return Ok(());
        }
        let memory = self.gpu.allocate(name, requirements, MemoryKind::Device, false)?;
        self.bind_to(Memory::Managed(memory), name)
    }

    /// Binds lazily allocated memory. Returns false if the device has none for the image.
    pub(super) fn bind_lazy(&mut self, name: &str, requirements: vk::MemoryRequirements) -> Result<bool> {
        let Some(raw) = self.gpu.allocate_lazy(name, requirements)? else { return Ok(false) };
        self.bind_to(Memory::Lazy(raw), name)?;
        Ok(true)
    }

    /// Binds a part of a block, from `offset` on. The block has the memory types and the size that the image requires.
    pub(super) fn bind_shared(&mut self, block: &Arc<SharedBlock>, offset: u64, name: &str) -> Result<()> {
        self.bind_to(Memory::Shared(Arc::clone(block), offset), name)
    }

    pub(super) fn memory_requirements(&self) -> vk::MemoryRequirements {
        // SAFETY: the image was created by this device.
        unsafe { self.gpu.device.get_image_memory_requirements(self.raw) }
    }

    /// Binds memory that was allocated for the image's requirements.
    fn bind_to(&mut self, memory: Memory, name: &str) -> Result<()> {
        let (raw, offset) = match &memory {
            Memory::Managed(memory) => (memory.raw, memory.offset),
            Memory::Lazy(memory) => (*memory, 0),
            Memory::Shared(block, offset) => block.place(*offset),
        };
        self.memory = Some(memory);
        // SAFETY: the memory was allocated for this image's requirements and is bound once.
        let bound = unsafe { self.gpu.device.bind_image_memory(self.raw, raw, offset) };
        bound.map_err(Error::vulkan("vkBindImageMemory", name))
    }

    /// True if several textures show the image.
    pub(crate) fn has_views(&self) -> bool {
        self.handles.load(Ordering::Relaxed) > 1
    }

    /// Adds a texture of the image. Fails if the last texture is already destroyed.
    pub(crate) fn add_texture(&self) -> Result<()> {
        let more = |count: u32| (count > 0).then_some(count + 1);
        match self.handles.fetch_update(Ordering::AcqRel, Ordering::Acquire, more) {
            Ok(_) => Ok(()),
            Err(_) => Err(Error::StaleHandle { kind: TextureHandle::KIND, name: None }),
        }
    }

    /// Removes a texture of the image. Returns true if it was the last.
    pub(crate) fn remove_texture(&self) -> bool {
        self.handles.fetch_sub(1, Ordering::AcqRel) == 1
    }

    /// Returns the usages of the image that a view in `format` can have.
    pub(crate) fn usage_in(&self, format: Format) -> TextureUsage {
        if self.view_formats.is_empty() {
            return self.usage;
        }
        self.usage & usage_from_features(self.gpu.format_features(format))
    }

    /// Returns width, height and slices of a mip.
    pub(crate) fn mip_extent(&self, mip: u32) -> [u32; 3] {
        let [width, height] = self.extent;
        [width, height, self.depth].map(|side| (side >> mip.min(31)).max(1))
    }

    /// True if views may have this format.
    pub(crate) fn has_format(&self, format: Format) -> bool {
        format == self.format || self.view_formats.contains(&format)
    }

    /// Returns the properties of the image that barriers need.
    pub(crate) fn barrier_image(&self) -> BarrierImage {
        BarrierImage {
            raw: self.raw,
            is_exclusive: self.is_exclusive,
            aspects: self.format.aspects(),
            volume: self.volume,
        }
    }

    pub(crate) fn gpu(&self) -> &Arc<Gpu> {
        &self.gpu
    }
}

impl Drop for Image {
    fn drop(&mut self) {
        if self.is_external {
            return;
        }
        // SAFETY: the owners have waited until the GPU is done with the image, and its views are destroyed.
        unsafe { self.gpu.device.destroy_image(self.raw, None) };
        match self.memory.take() {
            Some(Memory::Managed(memory)) => self.gpu.free(memory),
            // SAFETY: the image that was bound to the memory is destroyed.
            Some(Memory::Lazy(memory)) => unsafe { self.gpu.device.free_memory(memory, None) },
            Some(Memory::Shared(block, _)) => drop(block),
            None => {}
        }
    }
}

/// Creates an image in opaque shared memory.
#[cfg(unix)]
fn create_opaque(
    gpu: &Gpu,
    desc: &TextureDesc<'_>,
    plan: &ImagePlan,
    sharing: &Sharing,
) -> Result<vk::Image> {
    let formats: Vec<_> = [desc.format].iter().chain(desc.view_formats).map(|f| f.raw()).collect();
    let mut list = vk::ImageFormatListCreateInfo::default().view_formats(&formats);
    let mut info = plan.info(desc);
    let object = format!("texture '{}' with shared memory", desc.debug_name);
    sharing.check(&object, external_features(gpu, &info, sharing.fd_type(), None, desc.debug_name)?)?;
    if !desc.view_formats.is_empty() {
        info = info.push_next(&mut list);
    }
    create_shared(gpu, desc, info, sharing)
}

/// Creates an image in a dma-buf, with the layout of its exporter or with one that the driver chooses.
#[cfg(unix)]
fn create_in_dma_buf(
    gpu: &Gpu,
    desc: &TextureDesc<'_>,
    plan: &ImagePlan,
    sharing: &Sharing,
) -> Result<vk::Image> {
    let object = format!("texture '{}' in a dma-buf", desc.debug_name);
    gpu.require(OptionalFeature::DrmFormatModifier, &object)?;
    let info = plan.info(desc);
    let modifiers = shareable_modifiers(gpu, &info, sharing, desc.debug_name)?;
    if modifiers.is_empty() {
        let why = "the driver shares no such image; choose another format, usage or DRM layout";
        return Err(Error::unsupported(object, why));
    }
    let info = info.tiling(vk::ImageTiling::DRM_FORMAT_MODIFIER_EXT);
    let planes = match sharing {
        Sharing::Import(MemoryFd { drm_layout: Some(layout), .. }) => plane_layouts(layout),
        _ => Vec::new(),
    };
    if planes.is_empty() {
        let mut list =
            vk::ImageDrmFormatModifierListCreateInfoEXT::default().drm_format_modifiers(&modifiers);
        return create_shared(gpu, desc, info.push_next(&mut list), sharing);
    }
    let mut explicit = vk::ImageDrmFormatModifierExplicitCreateInfoEXT::default()
        .drm_format_modifier(modifiers[0])
        .plane_layouts(&planes);
    create_shared(gpu, desc, info.push_next(&mut explicit), sharing)
}

#[cfg(unix)]
fn create_shared(
    gpu: &Gpu,
    desc: &TextureDesc<'_>,
    info: vk::ImageCreateInfo<'_>,
    sharing: &Sharing,
) -> Result<vk::Image> {
    let mut external = vk::ExternalMemoryImageCreateInfo::default().handle_types(sharing.fd_type().raw());
    let mut info = info.push_next(&mut external);
    let families = gpu.queues.families();
    if families.len() > 1 && is_shared(desc) {
        info = info.sharing_mode(vk::SharingMode::CONCURRENT).queue_family_indices(families);
    }
    // SAFETY: the description is checked against the limits of its format, and the driver shares such images.
    unsafe { gpu.device.create_image(&info, None) }.map_err(Error::vulkan("vkCreateImage", desc.debug_name))
}

/// True if all queues may use the image without an ownership transfer. An image that is only copied and sampled loses
/// no performance by concurrent sharing.
fn is_shared(desc: &TextureDesc<'_>) -> bool {
    desc.usage == TextureUsage::SAMPLED
}

/// Returns Vulkan's description of a part of an image.
pub(crate) fn raw_range(aspect_mask: vk::ImageAspectFlags, part: Subresources) -> vk::ImageSubresourceRange {
    vk::ImageSubresourceRange {
        aspect_mask,
        base_mip_level: part.base_mip,
        level_count: part.mip_count,
        base_array_layer: part.base_layer,
        layer_count: part.layer_count,
    }
}
