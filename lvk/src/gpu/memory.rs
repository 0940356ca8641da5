//! Memory of buffers and images, by `gpu-allocator`.

use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme};

use super::device::Gpu;
use crate::error::{Error, Result};

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
