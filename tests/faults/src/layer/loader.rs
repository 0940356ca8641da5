//! Structures of the interface between the Vulkan loader and layers, which `ash` does not have.

use std::ffi::{c_char, c_void};

use ash::vk;

/// `VK_STRUCTURE_TYPE_LOADER_INSTANCE_CREATE_INFO`.
pub(super) const INSTANCE_LINK: vk::StructureType = vk::StructureType::LOADER_INSTANCE_CREATE_INFO;
/// `VK_STRUCTURE_TYPE_LOADER_DEVICE_CREATE_INFO`.
pub(super) const DEVICE_LINK: vk::StructureType = vk::StructureType::LOADER_DEVICE_CREATE_INFO;

/// The layer below, in the description of an instance or a device: `VkLayerInstanceLink`, `VkLayerDeviceLink`.
#[repr(C)]
pub(super) struct Link {
    pub(super) below: *mut Link,
    pub(super) get_instance_proc_addr: vk::PFN_vkGetInstanceProcAddr,
    /// `vkGetDeviceProcAddr` in the description of a device; something else in that of an instance.
    pub(super) other: Option<vk::PFN_vkGetDeviceProcAddr>,
}

/// `VkLayerInstanceCreateInfo` and `VkLayerDeviceCreateInfo`.
#[repr(C)]
pub(super) struct LinkInfo {
    kind: vk::StructureType,
    next: *mut c_void,
    /// 0 where `link` is the member that counts.
    function: u32,
    pub(super) link: *mut Link,
}

/// Finds the loader's link in the chain of a description.
///
/// # Safety
/// `chain` is the `pNext` chain that the loader gives to a layer.
pub(super) unsafe fn find_link(chain: *const c_void, kind: vk::StructureType) -> Option<*mut LinkInfo> {
    let mut info = chain.cast_mut().cast::<LinkInfo>();
    while !info.is_null() {
        // SAFETY: every structure of a chain starts with its type and the next one; only links have more.
        unsafe {
            if (*info).kind == kind && (*info).function == 0 {
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
    pub(super) version: u32,
    pub(super) get_instance_proc_addr: Option<vk::PFN_vkGetInstanceProcAddr>,
    pub(super) get_device_proc_addr: Option<vk::PFN_vkGetDeviceProcAddr>,
    pub(super) get_physical_device_proc_addr: Option<vk::PFN_vkGetInstanceProcAddr>,
}

/// Head of the chains of commands that need no instance: `VkChainHeader`.
#[repr(C)]
struct ChainHeader {
    kind: i32,
    version: u32,
    size: u32,
}

/// `VkEnumerateInstanceVersionChain`.
#[repr(C)]
pub struct VersionChain {
    header: ChainHeader,
    pub(super) next: unsafe extern "system" fn(*const VersionChain, *mut u32) -> vk::Result,
    pub(super) link: *const VersionChain,
}

/// `VkEnumerateInstanceExtensionPropertiesChain`.
#[repr(C)]
pub struct ExtensionsChain {
    header: ChainHeader,
    pub(super) next: unsafe extern "system" fn(
        *const ExtensionsChain,
        *const c_char,
        *mut u32,
        *mut vk::ExtensionProperties,
    ) -> vk::Result,
    pub(super) link: *const ExtensionsChain,
}

/// `VkEnumerateInstanceLayerPropertiesChain`.
#[repr(C)]
pub struct LayersChain {
    header: ChainHeader,
    pub(super) next:
        unsafe extern "system" fn(*const LayersChain, *mut u32, *mut vk::LayerProperties) -> vk::Result,
    pub(super) link: *const LayersChain,
}
