//! Memory for the buffers and images of a device.

use ash::vk;
use gpu_allocator::AllocationError;

use super::device::Gpu;
#[cfg(any(test, feature = "test-hooks"))]
use super::memory::allocator::DeviceMemory;
use super::memory::allocator::{MemoryKind, ObjectMemory, types_of_size};
use crate::error::{Error, Result, check_limit};

impl Gpu {
    /// Allocates memory for a buffer (`linear`) or an image.
    pub(crate) fn allocate(
        &self,
        name: &str,
        requirements: vk::MemoryRequirements,
        kind: MemoryKind,
        linear: bool,
    ) -> Result<ObjectMemory> {
        let bytes = requirements.size;
        let limit = self.caps.limits.max_allocation_bytes;
        check_limit(name, "memory of one object in bytes", bytes, limit)?;
        let mut memory = self.memory();
        let memory =
            memory.as_mut().ok_or_else(|| allocation_error(name, bytes, AllocationError::OutOfMemory))?;
        let kept_name = if self.names_objects() { name } else { "" };
        let allocated = memory
            .allocate(kept_name, requirements, kind, linear)
            .map_err(|error| allocation_error(name, bytes, error))?;
        self.heap_use.add(&allocated);
        self.name_block(&allocated, name);
        Ok(allocated)
    }

    /// Names a memory block after the object at its start.
    fn name_block(&self, allocated: &ObjectMemory, name: &str) {
        if self.names_objects() && allocated.offset == 0 {
            self.name(allocated.raw, &format!("memory from '{name}' on"));
        }
    }

    /// Allocates lazily allocated memory, which exists only while a render pass needs it. `None` if the
    /// device has no such memory type, or none whose heap is large enough.
    pub(crate) fn allocate_lazy(
        &self,
        name: &str,
        requirements: vk::MemoryRequirements,
    ) -> Result<Option<vk::DeviceMemory>> {
        let properties = self.memory_properties();
        let bits = requirements.memory_type_bits & types_of_size(&properties, requirements.size);
        let Some(kind) = lazy_type(properties.memory_types_as_slice(), bits) else {
            return Ok(None);
        };
        let info =
            vk::MemoryAllocateInfo::default().allocation_size(requirements.size).memory_type_index(kind);
        // SAFETY: the memory type is one of the device's.
        unsafe { self.device.allocate_memory(&info, None) }
            .map(Some)
            .map_err(Error::allocating(name, requirements.size))
    }

    /// Returns the memory types and heaps of the device (`vkGetPhysicalDeviceMemoryProperties`).
    pub(super) fn memory_properties(&self) -> vk::PhysicalDeviceMemoryProperties {
        // SAFETY: the physical device belongs to the instance.
        unsafe { self.instance.raw.get_physical_device_memory_properties(self.physical()) }
    }

    /// Returns the number of live `VkDeviceMemory` objects of the allocator and their bytes.
    #[cfg(any(test, feature = "test-hooks"))]
    pub(crate) fn memory_blocks(&self) -> (usize, u64) {
        self.memory().as_ref().map_or((0, 0), DeviceMemory::blocks)
    }

    /// Frees memory.
    pub(crate) fn free(&self, memory: ObjectMemory) {
        self.heap_use.remove(&memory);
        if memory.is_unmanaged() {
            // SAFETY: the object that was bound to the memory is destroyed.
            return unsafe { self.device.free_memory(memory.raw, None) };
        }
        let freed = self.memory().as_mut().map_or(Ok(()), |all| all.free(memory));
        if let Err(error) = freed {
            log::error!("freeing device memory failed: {error}");
        }
    }
}

/// Returns the first lazily allocated memory type among those in `bits`.
fn lazy_type(types: &[vk::MemoryType], bits: u32) -> Option<u32> {
    let lazy = vk::MemoryPropertyFlags::LAZILY_ALLOCATED;
    let suits =
        |(index, kind): &(u32, &vk::MemoryType)| bits >> index & 1 == 1 && kind.property_flags.contains(lazy);
    (0..).zip(types).find(suits).map(|(index, _)| index)
}

/// Returns the error of an allocation of `bytes` bytes for `name`. The allocator's texts hold the driver's errors.
fn allocation_error(name: &str, bytes: u64, error: AllocationError) -> Error {
    use vk::Result as Code;
    match error {
        AllocationError::OutOfMemory => Error::allocating(name, bytes)(Code::ERROR_OUT_OF_DEVICE_MEMORY),
        // A driver that answers success without an address lacks address space.
        AllocationError::FailedToMap(text) => {
            let codes = [Code::ERROR_OUT_OF_DEVICE_MEMORY, Code::ERROR_MEMORY_MAP_FAILED];
            let code = codes.into_iter().find(|code| code.to_string() == text);
            Error::vulkan("vkMapMemory", name)(code.unwrap_or(Code::ERROR_OUT_OF_HOST_MEMORY))
        }
        AllocationError::Internal(text) if text.contains("OUT_OF_HOST_MEMORY") => {
            Error::allocating(name, bytes)(Code::ERROR_OUT_OF_HOST_MEMORY)
        }
        AllocationError::Internal(text) if text.contains("vkAllocateMemory") => {
            Error::allocating(name, bytes)(Code::ERROR_UNKNOWN)
        }
        other => Error::unsupported(format!("memory for '{name}' ({bytes} bytes)"), other.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lazy_memory_is_chosen_among_the_valid_types() {
        let kind = |property_flags| vk::MemoryType { property_flags, heap_index: 0 };
        let (plain, lazy) = (
            kind(vk::MemoryPropertyFlags::DEVICE_LOCAL),
            kind(vk::MemoryPropertyFlags::DEVICE_LOCAL | vk::MemoryPropertyFlags::LAZILY_ALLOCATED),
        );
        assert_eq!(lazy_type(&[plain, lazy, lazy], 0b111), Some(1));
        assert_eq!(lazy_type(&[plain, lazy, lazy], 0b101), Some(2));
        assert_eq!(lazy_type(&[plain, lazy], 0b01), None);
        assert_eq!(lazy_type(&[], u32::MAX), None);
    }

    #[test]
    fn shortages_are_told_apart_from_missing_support() {
        let text = |error| allocation_error("sky", 400, error).to_string();
        assert_eq!(
            text(AllocationError::OutOfMemory),
            "out of device memory in vkAllocateMemory for 'sky' (400 bytes)"
        );
        let mapping = |told: String| text(AllocationError::FailedToMap(told));
        let (host, device) = (vk::Result::ERROR_OUT_OF_HOST_MEMORY, vk::Result::ERROR_OUT_OF_DEVICE_MEMORY);
        for told in [host.to_string(), "Returned mapped pointer is null".to_owned()] {
            assert_eq!(mapping(told), "out of host memory in vkMapMemory for 'sky'");
        }
        assert_eq!(mapping(device.to_string()), "out of device memory in vkMapMemory for 'sky'");
        let refused = mapping(vk::Result::ERROR_MEMORY_MAP_FAILED.to_string());
        assert!(refused.starts_with("vkMapMemory failed for 'sky': "), "{refused}");
        let of_driver =
            |code: &str| AllocationError::Internal(format!("Unexpected error in vkAllocateMemory: {code}"));
        assert_eq!(
            text(of_driver("ERROR_OUT_OF_HOST_MEMORY")),
            "out of host memory in vkAllocateMemory for 'sky'"
        );
        assert!(text(of_driver("ERROR_TOO_MANY_OBJECTS")).starts_with("vkAllocateMemory failed for 'sky': "));
        assert!(
            text(AllocationError::NoCompatibleMemoryTypeFound).starts_with("not supported: memory for 'sky'")
        );
    }
}
