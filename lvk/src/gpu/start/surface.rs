//! Surfaces of windows, and the functions of swapchains.

use ash::vk;

use super::instance::Instance;
use super::window::{WindowHandles, WindowRef, display, raw_window, required_extensions};
use super::window_system;
use crate::error::{Error, Result};
use crate::gpu::caps::optional_features::OptionalFeature;

/// Vulkan functions for surfaces and swapchains.
pub(crate) struct WindowFunctions {
    pub(crate) surface: ash::khr::surface::Instance,
    pub(crate) swapchain: ash::khr::swapchain::Device,
    /// Fences and modes for each present: `VK_EXT_swapchain_maintenance1`.
    pub(crate) maintenance: Option<ash::khr::get_surface_capabilities2::Instance>,
    pub(crate) hdr: Option<ash::ext::hdr_metadata::Device>,
}

impl WindowFunctions {
    /// `None` if the device has no swapchains or the instance no surface extensions.
    pub(crate) fn new(
        instance: &Instance,
        device: &ash::Device,
        has: impl Fn(OptionalFeature) -> bool,
    ) -> Option<Self> {
        if instance.windows.is_none() || !has(OptionalFeature::Swapchain) {
            return None;
        }
        let (entry, raw) = (&instance.entry, &instance.raw);
        Some(Self {
            surface: ash::khr::surface::Instance::new(entry, raw),
            swapchain: ash::khr::swapchain::Device::new(raw, device),
            maintenance: has(OptionalFeature::SwapchainMaintenance1)
                .then(|| ash::khr::get_surface_capabilities2::Instance::new(entry, raw)),
            hdr: has(OptionalFeature::HdrMetadata).then(|| ash::ext::hdr_metadata::Device::new(raw, device)),
        })
    }
}

/// Name of a window in errors, before it has a swapchain.
const PROBED_WINDOW: &str = "window";

/// Surface of a window while a device is selected. Destroyed on drop.
pub(crate) struct SurfaceProbe<'a> {
    functions: ash::khr::surface::Instance,
    raw: vk::SurfaceKHR,
    instance: &'a ash::Instance,
}

impl<'a> SurfaceProbe<'a> {
    pub(crate) fn new(instance: &'a Instance, window: WindowRef<'_>) -> Result<Self> {
        Ok(Self {
            raw: create_surface(instance, window, PROBED_WINDOW)?,
            functions: ash::khr::surface::Instance::new(&instance.entry, &instance.raw),
            instance: &instance.raw,
        })
    }

    /// Returns the first queue family of the device that supports graphics, compute and presenting to this
    /// window.
    pub(crate) fn queue_family(&self, device: vk::PhysicalDevice) -> Result<Option<u32>> {
        let needed = vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE;
        // SAFETY: the device belongs to the instance.
        let families = unsafe { self.instance.get_physical_device_queue_family_properties(device) };
        for (index, family) in (0..).zip(&families) {
            if family.queue_flags.contains(needed) && self.presents(device, index)? {
                return Ok(Some(index));
            }
        }
        Ok(None)
    }

    /// True if queues of the family can present to this window.
    pub(crate) fn presents(&self, device: vk::PhysicalDevice, family: u32) -> Result<bool> {
        // SAFETY: device and surface belong to the instance.
        unsafe { self.functions.get_physical_device_surface_support(device, family, self.raw) }
            .map_err(Error::vulkan("vkGetPhysicalDeviceSurfaceSupportKHR", PROBED_WINDOW))
    }
}

impl Drop for SurfaceProbe<'_> {
    fn drop(&mut self) {
        // SAFETY: nothing was created from the surface.
        unsafe { self.functions.destroy_surface(self.raw, None) };
    }
}

/// Creates a surface (`vkCreateXcbSurfaceKHR` and the like). The window must outlive it. `name` is
/// the object in errors.
pub(crate) fn create_surface(
    instance: &Instance,
    window: &dyn WindowHandles,
    name: &str,
) -> Result<vk::SurfaceKHR> {
    let (display, window) = (display(window)?, raw_window(window)?);
    let enabled = instance.windows.as_ref().map_or(&[][..], |windows| windows.system());
    if let Some(name) = required_extensions(display)?.iter().find(|name| !enabled.contains(name)) {
        let why = if instance.is_external() {
            format!("{} is not among RawContext::instance_extensions", name.to_string_lossy())
        } else {
            "the context was made for windows of another window system, or for none; set ContextDesc::window"
                .to_owned()
        };
        return Err(Error::unsupported("this kind of window", why));
    }
    // SAFETY: the extensions of the window system are enabled, the handles belong together, and the caller
    // keeps the window alive.
    unsafe { window_system::create_surface(&instance.entry, &instance.raw, display, window, name) }
}
