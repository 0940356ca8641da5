//! Memory of buffers and images, by `gpu-allocator`. Small objects take slots of shared blocks.

use std::ptr::NonNull;

use ash::vk;
use gpu_allocator::vulkan::{
    Allocation, AllocationCreateDesc, AllocationScheme, Allocator, AllocatorCreateDesc,
};
use gpu_allocator::{AllocationError, AllocationSizes, AllocatorDebugSettings, MemoryLocation};

use super::slab::{Slab, Slot};
use crate::error::{Error, Result};

/// Memory location of a buffer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum MemoryKind {
    /// Device-local memory, written by uploads and commands.
    #[default]
    Device,
    /// Mapped memory that the host writes and the GPU reads across the bus.
    HostVisible,
    /// Mapped and cached memory, from which the host reads data that the GPU wrote.
    Readback,
}

impl MemoryKind {
    /// True if the memory is mapped for the host.
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

/// Memory of a buffer or an image.
pub(crate) struct ObjectMemory {
    pub(crate) raw: vk::DeviceMemory,
    /// Offset of the object in the memory, in bytes.
    pub(crate) offset: u64,
    /// Size of the object's part, in bytes.
    pub(crate) size: u64,
    pub(crate) properties: vk::MemoryPropertyFlags,
    mapped: Option<Mapping>,
    source: Source,
}

/// Origin of the memory, to which it is returned.
enum Source {
    Own(Box<Allocation>),
    /// A slot of the [`SlabPool`] with this index.
    Shared(usize, Slot),
    /// Memory that the allocator does not know: exported or imported.
    #[cfg(unix)]
    Unmanaged {
        /// Index of the memory type.
        type_index: u32,
    },
}

/// Host address of mapped memory.
#[derive(Clone, Copy)]
pub(crate) struct Mapping(pub(crate) NonNull<u8>);

// SAFETY: the address is valid in every thread. Code that uses the address synchronises its own accesses.
unsafe impl Send for Mapping {}
// SAFETY: as above.
unsafe impl Sync for Mapping {}

impl ObjectMemory {
    fn dedicated(allocation: Allocation) -> Self {
        let place = MemoryPlacement::from_allocation(&allocation);
        Self::from_placement(place, allocation.size(), Source::Own(Box::new(allocation)))
    }

    /// Describes memory that the allocator does not know. It is mapped nowhere.
    #[cfg(unix)]
    pub(crate) fn unmanaged(
        raw: vk::DeviceMemory,
        size: u64,
        type_index: u32,
        properties: vk::MemoryPropertyFlags,
    ) -> Self {
        Self { raw, offset: 0, size, properties, mapped: None, source: Source::Unmanaged { type_index } }
    }

    /// Returns the index of the memory type of memory that the allocator does not know.
    #[cfg(unix)]
    pub(crate) fn unmanaged_type(&self) -> Option<u32> {
        if let Source::Unmanaged { type_index } = self.source { Some(type_index) } else { None }
    }

    /// True if the allocator does not know the memory, which `vkFreeMemory` frees.
    pub(crate) fn is_unmanaged(&self) -> bool {
        #[cfg(unix)]
        return self.unmanaged_type().is_some();
        #[cfg(not(unix))]
        return false;
    }

    fn from_placement(place: MemoryPlacement, size: u64, source: Source) -> Self {
        let MemoryPlacement { raw, offset, properties, mapped } = place;
        Self { raw, offset, size, properties, mapped, source }
    }

    /// Returns the host address of the object's part, if the memory is mapped.
    pub(crate) fn mapped(&self) -> Option<NonNull<u8>> {
        self.mapping().map(|mapping| mapping.0)
    }

    /// As [`mapped`](Self::mapped), in a form that can be stored beside the owner of the memory.
    pub(crate) fn mapping(&self) -> Option<Mapping> {
        self.mapped
    }
}

/// Position of an object in device memory.
struct MemoryPlacement {
    raw: vk::DeviceMemory,
    offset: u64,
    properties: vk::MemoryPropertyFlags,
    mapped: Option<Mapping>,
}

impl MemoryPlacement {
    fn from_allocation(allocation: &Allocation) -> Self {
        Self {
            // SAFETY: the handle is only stored here; the memory lives until the allocation is freed.
            raw: unsafe { allocation.memory() },
            offset: allocation.offset(),
            properties: allocation.memory_properties(),
            mapped: allocation.mapped_ptr().map(|start| Mapping(start.cast())),
        }
    }

    /// Returns the position of a slot in a block.
    fn from_slot(block: &Allocation, slot: Slot, slot_bytes: u64) -> Self {
        let whole = Self::from_allocation(block);
        let offset = u64::from(slot.number) * slot_bytes;
        // SAFETY: the slot lies inside the block, all of which is mapped.
        let inside = |start: Mapping| Mapping(unsafe { start.0.add(offset as usize) });
        Self { offset: whole.offset + offset, mapped: whole.mapped.map(inside), ..whole }
    }
}

/// The memory of a device. Large objects have dedicated allocations; small ones share blocks.
pub(crate) struct DeviceMemory {
    allocator: Allocator,
    slab_pools: Vec<SlabPool>,
    properties: vk::PhysicalDeviceMemoryProperties,
}

/// Slots for objects of the same class.
struct SlabPool {
    kind: SlabClass,
    slab: Slab<Allocation>,
}

/// Common requirements of the objects that share a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct SlabClass {
    slot_bytes: u64,
    /// Allowed memory types.
    type_bits: u32,
    memory: MemoryKind,
    linear: bool,
}

impl SlabClass {
    /// Minimum slot size in bytes. With `LEAST` and `MOST` a block has 16 KiB to 1 MiB.
    const LEAST: u64 = 256;
    const MOST: u64 = 16 << 10;

    /// Returns the class for an object with these requirements. `None` if the object is large enough for a
    /// dedicated allocation. Slot sizes are powers of two, so each slot is aligned if its block is.
    fn from_requirements(
        requirements: &vk::MemoryRequirements,
        memory: MemoryKind,
        linear: bool,
    ) -> Option<Self> {
        let bytes = requirements.size.max(requirements.alignment).max(Self::LEAST);
        (bytes <= Self::MOST).then(|| Self {
            slot_bytes: bytes.next_power_of_two(),
            type_bits: requirements.memory_type_bits,
            memory,
            linear,
        })
    }

    /// Returns the memory requirements of a block of slots.
    fn block_requirements(&self) -> vk::MemoryRequirements {
        vk::MemoryRequirements {
            size: self.slot_bytes * Slab::<Allocation>::SLOTS,
            alignment: self.slot_bytes,
            memory_type_bits: self.type_bits,
        }
    }
}

/// Result of an allocation.
pub(crate) type Allocated<T> = Result<T, AllocationError>;

impl DeviceMemory {
    pub(crate) fn new(
        instance: &ash::Instance,
        device: &ash::Device,
        physical_device: vk::PhysicalDevice,
    ) -> Result<Self> {
        // SAFETY: the physical device belongs to the instance.
        let properties = unsafe { instance.get_physical_device_memory_properties(physical_device) };
        let mut debug_settings = AllocatorDebugSettings::default();
        // The context reports leaks by name.
        debug_settings.log_leaks_on_shutdown = false;
        let allocator = Allocator::new(&AllocatorCreateDesc {
            instance: instance.clone(),
            device: device.clone(),
            physical_device,
            debug_settings,
            buffer_device_address: true,
            allocation_sizes: block_sizes(&properties),
        })
        .map_err(|error| Error::unsupported("memory allocation", error.to_string()))?;
        Ok(Self { allocator, slab_pools: Vec::new(), properties })
    }

    /// Allocates memory for one object. If a block for small objects cannot be allocated, the object gets a
    /// dedicated allocation.
    pub(crate) fn allocate(
        &mut self,
        name: &str,
        requirements: vk::MemoryRequirements,
        memory: MemoryKind,
        linear: bool,
    ) -> Allocated<ObjectMemory> {
        // The allocator compares the size with the heap of its first choice only. It does not check the heap of its second choice.
        let memory_type_bits =
            requirements.memory_type_bits & types_of_size(&self.properties, requirements.size);
        let is_restricted = memory_type_bits != requirements.memory_type_bits;
        let requirements = vk::MemoryRequirements { memory_type_bits, ..requirements };
        if let Some(kind) = SlabClass::from_requirements(&requirements, memory, linear)
            && let Ok(shared) = self.allocate_slot(name, kind, requirements.size)
        {
            return Ok(shared);
        }
        match allocate_dedicated(&mut self.allocator, name, requirements, memory, linear) {
            Err(AllocationError::NoCompatibleMemoryTypeFound) if is_restricted => {
                Err(AllocationError::OutOfMemory)
            }
            made => made.map(ObjectMemory::dedicated),
        }
    }

    /// Allocates a slot of a block.
    fn allocate_slot(&mut self, name: &str, kind: SlabClass, size: u64) -> Allocated<ObjectMemory> {
        let number =
            self.slab_pools.iter().position(|slab_pool| slab_pool.kind == kind).unwrap_or_else(|| {
                self.slab_pools.push(SlabPool { kind, slab: Slab::default() });
                self.slab_pools.len() - 1
            });
        let new = || {
            allocate_dedicated(&mut self.allocator, name, kind.block_requirements(), kind.memory, kind.linear)
        };
        let (slot, block) = self.slab_pools[number].slab.allocate(new)?;
        let place = MemoryPlacement::from_slot(block, slot, kind.slot_bytes);
        Ok(ObjectMemory::from_placement(place, size, Source::Shared(number, slot)))
    }

    pub(crate) fn free(&mut self, memory: ObjectMemory) -> Allocated<()> {
        let unused = match memory.source {
            Source::Own(allocation) => Some(*allocation),
            Source::Shared(slab_pool, slot) => self.slab_pools[slab_pool].slab.free(slot),
            #[cfg(unix)]
            Source::Unmanaged { .. } => None,
        };
        unused.map_or(Ok(()), |allocation| self.allocator.free(allocation))
    }

    /// Returns the number of live `VkDeviceMemory` objects and their bytes.
    #[cfg(any(test, feature = "test-hooks"))]
    pub(crate) fn blocks(&self) -> (usize, u64) {
        (self.allocator.generate_report().blocks.len(), self.allocator.capacity())
    }
}

/// Returns the sizes of the allocator's blocks: 256 MiB, 64 MiB of types that the host sees, and no more than the smallest heap of these types.
/// The allocator makes none below 4 MiB.
fn block_sizes(properties: &vk::PhysicalDeviceMemoryProperties) -> AllocationSizes {
    const MIB: u64 = 1 << 20;
    let (heaps, types) = (properties.memory_heaps_as_slice(), properties.memory_types_as_slice());
    let [device, host] = [(false, 256 * MIB), (true, 64 * MIB)].map(|(is_seen, most)| {
        let seen = vk::MemoryPropertyFlags::HOST_VISIBLE;
        let of_kind = types.iter().filter(|kind| kind.property_flags.contains(seen) == is_seen);
        let sizes = of_kind.filter_map(|kind| heaps.get(kind.heap_index as usize)).map(|heap| heap.size);
        let whole = sizes.fold(most, u64::min) / (4 * MIB) * (4 * MIB);
        whole.max(4 * MIB)
    });
    AllocationSizes::new(device, host)
}

/// Returns the memory types whose heaps have at least `bytes` bytes, one bit for each.
pub(crate) fn types_of_size(properties: &vk::PhysicalDeviceMemoryProperties, bytes: u64) -> u32 {
    let heaps = properties.memory_heaps_as_slice();
    let holds =
        |kind: &vk::MemoryType| heaps.get(kind.heap_index as usize).is_some_and(|heap| bytes <= heap.size);
    let types = (0..).zip(properties.memory_types_as_slice());
    types.map(|(number, kind)| u32::from(holds(kind)) << number).sum()
}

/// Allocates memory of the allocator's blocks. If no further block fits on the device or can be mapped, the memory gets an
/// allocation of exactly its size: a block has up to 256 MiB, and less may be free. The allocator copies the name, which
/// only its own reports contain.
fn allocate_dedicated(
    allocator: &mut Allocator,
    name: &str,
    requirements: vk::MemoryRequirements,
    memory: MemoryKind,
    linear: bool,
) -> Allocated<Allocation> {
    let desc = AllocationCreateDesc {
        name,
        requirements,
        location: memory.location(),
        linear,
        allocation_scheme: AllocationScheme::GpuAllocatorManaged,
    };
    match allocate_mapped(allocator, &desc) {
        Err(AllocationError::OutOfMemory | AllocationError::FailedToMap(_)) => {
            // A dedicated allocation for no buffer is one for any objects.
            let allocation_scheme = AllocationScheme::DedicatedBuffer(vk::Buffer::null());
            allocate_mapped(allocator, &AllocationCreateDesc { allocation_scheme, ..desc })
        }
        made => made,
    }
}

/// Allocates memory that has a valid address where it is mapped.
fn allocate_mapped(allocator: &mut Allocator, desc: &AllocationCreateDesc<'_>) -> Allocated<Allocation> {
    let made = allocator.allocate(desc)?;
    if made.mapped_ptr().is_some_and(|start| !is_mapping(start.addr().get(), made.offset(), made.size())) {
        allocator.free(made)?;
        return Err(AllocationError::FailedToMap("the driver returned no address".to_owned()));
    }
    Ok(made)
}

/// True if `start` can be the host address of `size` bytes at `offset` of mapped memory. lavapipe returns success with
/// the address of a failed `mmap`, which is -1. Vulkan maps memory at multiples of `minMemoryMapAlignment`, at least 64.
fn is_mapping(start: usize, offset: u64, size: u64) -> bool {
    const LEAST_ALIGNMENT: usize = 64;
    let (Ok(offset), Ok(size)) = (usize::try_from(offset), usize::try_from(size)) else { return false };
    let first = start.checked_sub(offset);
    first.is_some_and(|first| first.is_multiple_of(LEAST_ALIGNMENT)) && start.checked_add(size).is_some()
}

#[cfg(test)]
mod tests {
    use ash::vk::Handle;
    use proptest::prelude::*;

    use super::*;
    use crate::test_support::recording_memory::{recording_device, take_allocations};

    #[test]
    fn the_address_of_a_failed_mapping_is_refused() {
        let failed = usize::MAX;
        for offset in [0, 64, 100, 1 << 20] {
            assert!(is_mapping(0x4000_0000 + offset as usize, offset, 4096), "{offset}");
            assert!(!is_mapping(failed.wrapping_add(offset as usize), offset, 4096), "{offset}");
        }
        assert!(!is_mapping(usize::MAX - 63, 0, 4096), "the end is no address");
    }

    /// Returns what the driver is asked for, each with type and bytes, where a buffer of `size` bytes is allocated; and the error. The first
    /// heap is the host's, the second the device's, which may be full.
    fn asked_for(
        heaps: [u64; 2],
        own_is_full: bool,
        (size, memory): (u64, MemoryKind),
    ) -> (Vec<(u32, u64)>, Option<AllocationError>) {
        let (instance, device) = recording_device(heaps, own_is_full);
        let mut all = DeviceMemory::new(&instance, &device, vk::PhysicalDevice::from_raw(1)).unwrap();
        let requirements = vk::MemoryRequirements { size, alignment: 256, memory_type_bits: 0b11 };
        let made = all.allocate("a buffer", requirements, memory, true);
        let error = made.map(|memory| all.free(memory).unwrap()).err();
        (take_allocations(), error)
    }

    #[test]
    fn no_heap_is_asked_for_more_bytes_than_it_has() {
        const GIB: u64 = 1 << 30;
        let (seen, own) = (MemoryKind::HostVisible, MemoryKind::Device);
        let (host_is_small, own_is_small) = ([GIB, 4 * GIB], [4 * GIB, GIB]);
        let four = [(1, 2 * GIB); 4];
        for (heaps, own_is_full, request, expected, is_short) in [
            (host_is_small, false, (2 * GIB, seen), &four[..1], false),
            // The allocator's two choices are the same, and it tries both for a block and for an allocation of exactly the size.
            (host_is_small, true, (2 * GIB, seen), &four, true),
            (host_is_small, false, (8 * GIB, seen), &[], true),
            (host_is_small, true, (GIB, seen), &[(1, GIB), (0, GIB)], false),
            (own_is_small, false, (2 * GIB, seen), &[(0, 2 * GIB)], false),
            (own_is_small, false, (2 * GIB, own), &[], true),
        ] {
            let (asked, error) = asked_for(heaps, own_is_full, request);
            assert_eq!(asked, expected, "{request:?} of {heaps:?}");
            assert_eq!(
                matches!(error, Some(AllocationError::OutOfMemory)),
                is_short,
                "{request:?}: {error:?}"
            );
            assert_eq!(error.is_some(), is_short, "{request:?}: {error:?}");
        }
    }

    #[test]
    fn blocks_are_no_larger_than_the_smallest_heap() {
        const MIB: u64 = 1 << 20;
        let request = (5 * MIB, MemoryKind::HostVisible);
        for (host, own, block) in [(4096, 4096, 64), (4096, 30, 28), (30, 4096, 28), (64, 128, 64)] {
            let (asked, error) = asked_for([host * MIB, own * MIB], false, request);
            assert_eq!((asked, error.is_none()), (vec![(1, block * MIB)], true), "{host} and {own} MiB");
        }
    }

    proptest! {
        /// Slots of an aligned block are aligned, and each is large enough for its object.
        #[test]
        fn slots_suit_their_objects(
            size in 1..40_000_u64, alignment in 0..17_u32, start in 0..8_u64, number in 0..64_u64
        ) {
            let requirements = vk::MemoryRequirements { size, alignment: 1 << alignment, memory_type_bits: 5 };
            let large = size.max(requirements.alignment) > SlabClass::MOST;
            let kind = SlabClass::from_requirements(&requirements, MemoryKind::Readback, true);
            prop_assert_eq!(kind.is_none(), large);
            if let Some(kind) = kind {
                let block = kind.block_requirements();
                let offset = start * block.alignment + number * kind.slot_bytes;
                prop_assert!(offset.is_multiple_of(requirements.alignment));
                prop_assert!(kind.slot_bytes >= size && (number + 1) * kind.slot_bytes <= block.size);
                prop_assert_eq!(block.memory_type_bits, 5);
                prop_assert!(block.size <= 1 << 20);
            }
        }

        /// Objects share blocks only if they may use the same memory.
        #[test]
        fn objects_of_different_kinds_share_nothing(bits in 1..4_u32, other_bits in 1..4_u32, linear: bool) {
            let of = |memory_type_bits, memory, linear| {
                let requirements = vk::MemoryRequirements { size: 300, alignment: 16, memory_type_bits };
                SlabClass::from_requirements(&requirements, memory, linear)
            };
            let kind = of(bits, MemoryKind::Device, linear);
            prop_assert_eq!(kind == of(other_bits, MemoryKind::Device, linear), bits == other_bits);
            prop_assert_ne!(kind, of(bits, MemoryKind::HostVisible, linear));
            prop_assert_ne!(kind, of(bits, MemoryKind::Device, !linear));
        }
    }
}
