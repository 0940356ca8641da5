//! Structures of the interface between the Vulkan loader and layers, which `ash` does not have, and the folder by which the loader finds
//! a layer.

mod folder;

use std::ffi::c_void;

use ash::vk;

pub use folder::{LayerDescription, LayerFolder};

/// `VK_STRUCTURE_TYPE_LOADER_INSTANCE_CREATE_INFO`.
pub const INSTANCE_LINK: vk::StructureType = vk::StructureType::LOADER_INSTANCE_CREATE_INFO;
/// `VK_STRUCTURE_TYPE_LOADER_DEVICE_CREATE_INFO`.
pub const DEVICE_LINK: vk::StructureType = vk::StructureType::LOADER_DEVICE_CREATE_INFO;

/// `VK_LAYER_LINK_INFO`.
const LINK: u32 = 0;
/// `VK_LOADER_DATA_CALLBACK`.
const DATA_CALLBACK: u32 = 1;

/// The layer below, in the description of an instance or a device: `VkLayerInstanceLink`, `VkLayerDeviceLink`.
#[repr(C)]
pub struct Link {
    below: *mut Link,
    /// `vkGetInstanceProcAddr` of the layer below.
    pub get_instance_proc_addr: vk::PFN_vkGetInstanceProcAddr,
    /// `vkGetDeviceProcAddr` of the layer below in the description of a device; another function in that of an instance.
    pub get_device_proc_addr: Option<vk::PFN_vkGetDeviceProcAddr>,
}

/// `VkLayerInstanceCreateInfo` and `VkLayerDeviceCreateInfo`.
#[repr(C)]
struct LinkInfo {
    kind: vk::StructureType,
    next: *mut c_void,
    function: u32,
    link: *mut Link,
}

/// Takes the link of the layer below from the chain of a description. The layer below then finds the link of the next one.
///
/// # Safety
/// `chain` is the `pNext` chain that the loader gives to a layer, which calls this function once.
pub unsafe fn take_link(chain: *const c_void, kind: vk::StructureType) -> Option<*const Link> {
    // SAFETY: by contract; the structure holds a link, and the link the one of the layer below it.
    unsafe {
        let info = find(chain, kind, LINK)?;
        let link = (*info).link;
        (*info).link = (*link).below;
        Some(link)
    }
}

/// `PFN_vkSetDeviceLoaderData`: makes a handle that a layer has created one that the loader and other layers know.
pub type SetDeviceLoaderData = unsafe extern "system" fn(vk::Device, *mut c_void) -> vk::Result;

/// Finds the loader's function for handles that a layer creates, in the chain of the description of a device.
///
/// # Safety
/// `chain` is the `pNext` chain that the loader gives to a layer.
pub unsafe fn find_set_loader_data(chain: *const c_void) -> Option<SetDeviceLoaderData> {
    // SAFETY: by contract; a structure with this function holds the callback in place of a link.
    unsafe {
        let info = find(chain, DEVICE_LINK, DATA_CALLBACK)?;
        std::mem::transmute::<*mut Link, Option<SetDeviceLoaderData>>((*info).link)
    }
}

/// Finds a structure of the loader in a chain.
///
/// # Safety
/// `chain` is the `pNext` chain that the loader gives to a layer.
unsafe fn find(chain: *const c_void, kind: vk::StructureType, function: u32) -> Option<*mut LinkInfo> {
    let mut info = chain.cast_mut().cast::<LinkInfo>();
    while !info.is_null() {
        // SAFETY: every structure of a chain starts with its type and the next one; only those of the loader have more.
        unsafe {
            if (*info).kind == kind && (*info).function == function {
                return Some(info);
            }
            info = (*info).next.cast();
        }
    }
    None
}

/// `VkNegotiateLayerInterface`.
#[repr(C)]
pub struct Negotiation {
    kind: u32,
    next: *mut c_void,
    version: u32,
    get_instance_proc_addr: Option<vk::PFN_vkGetInstanceProcAddr>,
    get_device_proc_addr: Option<vk::PFN_vkGetDeviceProcAddr>,
    get_physical_device_proc_addr: Option<vk::PFN_vkGetInstanceProcAddr>,
}

impl Negotiation {
    /// Answers version 2 of the interface, with the layer's functions.
    pub fn answer(&mut self, instance: vk::PFN_vkGetInstanceProcAddr, device: vk::PFN_vkGetDeviceProcAddr) {
        self.version = 2;
        self.get_instance_proc_addr = Some(instance);
        self.get_device_proc_addr = Some(device);
        self.get_physical_device_proc_addr = None;
    }
}

/// Returns the key of an instance, a physical device, a device, a queue or a command buffer: the loader's dispatch table, which an instance
/// shares with its physical devices, and a device with its queues and command buffers.
///
/// # Safety
/// `handle` is a dispatchable handle that is alive.
#[must_use]
pub unsafe fn key_of(handle: u64) -> usize {
    // SAFETY: a dispatchable handle points to the pointer to the loader's dispatch table.
    unsafe { *(handle as usize as *const usize) }
}
