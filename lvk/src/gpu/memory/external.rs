//! Memory that other devices, processes and APIs share by file descriptors: its allocation, export and import.

use std::os::fd::{AsRawFd, FromRawFd, IntoRawFd, OwnedFd, RawFd};

use ash::vk;

use super::allocator::{ObjectMemory, types_of_size};
use crate::error::{Error, Result, check_limit};
use crate::gpu::Gpu;
use crate::gpu::caps::optional_features::OptionalFeature;

/// Type of the file descriptor that shares memory (`VkExternalMemoryHandleTypeFlagBits`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum MemoryFdType {
    /// Memory that only the same driver on the same device imports (`VK_EXTERNAL_MEMORY_HANDLE_TYPE_OPAQUE_FD_BIT`):
    /// other contexts, OpenGL, CUDA. Needs [`OptionalFeature::ExternalMemoryFd`].
    Opaque,
    /// A Linux dma-buf, which other drivers import too (`VK_EXTERNAL_MEMORY_HANDLE_TYPE_DMA_BUF_BIT_EXT`): displays,
    /// video codecs, cameras. Needs [`OptionalFeature::ExternalMemoryDmaBuf`], and for textures
    /// [`OptionalFeature::DrmFormatModifier`].
    DmaBuf,
}

impl MemoryFdType {
    pub(crate) fn raw(self) -> vk::ExternalMemoryHandleTypeFlags {
        match self {
            Self::Opaque => vk::ExternalMemoryHandleTypeFlags::OPAQUE_FD,
            Self::DmaBuf => vk::ExternalMemoryHandleTypeFlags::DMA_BUF_EXT,
        }
    }

    pub(crate) fn feature(self) -> OptionalFeature {
        match self {
            Self::Opaque => OptionalFeature::ExternalMemoryFd,
            Self::DmaBuf => OptionalFeature::ExternalMemoryDmaBuf,
        }
    }
}

/// Memory of a buffer or a texture as a file descriptor, with the values that its importer needs.
///
/// The memory is dedicated to the object (`VkMemoryDedicatedAllocateInfo`), which starts at offset 0. Other APIs must be
/// told both.
#[derive(Debug)]
pub struct MemoryFd {
    /// The file descriptor. An import takes it.
    pub fd: OwnedFd,
    /// Type of the file descriptor.
    pub fd_type: MemoryFdType,
    /// Size of the memory in bytes (`VkMemoryAllocateInfo::allocationSize`), at least that of the object.
    pub allocation_bytes: u64,
    /// Memory type of [`Opaque`](MemoryFdType::Opaque) memory (`VkMemoryAllocateInfo::memoryTypeIndex`). Ignored for
    /// dma-bufs.
    pub memory_type_index: u32,
    /// Layout of a texture in a dma-buf; `None` for buffers and opaque memory.
    pub drm_layout: Option<DrmLayout>,
}

/// Layout of a texture in a dma-buf.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DrmLayout {
    /// The DRM format modifier, such as `DRM_FORMAT_MOD_LINEAR` (0).
    pub modifier: u64,
    /// The memory planes of the modifier, 1 to 4.
    pub planes: Vec<DrmPlane>,
}

/// One memory plane of a texture in a dma-buf.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DrmPlane {
    /// Start of the plane in the memory, in bytes.
    pub offset_bytes: u64,
    /// Distance of two rows, in bytes.
    pub row_pitch_bytes: u64,
}

/// The object that memory is dedicated to.
#[derive(Debug, Clone, Copy)]
pub(crate) enum DedicatedTo {
    Buffer(vk::Buffer),
    Image(vk::Image),
}

impl DedicatedTo {
    fn info(self) -> vk::MemoryDedicatedAllocateInfo<'static> {
        match self {
            Self::Buffer(buffer) => vk::MemoryDedicatedAllocateInfo::default().buffer(buffer),
            Self::Image(image) => vk::MemoryDedicatedAllocateInfo::default().image(image),
        }
    }

    /// Returns the flags of the memory: buffers have device addresses.
    fn flags(self) -> vk::MemoryAllocateFlags {
        match self {
            Self::Buffer(_) => vk::MemoryAllocateFlags::DEVICE_ADDRESS,
            Self::Image(_) => vk::MemoryAllocateFlags::empty(),
        }
    }
}

/// Fails unless the driver can share memory of a kind of object in the given direction. `object` begins the message.
pub(crate) fn check_shareable(
    object: &str,
    fd_type: MemoryFdType,
    found: vk::ExternalMemoryFeatureFlags,
    direction: vk::ExternalMemoryFeatureFlags,
) -> Result<()> {
    if found.contains(direction) {
        return Ok(());
    }
    let verb = if direction == vk::ExternalMemoryFeatureFlags::IMPORTABLE { "import" } else { "export" };
    let why =
        format!("the driver does not {verb} its memory as {fd_type:?}; take another MemoryFdType or usage");
    Err(Error::unsupported(object, why))
}

/// Returns the memory type for new shared memory: a device-local one among `bits`, else the first one among `bits`.
fn shared_type(types: &[vk::MemoryType], bits: u32) -> Option<u32> {
    let allowed = || (0..).zip(types).filter(|(index, _)| bits >> index & 1 == 1);
    let local = |kind: &vk::MemoryType| kind.property_flags.contains(vk::MemoryPropertyFlags::DEVICE_LOCAL);
    let protected = |kind: &vk::MemoryType| kind.property_flags.contains(vk::MemoryPropertyFlags::PROTECTED);
    let unprotected = || allowed().filter(|(_, kind)| !protected(kind));
    unprotected().find(|(_, kind)| local(kind)).or_else(|| unprotected().next()).map(|(index, _)| index)
}

/// Returns those of the memory types in `bits` whose heaps have at least `bytes` bytes; all of `bits` if none has, which an allocation then
/// reports as a shortage.
fn large_enough(bits: u32, properties: &vk::PhysicalDeviceMemoryProperties, bytes: u64) -> u32 {
    let large = bits & types_of_size(properties, bytes);
    if large == 0 { bits } else { large }
}

impl Gpu {
    /// Fails unless the device shares memory by this type of file descriptor. `what` is the refused operation.
    pub(crate) fn require_memory_fd(
        &self,
        fd_type: MemoryFdType,
        what: &str,
    ) -> Result<ash::khr::external_memory_fd::Device> {
        self.require(OptionalFeature::ExternalMemoryFd, what)?;
        self.require(fd_type.feature(), what)?;
        Ok(ash::khr::external_memory_fd::Device::new(&self.instance.raw, &self.device))
    }

    /// Allocates memory that can be exported, for one object.
    pub(crate) fn allocate_exportable(
        &self,
        name: &str,
        requirements: vk::MemoryRequirements,
        owner: DedicatedTo,
        fd_type: MemoryFdType,
    ) -> Result<ObjectMemory> {
        let properties = self.memory_properties();
        let bits = large_enough(requirements.memory_type_bits, &properties, requirements.size);
        let index = shared_type(properties.memory_types_as_slice(), bits)
            .ok_or_else(|| Error::unsupported(format!("memory for '{name}'"), "no memory type suits it"))?;
        let mut export = vk::ExportMemoryAllocateInfo::default().handle_types(fd_type.raw());
        let info = vk::MemoryAllocateInfo::default()
            .allocation_size(requirements.size)
            .memory_type_index(index)
            .push_next(&mut export);
        self.allocate_dedicated(name, info, owner, &properties)
    }

    /// Imports memory for one object. Takes the file descriptor if it succeeds, and closes it otherwise.
    pub(crate) fn import_memory(
        &self,
        name: &str,
        requirements: vk::MemoryRequirements,
        owner: DedicatedTo,
        memory: MemoryFd,
    ) -> Result<ObjectMemory> {
        let functions =
            self.require_memory_fd(memory.fd_type, &format!("the import of memory for '{name}'"))?;
        if memory.allocation_bytes < requirements.size {
            let (given, needed) = (memory.allocation_bytes, requirements.size);
            return Err(Error::usage(
                name,
                format!("the imported memory has {given} bytes, but {needed} are needed"),
            ));
        }
        let properties = self.memory_properties();
        let index = imported_type(&functions, name, requirements.memory_type_bits, &properties, &memory)?;
        let mut import =
            vk::ImportMemoryFdInfoKHR::default().handle_type(memory.fd_type.raw()).fd(memory.fd.as_raw_fd());
        let info = vk::MemoryAllocateInfo::default()
            .allocation_size(memory.allocation_bytes)
            .memory_type_index(index)
            .push_next(&mut import);
        let imported = self.allocate_dedicated(name, info, owner, &properties)?;
        // The driver owns the file descriptor now.
        let _ = memory.fd.into_raw_fd();
        Ok(imported)
    }

    fn allocate_dedicated(
        &self,
        name: &str,
        info: vk::MemoryAllocateInfo<'_>,
        owner: DedicatedTo,
        properties: &vk::PhysicalDeviceMemoryProperties,
    ) -> Result<ObjectMemory> {
        let (bytes, index) = (info.allocation_size, info.memory_type_index);
        check_limit(name, "memory of one object in bytes", bytes, self.caps.limits.max_allocation_bytes)?;
        if types_of_size(properties, bytes) >> index & 1 == 0 {
            return Err(Error::allocating(name, bytes)(vk::Result::ERROR_OUT_OF_DEVICE_MEMORY));
        }
        let (mut dedicated, mut flags) =
            (owner.info(), vk::MemoryAllocateFlagsInfo::default().flags(owner.flags()));
        let info = info.push_next(&mut dedicated).push_next(&mut flags);
        // SAFETY: the memory type is one of the device's that suit the object, and the chain is valid.
        let raw = unsafe { self.device.allocate_memory(&info, None) }.map_err(|result| match result {
            vk::Result::ERROR_INVALID_EXTERNAL_HANDLE => {
                Error::usage(name, "the file descriptor is no memory of its type that this device can import")
            }
            other => Error::allocating(name, bytes)(other),
        })?;
        let of_type = properties.memory_types[index as usize].property_flags;
        let memory = ObjectMemory::unmanaged(raw, bytes, index, of_type);
        self.heap_use.add(&memory);
        self.name(raw, name);
        Ok(memory)
    }

    /// Exports the memory of an object that was created for that (`vkGetMemoryFdKHR`).
    pub(crate) fn export_memory(
        &self,
        name: &str,
        memory: &ObjectMemory,
        fd_type: MemoryFdType,
    ) -> Result<OwnedFd> {
        let functions = self.require_memory_fd(fd_type, &format!("the export of the memory of '{name}'"))?;
        let info = vk::MemoryGetFdInfoKHR::default().memory(memory.raw).handle_type(fd_type.raw());
        // SAFETY: the memory was allocated for export as this type.
        let fd =
            unsafe { functions.get_memory_fd(&info) }.map_err(Error::vulkan("vkGetMemoryFdKHR", name))?;
        // SAFETY: Vulkan gives the caller a new file descriptor.
        let fd = unsafe { owned_fd(fd) };
        fd.ok_or_else(|| Error::vulkan("vkGetMemoryFdKHR", name)(vk::Result::ERROR_UNKNOWN))
    }
}

/// Returns a file descriptor that a driver gave; `None` for a negative number, which an [`OwnedFd`] must not hold.
///
/// # Safety
/// A number that is not negative is a new file descriptor, which nothing else closes.
pub(crate) unsafe fn owned_fd(fd: RawFd) -> Option<OwnedFd> {
    // SAFETY: the number is not negative; the caller promises the rest.
    (fd >= 0).then(|| unsafe { OwnedFd::from_raw_fd(fd) })
}

/// Returns the memory type to import with, or an error that names the object.
fn imported_type(
    functions: &ash::khr::external_memory_fd::Device,
    name: &str,
    object_bits: u32,
    properties: &vk::PhysicalDeviceMemoryProperties,
    memory: &MemoryFd,
) -> Result<u32> {
    let (index, bits) = match memory.fd_type {
        MemoryFdType::Opaque => (memory.memory_type_index, object_bits),
        MemoryFdType::DmaBuf => {
            let mut found = vk::MemoryFdPropertiesKHR::default();
            // SAFETY: the file descriptor is open, and the type is not the opaque one.
            unsafe {
                functions.get_memory_fd_properties(memory.fd_type.raw(), memory.fd.as_raw_fd(), &mut found)
            }
            .map_err(|result| refused_dma_buf(name, result))?;
            let bits =
                large_enough(object_bits & found.memory_type_bits, properties, memory.allocation_bytes);
            (bits.trailing_zeros(), bits)
        }
    };
    if bits.checked_shr(index).is_some_and(|bits| bits & 1 == 1) {
        return Ok(index);
    }
    let message = format!(
        "memory type {index} of the imported memory does not suit the object, whose types have the bits \
         {object_bits:#b}; describe the object as its exporter did"
    );
    Err(Error::usage(name, message))
}

/// Returns the error of a failed `vkGetMemoryFdPropertiesKHR` for the object `name`.
fn refused_dma_buf(name: &str, result: vk::Result) -> Error {
    match result {
        vk::Result::ERROR_INVALID_EXTERNAL_HANDLE => {
            Error::usage(name, "the file descriptor is no dma-buf that this device can import")
        }
        other => Error::vulkan("vkGetMemoryFdPropertiesKHR", name)(other),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kind(property_flags: vk::MemoryPropertyFlags) -> vk::MemoryType {
        vk::MemoryType { property_flags, heap_index: 0 }
    }

    #[test]
    fn shared_memory_is_device_local_where_possible_and_never_protected() {
        use vk::MemoryPropertyFlags as Flags;
        let types = [
            kind(Flags::HOST_VISIBLE),
            kind(Flags::DEVICE_LOCAL | Flags::PROTECTED),
            kind(Flags::DEVICE_LOCAL),
            kind(Flags::DEVICE_LOCAL | Flags::HOST_VISIBLE),
        ];
        assert_eq!(shared_type(&types, 0b1111), Some(2));
        assert_eq!(shared_type(&types, 0b1001), Some(3));
        assert_eq!(shared_type(&types, 0b0011), Some(0));
        assert_eq!(shared_type(&types, 0b0010), None);
        assert_eq!(shared_type(&[], u32::MAX), None);
    }

    #[test]
    fn a_negative_number_is_no_file_descriptor() {
        // SAFETY: neither number is a file descriptor.
        assert!(unsafe { owned_fd(-1) }.is_none() && unsafe { owned_fd(RawFd::MIN) }.is_none());
        let file = std::fs::File::open("/dev/null").unwrap();
        let number = OwnedFd::from(file).into_raw_fd();
        // SAFETY: the file is open, and nothing else owns it.
        assert_eq!(unsafe { owned_fd(number) }.unwrap().as_raw_fd(), number);
    }

    #[test]
    fn refused_directions_name_the_type() {
        let none = vk::ExternalMemoryFeatureFlags::empty();
        let (import, export) =
            (vk::ExternalMemoryFeatureFlags::IMPORTABLE, vk::ExternalMemoryFeatureFlags::EXPORTABLE);
        assert!(check_shareable("buffer 'a'", MemoryFdType::Opaque, import | export, export).is_ok());
        let text = |direction| {
            check_shareable("buffer 'a'", MemoryFdType::DmaBuf, none, direction)
                .map_err(|error| error.to_string())
        };
        assert!(
            text(import).is_err_and(
                |text| text.contains("buffer 'a'") && text.contains("import its memory as DmaBuf")
            )
        );
        assert!(text(export).is_err_and(|text| text.contains("export its memory as DmaBuf")));
    }
}
