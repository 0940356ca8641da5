//! A device of two memory heaps that records what it is asked to allocate, without a driver.

use std::cell::{Cell, RefCell};
use std::ffi::c_void;

use ash::vk::{self, Handle};

thread_local! {
    static HEAPS: Cell<[u64; 2]> = const { Cell::new([0; 2]) };
    static IS_OWN_FULL: Cell<bool> = const { Cell::new(false) };
    static ALLOCATIONS: RefCell<Vec<(u32, u64)>> = const { RefCell::new(Vec::new()) };
}

/// Returns an instance and a device for this thread. The first heap is the host's, the second the device's own, and the host sees both; type
/// and heap have the same number. Allocations of the second fail if it is full.
pub(crate) fn recording_device(heaps: [u64; 2], is_own_full: bool) -> (ash::Instance, ash::Device) {
    HEAPS.set(heaps);
    IS_OWN_FULL.set(is_own_full);
    // SAFETY: the functions have the types of Vulkan's functions of these names, and no other is called.
    unsafe {
        let instance = ash::Instance::load_with(
            |name| match name.to_bytes() {
                b"vkGetPhysicalDeviceMemoryProperties" => memory_properties as *const c_void,
                b"vkGetPhysicalDeviceProperties" => properties as *const c_void,
                _ => std::ptr::null(),
            },
            vk::Instance::null(),
        );
        let device = ash::Device::load_with(
            |name| match name.to_bytes() {
                b"vkAllocateMemory" => allocate as *const c_void,
                b"vkFreeMemory" => free as *const c_void,
                b"vkMapMemory" => map as *const c_void,
                b"vkUnmapMemory" => unmap as *const c_void,
                _ => std::ptr::null(),
            },
            vk::Device::null(),
        );
        (instance, device)
    }
}

/// Returns the type and the bytes of each allocation that was asked for on this thread since the last call.
pub(crate) fn take_allocations() -> Vec<(u32, u64)> {
    ALLOCATIONS.take()
}

unsafe extern "system" fn memory_properties(
    _: vk::PhysicalDevice,
    to: *mut vk::PhysicalDeviceMemoryProperties,
) {
    let seen = vk::MemoryPropertyFlags::HOST_VISIBLE | vk::MemoryPropertyFlags::HOST_COHERENT;
    let own = seen | vk::MemoryPropertyFlags::DEVICE_LOCAL;
    let mut made = vk::PhysicalDeviceMemoryProperties {
        memory_type_count: 2,
        memory_heap_count: 2,
        ..Default::default()
    };
    for (heap, (flags, size)) in [seen, own].into_iter().zip(HEAPS.get()).enumerate() {
        made.memory_types[heap] = vk::MemoryType { property_flags: flags, heap_index: heap as u32 };
        made.memory_heaps[heap] = vk::MemoryHeap { size, flags: vk::MemoryHeapFlags::empty() };
    }
    // SAFETY: as for Vulkan's function, the caller passes a valid pointer.
    unsafe { to.write(made) };
}

unsafe extern "system" fn properties(_: vk::PhysicalDevice, to: *mut vk::PhysicalDeviceProperties) {
    let limits = vk::PhysicalDeviceLimits { buffer_image_granularity: 1, ..Default::default() };
    // SAFETY: as for Vulkan's function, the caller passes a valid pointer.
    unsafe { to.write(vk::PhysicalDeviceProperties { limits, ..Default::default() }) };
}

unsafe extern "system" fn allocate(
    _: vk::Device,
    info: *const vk::MemoryAllocateInfo<'_>,
    _: *const vk::AllocationCallbacks<'_>,
    memory: *mut vk::DeviceMemory,
) -> vk::Result {
    // SAFETY: as for Vulkan's function, the caller passes a valid description.
    let (kind, bytes) = unsafe { ((*info).memory_type_index, (*info).allocation_size) };
    ALLOCATIONS.with_borrow_mut(|all| all.push((kind, bytes)));
    if kind == 1 && IS_OWN_FULL.get() {
        return vk::Result::ERROR_OUT_OF_DEVICE_MEMORY;
    }
    // SAFETY: as above, for the result.
    unsafe { memory.write(vk::DeviceMemory::from_raw(1)) };
    vk::Result::SUCCESS
}

/// Maps memory at an address that nothing reads. It has no provenance, so objects at an offset in it must not be asked for.
unsafe extern "system" fn map(
    _: vk::Device,
    _: vk::DeviceMemory,
    _: vk::DeviceSize,
    _: vk::DeviceSize,
    _: vk::MemoryMapFlags,
    to: *mut *mut c_void,
) -> vk::Result {
    // SAFETY: as for Vulkan's function, the caller passes a valid pointer.
    unsafe { to.write(std::ptr::without_provenance_mut(1 << 40)) };
    vk::Result::SUCCESS
}

unsafe extern "system" fn unmap(_: vk::Device, _: vk::DeviceMemory) {}

unsafe extern "system" fn free(_: vk::Device, _: vk::DeviceMemory, _: *const vk::AllocationCallbacks<'_>) {}
