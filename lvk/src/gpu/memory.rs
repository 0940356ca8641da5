//! Memory of buffers and images, by `gpu-allocator`.

use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme};

use super::device::Gpu;
use crate::error::{Error, Result, check_limit};

/// Where a buffer lives.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum MemoryKind {
    /// Fast for the GPU; written by uploads and commands.
    #[default]
    Device,
    /// Mapped for the host to write, read by the GPU across the bus.
    HostVisible,
    /// Mapped and cached for the host to read what the GPU wrote.
    Readback,
}

impl MemoryKind {
    /// Whether the host sees the memory.
    pub(crate) fn mapped(self) -> bool {
        self != Self::Device
    }

    fn location(self) -> MemoryLocation {
        match self {
            Self::Device => MemoryLocation::GpuOnly,
            Self::HostVisible => MemoryLocation::CpuToGpu,
            Self::Readback => MemoryLocation::GpuToCpu,
        }
    }
}

impl Gpu {
    /// Allocates memory for a buffer (`linear`) or an image.
    pub(crate) fn allocate(
        &self,
        name: &str,
        requirements: vk::MemoryRequirements,
        kind: MemoryKind,
        linear: bool,
    ) -> Result<Allocation> {
        let bytes = requirements.size;
        let limit = self.caps.limits.max_allocation_bytes;
        check_limit(name, "memory of one object in bytes", bytes, limit)?;
        let out_of_memory = || Error::OutOfDeviceMemory { object: name.to_owned(), bytes };
        let mut allocator = self.allocator();
        let allocator = allocator.as_mut().ok_or_else(out_of_memory)?;
        let desc = AllocationCreateDesc {
            // The allocator keeps a copy, which only its own reports show.
            name: if self.names_objects() { name } else { "" },
            requirements,
            location: kind.location(),
            linear,
            allocation_scheme: AllocationScheme::GpuAllocatorManaged,
        };
        let allocated = allocator.allocate(&desc).map_err(|error| match error {
            gpu_allocator::AllocationError::OutOfMemory => out_of_memory(),
            other => Error::unsupported(format!("memory for '{name}' ({bytes} bytes)"), other.to_string()),
        })?;
        self.heap_use.add(&allocated);
        self.name_block(&allocated, name);
        Ok(allocated)
    }

    /// Names a block of memory after what lies at its start.
    fn name_block(&self, allocated: &Allocation, name: &str) {
        if self.names_objects() && allocated.offset() == 0 {
            // SAFETY: the memory is only named, while the allocator is locked.
            self.name(unsafe { allocated.memory() }, &format!("memory from '{name}' on"));
        }
    }

    /// Memory that the device has only while a pass needs it; `None` where it has no such kind.
    pub(crate) fn allocate_lazy(
        &self,
        name: &str,
        requirements: vk::MemoryRequirements,
    ) -> Result<Option<vk::DeviceMemory>> {
        // SAFETY: the physical device belongs to the instance.
        let memory = unsafe { self.instance.raw.get_physical_device_memory_properties(self.physical()) };
        let Some(kind) = lazy_type(memory.memory_types_as_slice(), requirements.memory_type_bits) else {
            return Ok(None);
        };
        let info =
            vk::MemoryAllocateInfo::default().allocation_size(requirements.size).memory_type_index(kind);
        // SAFETY: the type is one of the device's.
        unsafe { self.device.allocate_memory(&info, None) }.map(Some).map_err(|result| match result {
            vk::Result::ERROR_OUT_OF_DEVICE_MEMORY => {
                Error::OutOfDeviceMemory { object: name.to_owned(), bytes: requirements.size }
            }
            other => Error::vulkan("vkAllocateMemory")(other),
        })
    }

    /// Gives memory back.
    pub(crate) fn free(&self, allocation: Allocation) {
        self.heap_use.remove(&allocation);
        if let Some(allocator) = self.allocator().as_mut()
            && let Err(error) = allocator.free(allocation)
        {
            log::error!("freeing device memory failed: {error}");
        }
    }
}

/// The first of these kinds of memory, of those in `bits`, that is only there when needed.
fn lazy_type(types: &[vk::MemoryType], bits: u32) -> Option<u32> {
    let lazy =
        |kind: &vk::MemoryType| kind.property_flags.contains(vk::MemoryPropertyFlags::LAZILY_ALLOCATED);
    (0..).zip(types).find(|(index, kind)| bits >> index & 1 == 1 && lazy(kind)).map(|(index, _)| index)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lazy_memory_is_found_among_the_kinds_that_will_do() {
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
}
