//! Extensions and features that the caller enables in addition to those of the library.

use std::ffi::{CStr, c_void};
use std::fmt;
use std::ptr;

use ash::vk;

/// Extensions and features for the caller's own Vulkan calls, and the SPIR-V capabilities they allow.
///
/// Empty by default. Extensions that the library enables itself may be listed again; its features may not.
#[derive(Clone, Copy, Default)]
pub struct UserExtensions<'a> {
    instance: &'a [&'a CStr],
    device: &'a [&'a CStr],
    capabilities: &'a [u32],
    features: Option<&'a (dyn vk::ExtendsDeviceCreateInfo + Sync)>,
}

impl<'a> UserExtensions<'a> {
    /// Creates the set from:
    /// * extensions of the instance,
    /// * extensions of the device,
    /// * a chain of feature structures to append to `VkDeviceCreateInfo`, linked by `pNext` and null at its
    ///   end,
    /// * and the numbers of the SPIR-V capabilities that they allow.
    ///
    /// # Safety
    /// Each structure of the chain must be valid and alive for `'a`. It must belong to one of the extensions
    /// or to the device's core version, and may only enable features that the chosen device has. The chain
    /// must not contain structures that the library chains itself: `VkPhysicalDeviceFeatures2`,
    /// `VkPhysicalDeviceVulkan11Features`, `..12Features`, `..13Features`, and those of
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

    /// Returns the head of the chain, or null. Neither Vulkan nor the library writes to the chain.
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
