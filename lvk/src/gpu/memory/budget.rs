//! Size, budget and use of each memory heap.

use std::sync::atomic::{AtomicU64, Ordering};

use ash::vk;

use super::allocator::ObjectMemory;

/// The memory of a device, from [`Context::memory_budget`](crate::Context::memory_budget).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MemoryBudget {
    /// The memory heaps, in the order of Vulkan.
    pub heaps: Vec<MemoryHeap>,
    /// True if the driver reports budgets and uses
    /// ([`OptionalFeature::MemoryBudget`](crate::OptionalFeature::MemoryBudget)). Otherwise the budgets equal
    /// the sizes, and only the objects of this context count as used.
    pub is_measured: bool,
}

/// One memory heap.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MemoryHeap {
    /// Size of the heap, in bytes.
    pub size_bytes: u64,
    /// Bytes that the process may use before allocations fail or slow everything down. Other programs change
    /// this value.
    pub budget_bytes: u64,
    /// Bytes that the process uses, including all memory that the driver allocated for it.
    pub used_bytes: u64,
    /// Bytes of that used by the buffers and images of this context. Objects that are destroyed but still in use by
    /// the GPU are included. If two heaps have memory types with the same properties, both count in the first.
    pub object_bytes: u64,
    /// True if the heap is device-local (`VK_MEMORY_HEAP_DEVICE_LOCAL_BIT`).
    pub device_local: bool,
}

/// Bytes of objects in each heap.
pub(crate) struct HeapUse {
    types: Vec<vk::MemoryType>,
    bytes: [AtomicU64; vk::MAX_MEMORY_HEAPS],
}

impl HeapUse {
    /// Creates the counters, all zero.
    pub(crate) fn new(instance: &ash::Instance, device: vk::PhysicalDevice) -> Self {
        // SAFETY: the physical device belongs to the instance.
        let memory = unsafe { instance.get_physical_device_memory_properties(device) };
        let types = memory.memory_types_as_slice().to_vec();
        Self { types, bytes: Default::default() }
    }

    /// Adds an allocated object.
    pub(crate) fn add(&self, allocated: &ObjectMemory) {
        if let Some(heap) = heap_index(&self.types, allocated.properties) {
            self.bytes[heap].fetch_add(allocated.size, Ordering::Relaxed);
        }
    }

    /// Removes an object that is freed.
    pub(crate) fn remove(&self, allocated: &ObjectMemory) {
        if let Some(heap) = heap_index(&self.types, allocated.properties) {
            self.bytes[heap].fetch_sub(allocated.size, Ordering::Relaxed);
        }
    }

    /// Queries the heaps of a device (`vkGetPhysicalDeviceMemoryProperties2`). `is_measured` is true if the
    /// device has `VK_EXT_memory_budget`.
    pub(crate) fn query_budget(
        &self,
        instance: &ash::Instance,
        device: vk::PhysicalDevice,
        is_measured: bool,
    ) -> MemoryBudget {
        let mut told = vk::PhysicalDeviceMemoryBudgetPropertiesEXT::default();
        let mut properties = vk::PhysicalDeviceMemoryProperties2::default();
        if is_measured {
            properties = properties.push_next(&mut told);
        }
        // SAFETY: the physical device belongs to the instance, and supports the chained structures.
        unsafe { instance.get_physical_device_memory_properties2(device, &mut properties) };
        let memory = properties.memory_properties;
        let heaps = memory.memory_heaps_as_slice().iter().enumerate().map(|(place, heap)| {
            let object_bytes = self.bytes[place].load(Ordering::Relaxed);
            let (budget_bytes, used_bytes) = match is_measured {
                true => (told.heap_budget[place], told.heap_usage[place]),
                false => (heap.size, object_bytes),
            };
            let device_local = heap.flags.contains(vk::MemoryHeapFlags::DEVICE_LOCAL);
            MemoryHeap { size_bytes: heap.size, budget_bytes, used_bytes, object_bytes, device_local }
        });
        MemoryBudget { heaps: heaps.collect(), is_measured }
    }
}

/// Returns the heap of the first memory type with these properties.
fn heap_index(types: &[vk::MemoryType], properties: vk::MemoryPropertyFlags) -> Option<usize> {
    types.iter().find(|of| of.property_flags == properties).map(|of| of.heap_index as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_heap_is_that_of_the_first_type_with_the_properties() {
        use vk::MemoryPropertyFlags as Flags;
        let of = |property_flags, heap_index| vk::MemoryType { property_flags, heap_index };
        let host = Flags::HOST_VISIBLE | Flags::HOST_COHERENT;
        let types = [of(Flags::empty(), 1), of(Flags::DEVICE_LOCAL, 0), of(host, 1), of(host, 2)];
        assert_eq!(heap_index(&types, Flags::DEVICE_LOCAL), Some(0));
        assert_eq!(heap_index(&types, host), Some(1));
        assert_eq!(heap_index(&types, Flags::LAZILY_ALLOCATED), None);
    }
}
