//! Buffers. Every buffer has a device address, and shaders access buffers only by address.

use std::ptr::NonNull;
use std::sync::Arc;

use ash::vk;
use bitflags::bitflags;

use crate::barrier::ResourceId;
use crate::error::{Error, Result, check_limit};
use crate::gpu::Gpu;
use crate::gpu::memory::allocator::{Mapping, MemoryKind, ObjectMemory};
#[cfg(unix)]
use crate::gpu::memory::external::{DedicatedTo, MemoryFdType};
use crate::lock_order::{Mutex, Rank};
#[cfg(unix)]
use crate::resource::sharing::Sharing;

bitflags! {
    /// Allowed uses of a buffer (`VkBufferUsageFlags`). Copies, and reads and writes of shaders by address, are always
    /// allowed and need no flag.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
    pub struct BufferUsage: u32 {
        /// Bound as a storage buffer (`VK_BUFFER_USAGE_STORAGE_BUFFER_BIT`), which access by address does not need:
        /// for [`DeviceInstances`](crate::DeviceInstances), and for descriptors of the application's own Vulkan calls.
        const STORAGE = 1;
        /// Holds indices of indexed draws.
        const INDEX = 1 << 1;
        /// Holds vertex attributes.
        const VERTEX = 1 << 2;
        /// Holds arguments of indirect draws and dispatches.
        const INDIRECT = 1 << 3;
        /// Holds vertices, indices or AABBs from which an acceleration structure is built.
        const ACCEL_INPUT = 1 << 4;
    }
}

/// Describes a buffer.
#[derive(Debug, Clone, Copy)]
pub struct BufferDesc<'a> {
    /// Size in bytes, at least 1. 0 with `data` is the size of the data. Default: 0.
    pub size_bytes: u64,
    /// Allowed uses of the buffer. Default: [`BufferUsage::STORAGE`].
    pub usage: BufferUsage,
    /// Memory type of the buffer. Default: [`MemoryKind::Device`].
    pub memory: MemoryKind,
    /// Initial contents, at most `size_bytes`. Default: none.
    pub data: Option<&'a [u8]>,
    /// Name in error messages, validation messages and debuggers. Default: `"buffer"`.
    pub debug_name: &'a str,
}

impl Default for BufferDesc<'_> {
    fn default() -> Self {
        Self {
            size_bytes: 0,
            usage: BufferUsage::STORAGE,
            memory: MemoryKind::Device,
            data: None,
            debug_name: "buffer",
        }
    }
}

/// A buffer and its memory, destroyed on drop.
pub(crate) struct Buffer {
    pub(crate) raw: vk::Buffer,
    pub(crate) id: ResourceId,
    pub(crate) size_bytes: u64,
    pub(crate) address: u64,
    pub(crate) usage: BufferUsage,
    pub(crate) memory: MemoryKind,
    pub(crate) name: String,
    allocation: Option<ObjectMemory>,
    /// True if the buffer was created outside of the library, which then does not destroy it.
    is_external: bool,
    /// Type of the file descriptors that share the memory, if it is shared.
    #[cfg(unix)]
    shared_as: Option<MemoryFdType>,
    /// Held while the host copies to or from the mapping, so that threads do not race for the same bytes.
    copying: Mutex<()>,
    gpu: Arc<Gpu>,
}

/// Buffer usage that only the library itself needs.
#[derive(Clone, Copy, Default)]
pub(crate) struct InternalUsage {
    pub(crate) raw: vk::BufferUsageFlags,
    /// Alignment of the address, in bytes.
    pub(crate) alignment: u64,
}

impl InternalUsage {
    pub(crate) const NONE: Self = Self { raw: vk::BufferUsageFlags::empty(), alignment: 1 };
    /// Usage of acceleration structures for software traversal. Their nodes should not cross cache lines.
    pub(crate) const SOFTWARE_STRUCTURES: Self = Self { alignment: 256, ..Self::NONE };
    pub(crate) const ACCEL_STORAGE: Self =
        Self { raw: vk::BufferUsageFlags::ACCELERATION_STRUCTURE_STORAGE_KHR, alignment: 256 };
    /// Usage of the maps and records of an opacity micromap.
    pub(crate) const MICROMAP_INPUT: Self =
        Self { raw: vk::BufferUsageFlags::MICROMAP_BUILD_INPUT_READ_ONLY_EXT, alignment: 256 };
    pub(crate) const MICROMAP_STORAGE: Self =
        Self { raw: vk::BufferUsageFlags::MICROMAP_STORAGE_EXT, alignment: 256 };
    pub(crate) const SHADER_BINDING_TABLE: Self =
        Self { raw: vk::BufferUsageFlags::SHADER_BINDING_TABLE_KHR, alignment: 1 };
}

impl Buffer {
    /// Minimum alignment of buffers, which drivers may not require. Matrices and instances of builds, and the largest
    /// texels, need it.
    pub(crate) const ALIGNMENT: u64 = 16;
    /// Memory after each buffer under GPU-assisted validation, which does not report an access that ends in another
    /// buffer.
    const GAP_BYTES: u64 = 4096;

    pub(crate) fn new(gpu: &Arc<Gpu>, desc: &BufferDesc<'_>, internal: InternalUsage) -> Result<Self> {
        let mut buffer = Self::without_memory(gpu, desc, internal.raw, None)?;
        let mut requirements = buffer.memory_requirements();
        requirements.alignment = requirements.alignment.max(Self::ALIGNMENT).max(internal.alignment);
        if gpu.instance.gpu_assisted {
            requirements.size += Self::GAP_BYTES;
        }
        buffer.bind_memory(gpu.allocate(&buffer.name, requirements, desc.memory, true)?)?;
        gpu.name(buffer.raw, desc.debug_name);
        Ok(buffer)
    }

    /// Creates a buffer whose memory is shared by a file descriptor.
    #[cfg(unix)]
    pub(crate) fn with_shared_memory(
        gpu: &Arc<Gpu>,
        desc: &BufferDesc<'_>,
        sharing: Sharing,
    ) -> Result<Self> {
        let name = desc.debug_name;
        let fd_type = sharing.fd_type();
        gpu.require_memory_fd(fd_type, &format!("buffer '{name}' with shared memory"))?;
        if desc.memory != MemoryKind::Device {
            return Err(Error::usage(name, "shared memory is MemoryKind::Device; copy to and from it"));
        }
        check_shareable(gpu, desc, &sharing)?;
        let mut external = vk::ExternalMemoryBufferCreateInfo::default().handle_types(fd_type.raw());
        let mut buffer = Self::without_memory(gpu, desc, vk::BufferUsageFlags::empty(), Some(&mut external))?;
        let (requirements, owner) = (buffer.memory_requirements(), DedicatedTo::Buffer(buffer.raw));
        buffer.bind_memory(sharing.memory(gpu, name, requirements, owner)?)?;
        buffer.shared_as = Some(fd_type);
        gpu.name(buffer.raw, name);
        Ok(buffer)
    }

    /// Creates a buffer without memory.
    fn without_memory(
        gpu: &Arc<Gpu>,
        desc: &BufferDesc<'_>,
        internal: vk::BufferUsageFlags,
        external: Option<&mut vk::ExternalMemoryBufferCreateInfo<'_>>,
    ) -> Result<Self> {
        let name = desc.debug_name;
        let size = check_size(gpu, desc)?;
        let usage = raw_usage(gpu, desc.usage, name)? | internal;
        // Kernels read 16-bit indices as whole 32-bit words.
        let mut info = vk::BufferCreateInfo::default().size(size.next_multiple_of(4)).usage(usage);
        let families = gpu.queues.families();
        if families.len() > 1 {
            info = info.sharing_mode(vk::SharingMode::CONCURRENT).queue_family_indices(families);
        }
        if let Some(external) = external {
            info = info.push_next(external);
        }
        // SAFETY: the description is valid: the size is checked, the usage belongs to enabled features.
        let raw = unsafe { gpu.device.create_buffer(&info, None) }
            .map_err(Error::vulkan("vkCreateBuffer", name))?;
        Ok(Self {
            raw,
            id: ResourceId::next(),
            size_bytes: size,
            address: 0,
            usage: desc.usage,
            memory: desc.memory,
            name: name.to_owned(),
            allocation: None,
            is_external: false,
            #[cfg(unix)]
            shared_as: None,
            copying: Mutex::new(Rank::BufferBytes, ()),
            gpu: Arc::clone(gpu),
        })
    }

    fn memory_requirements(&self) -> vk::MemoryRequirements {
        // SAFETY: the buffer was created by this device.
        unsafe { self.gpu.device.get_buffer_memory_requirements(self.raw) }
    }

    /// Wraps a buffer that was created outside of the library.
    ///
    /// # Safety
    /// The buffer matches the parameters, has memory and a device address, and outlives every object that uses it.
    pub(crate) unsafe fn import(
        gpu: &Arc<Gpu>,
        raw: vk::Buffer,
        size_bytes: u64,
        usage: BufferUsage,
        name: &str,
    ) -> Self {
        let info = vk::BufferDeviceAddressInfo::default().buffer(raw);
        // SAFETY: guaranteed by the caller.
        let address = unsafe { gpu.device.get_buffer_device_address(&info) };
        Self {
            raw,
            id: ResourceId::next(),
            size_bytes,
            address,
            usage,
            memory: MemoryKind::Device,
            name: name.to_owned(),
            allocation: None,
            is_external: true,
            #[cfg(unix)]
            shared_as: None,
            copying: Mutex::new(Rank::BufferBytes, ()),
            gpu: Arc::clone(gpu),
        }
    }

    /// Binds memory that was allocated for the buffer's requirements, and takes the address.
    fn bind_memory(&mut self, memory: ObjectMemory) -> Result<()> {
        let device = &self.gpu.device;
        // SAFETY: the memory was allocated for this buffer's requirements and is bound once.
        let bound = unsafe { device.bind_buffer_memory(self.raw, memory.raw, memory.offset) };
        self.allocation = Some(memory);
        bound.map_err(Error::vulkan("vkBindBufferMemory", &self.name))?;
        let info = vk::BufferDeviceAddressInfo::default().buffer(self.raw);
        // SAFETY: the buffer has memory and the device-address usage.
        self.address = unsafe { device.get_buffer_device_address(&info) };
        Ok(())
    }

    /// Returns the memory and the type of its file descriptors, if the memory is shared.
    #[cfg(unix)]
    pub(crate) fn shared_memory(&self) -> Option<(&ObjectMemory, MemoryFdType)> {
        self.allocation.as_ref().zip(self.shared_as)
    }

    /// Fails unless `offset..offset + size` lies inside the buffer.
    pub(crate) fn check_range(&self, offset: u64, size: u64) -> Result<()> {
        if offset.checked_add(size).is_some_and(|end| end <= self.size_bytes) {
            return Ok(());
        }
        let message =
            format!("{size} bytes at byte {offset} are outside of the buffer's {} bytes", self.size_bytes);
        Err(Error::usage(&self.name, message))
    }

    /// Fails unless the buffer was created with `usage`.
    pub(crate) fn check_usage(&self, usage: BufferUsage) -> Result<()> {
        if self.usage.contains(usage) {
            return Ok(());
        }
        Err(Error::usage(&self.name, format!("create the buffer with {usage:?} in its usage")))
    }

    /// Returns the start of the mapped memory; `None` for device memory.
    pub(crate) fn mapped(&self) -> Option<NonNull<u8>> {
        self.mapping().map(|mapping| mapping.0)
    }

    /// Returns the mapping, which the caller must keep together with the buffer.
    pub(crate) fn mapping(&self) -> Option<Mapping> {
        if !self.memory.mapped() {
            return None;
        }
        self.allocation.as_ref()?.mapping()
    }

    /// Writes the initial contents of a buffer that no command has used yet, if its memory is visible to the host. Some
    /// devices have host-visible device memory. Returns `false` if the memory is not visible. The bytes must fit the
    /// buffer.
    pub(crate) fn write_initial(&self, bytes: &[u8]) -> bool {
        let coherent = vk::MemoryPropertyFlags::HOST_VISIBLE | vk::MemoryPropertyFlags::HOST_COHERENT;
        let reached = self.allocation.as_ref().filter(|own| own.properties.contains(coherent));
        let start = reached.and_then(ObjectMemory::mapped).filter(|_| self.contains(0, bytes.len()));
        let Some(start) = start else { return false };
        // SAFETY: the mapping has the buffer's size and lives as long as `self`, which no other thread uses yet.
        unsafe { start.as_ptr().copy_from_nonoverlapping(bytes.as_ptr(), bytes.len()) };
        true
    }

    /// Calls `fill` with all of the mapped memory. Returns `false` if the buffer is not mapped.
    pub(crate) fn fill_with(&self, fill: impl FnOnce(&mut [u8])) -> bool {
        let Some(start) = self.mapped() else { return false };
        let _copying = self.copying.lock();
        // SAFETY: the mapping has the buffer's size and lives as long as `self`; other threads wait.
        fill(unsafe { std::slice::from_raw_parts_mut(start.as_ptr(), self.size_bytes as usize) });
        true
    }

    /// True if `size` bytes from `offset` on lie inside the buffer. Callers have told the user of any other range, so this
    /// only keeps a mistake of theirs from memory behind the mapping.
    fn contains(&self, offset: u64, size: usize) -> bool {
        let is_inside = offset.checked_add(size as u64).is_some_and(|end| end <= self.size_bytes);
        debug_assert!(is_inside, "{size} bytes at {offset} are outside of '{}'", self.name);
        is_inside
    }

    /// Writes mapped memory. Returns `false` if the buffer is not mapped. The range must have been checked.
    pub(crate) fn write(&self, offset: u64, bytes: &[u8]) -> bool {
        let Some(start) = self.mapped().filter(|_| self.contains(offset, bytes.len())) else { return false };
        let _copying = self.copying.lock();
        // SAFETY: the range lies inside the mapping, which lives as long as `self`; other threads wait.
        unsafe {
            start.as_ptr().add(offset as usize).copy_from_nonoverlapping(bytes.as_ptr(), bytes.len());
        }
        true
    }

    /// Reads mapped memory. Returns `false` if the buffer is not mapped. The range must have been checked.
    pub(crate) fn read(&self, offset: u64, bytes: &mut [u8]) -> bool {
        let Some(start) = self.mapped().filter(|_| self.contains(offset, bytes.len())) else { return false };
        let _copying = self.copying.lock();
        // SAFETY: the range lies inside the mapping, which lives as long as `self`; other threads wait.
        unsafe {
            start.as_ptr().add(offset as usize).copy_to_nonoverlapping(bytes.as_mut_ptr(), bytes.len());
        }
        true
    }
}

/// Returns bytes on the host for data of `object`, whose size the application chooses: a lack of memory is an error, and does not end the
/// process.
pub(crate) fn zeroed_bytes(call: &'static str, object: &str, size: u64) -> Result<Vec<u8>> {
    let lacking = || Error::OutOfHostMemory { call, object: object.to_owned() };
    let size = usize::try_from(size).map_err(|_| lacking())?;
    check_host_memory(call, object, size)?;
    // Zeros cost nothing here, which a list that grows would write.
    Ok(vec![0; size])
}

/// Fails unless the host has memory for so many bytes of `object`: an allocation that fails right behind would end the process.
pub(crate) fn check_host_memory(call: &'static str, object: &str, size: usize) -> Result<()> {
    let reserved = Vec::<u8>::new().try_reserve_exact(size);
    reserved.map_err(|_| Error::OutOfHostMemory { call, object: object.to_owned() })
}

impl Drop for Buffer {
    fn drop(&mut self) {
        if self.is_external {
            return;
        }
        // SAFETY: the owner has waited until the GPU is done with the buffer.
        unsafe { self.gpu.device.destroy_buffer(self.raw, None) };
        if let Some(allocation) = self.allocation.take() {
            self.gpu.free(allocation);
        }
    }
}

fn check_size(gpu: &Gpu, desc: &BufferDesc<'_>) -> Result<u64> {
    let data_bytes = desc.data.map_or(0, |data| data.len() as u64);
    let size = if desc.size_bytes == 0 { data_bytes } else { desc.size_bytes };
    if size == 0 {
        return Err(Error::usage(desc.debug_name, "a buffer needs a size of at least one byte"));
    }
    if data_bytes > size {
        let message = format!("{data_bytes} bytes of data do not fit the buffer's {size} bytes");
        return Err(Error::usage(desc.debug_name, message));
    }
    check_limit(desc.debug_name, "buffer size in bytes", size, gpu.caps.limits.max_buffer_bytes)?;
    Ok(size)
}

fn raw_usage(gpu: &Gpu, usage: BufferUsage, name: &str) -> Result<vk::BufferUsageFlags> {
    if usage.contains(BufferUsage::ACCEL_INPUT) && !gpu.has_acceleration_structures() {
        return Err(
            gpu.unsupported(&format!("acceleration structures, which buffer '{name}' is for (ACCEL_INPUT)"))
        );
    }
    // The library's own builders read inputs like any other shader.
    let accel_input = match gpu.accel {
        Some(_) => vk::BufferUsageFlags::ACCELERATION_STRUCTURE_BUILD_INPUT_READ_ONLY_KHR,
        None => vk::BufferUsageFlags::STORAGE_BUFFER,
    };
    let pairs = [
        (BufferUsage::STORAGE, vk::BufferUsageFlags::STORAGE_BUFFER),
        (BufferUsage::INDEX, vk::BufferUsageFlags::INDEX_BUFFER),
        (BufferUsage::VERTEX, vk::BufferUsageFlags::VERTEX_BUFFER),
        (BufferUsage::INDIRECT, vk::BufferUsageFlags::INDIRECT_BUFFER),
        (BufferUsage::ACCEL_INPUT, accel_input),
    ];
    let always = vk::BufferUsageFlags::TRANSFER_SRC
        | vk::BufferUsageFlags::TRANSFER_DST
        | vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS;
    Ok(pairs.iter().filter(|(bit, _)| usage.contains(*bit)).fold(always, |all, (_, raw)| all | *raw))
}

/// Fails unless the driver shares the memory of such buffers.
#[cfg(unix)]
fn check_shareable(gpu: &Gpu, desc: &BufferDesc<'_>, sharing: &Sharing) -> Result<()> {
    let usage = raw_usage(gpu, desc.usage, desc.debug_name)?;
    let info =
        vk::PhysicalDeviceExternalBufferInfo::default().usage(usage).handle_type(sharing.fd_type().raw());
    let mut found = vk::ExternalBufferProperties::default();
    // SAFETY: the physical device belongs to the instance, and the handle type to an enabled extension.
    unsafe {
        let instance = &gpu.instance.raw;
        instance.get_physical_device_external_buffer_properties(gpu.physical(), &info, &mut found);
    }
    let found = found.external_memory_properties.external_memory_features;
    sharing.check(&format!("buffer '{}' with shared memory", desc.debug_name), found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_that_the_host_has_no_memory_for_are_an_error() {
        let told = zeroed_bytes("Readback::wait", "water", 1 << 62).unwrap_err().to_string();
        assert_eq!(told, "out of host memory in Readback::wait for 'water'");
        assert_eq!(zeroed_bytes("Readback::wait", "water", 3).unwrap(), [0; 3]);
    }
}
