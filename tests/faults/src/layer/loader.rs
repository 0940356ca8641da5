//! Structures of the interface between the Vulkan loader and layers for commands that need no instance.

use std::ffi::c_char;

use ash::vk;

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
