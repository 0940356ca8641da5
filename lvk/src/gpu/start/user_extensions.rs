//! Extensions and features of the caller's own, beside those that the library turns on.

use std::ffi::{CStr, c_void};
use std::fmt;
use std::ptr;

use ash::vk;

/// Extensions and features for Vulkan calls of the caller's own, and what its shaders may then ask for.
///
/// Empty by default. What the library turns on itself may be named again among the extensions, not among the features.
#[derive(Clone, Copy, Default)]
pub struct UserExtensions<'a> {
    instance: &'a [&'a CStr],
    device: &'a [&'a CStr],
    capabilities: &'a [u32],
    features: Option<&'a (dyn vk::ExtendsDeviceCreateInfo + Sync)>,
}

impl<'a> UserExtensions<'a> {
    /// Extensions of the instance, extensions of the device, a chain of feature structures to put behind
    /// `VkDeviceCreateInfo` with `pNext` set between them and null at its end, and the numbers of SPIR-V capabilities
    /// that they allow.
    ///
    /// # Safety
    /// Each structure of the chain must be valid, alive for `'a`, belong to one of the extensions or to the device's core
    /// version, ask for features that the chosen device has, and be none of those that the library chains:
    /// `VkPhysicalDeviceFeatures2`, `VkPhysicalDeviceVulkan11Features`, `..12Features`, `..13Features`, what is behind
    /// [`OptionalFeature`](crate::OptionalFeature), ray tracing and mesh shaders. Shaders that use one of the
    /// capabilities must be valid on the device.
    pub unsafe fn new(
        instance: &'a [&'a CStr],
        device: &'a [&'a CStr],
        features: Option<&'a (dyn vk::ExtendsDeviceCreateInfo + Sync)>,
        capabilities: &'a [u32],
    ) -> Self {
        Self { instance, device, capabilities, features }
    }

    pub(crate) fn instance_extensions(&self) -> &'a [&'a CStr] {
        self.instance
    }

    pub(crate) fn device_extensions(&self) -> &'a [&'a CStr] {
        self.device
    }

    pub(crate) fn capabilities(&self) -> &'a [u32] {
        self.capabilities
    }

    /// The head of the chain, or null. Vulkan only reads it.
    pub(crate) fn feature_chain(&self) -> *mut c_void {
        self.features.map_or(ptr::null_mut(), |head| ptr::from_ref(head).cast::<c_void>().cast_mut())
    }
}

impl fmt::Debug for UserExtensions<'_> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.debug_struct("UserExtensions")
            .field("instance", &self.instance)
            .field("device", &self.device)
            .field("capabilities", &self.capabilities)
            .field("features", &self.features.is_some())
            .finish()
    }
}
