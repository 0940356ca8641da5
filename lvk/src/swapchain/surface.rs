//! The Vulkan surface of a window.

use std::sync::Arc;

use ash::vk;

use super::choose::SurfaceLimits;
use super::desc::PresentMode;
use super::failure::Failure;
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::gpu::start::surface::{WindowFunctions, create_surface};
use crate::gpu::start::window::WindowHandles;

/// A surface, destroyed on drop. It keeps its window alive.
pub(crate) struct Surface {
    pub(crate) raw: vk::SurfaceKHR,
    pub(crate) gpu: Arc<Gpu>,
    pub(crate) window: Arc<dyn WindowHandles>,
    /// Debug name of its swapchain.
    pub(crate) name: Box<str>,
}

/// Properties of a surface that swapchain creation needs.
pub(crate) struct SurfaceState {
    pub(crate) limits: SurfaceLimits,
    pub(crate) raw: vk::SurfaceCapabilitiesKHR,
}

impl Surface {
    /// Creates the surface of a window that the context's queue can present to.
    pub(crate) fn new(gpu: &Arc<Gpu>, window: &Arc<dyn WindowHandles>, name: &str) -> Result<Self> {
        let functions = gpu.window_functions()?;
        let raw = create_surface(&gpu.instance, window.as_ref(), name)?;
        let surface = Self { raw, gpu: Arc::clone(gpu), window: Arc::clone(window), name: name.into() };
        // SAFETY: the surface belongs to the instance of the device.
        let presents = unsafe {
            functions.surface.get_physical_device_surface_support(gpu.physical(), gpu.queues.family(0), raw)
        };
        if presents.map_err(Error::vulkan("vkGetPhysicalDeviceSurfaceSupportKHR", name))? {
            gpu.name(raw, name);
            return Ok(surface);
        }
        Err(gpu.unsupported("presentation to this window"))
    }

    /// Queries the limits for size and number of images.
    pub(crate) fn state(&self) -> Result<SurfaceState, Failure> {
        let functions = &self.functions()?.surface;
        // SAFETY: the surface belongs to the instance of the device.
        let raw =
            unsafe { functions.get_physical_device_surface_capabilities(self.gpu.physical(), self.raw) }
                .map_err(Failure::from_result("vkGetPhysicalDeviceSurfaceCapabilitiesKHR", &self.name))?;
        let size = |extent: vk::Extent2D| [extent.width, extent.height];
        let limits = SurfaceLimits {
            min_images: raw.min_image_count,
            max_images: raw.max_image_count,
            current: size(raw.current_extent),
            smallest: size(raw.min_image_extent),
            largest: size(raw.max_image_extent),
        };
        Ok(SurfaceState { limits, raw })
    }

    /// Queries the formats with their colour spaces.
    pub(crate) fn formats(&self) -> Result<Vec<vk::SurfaceFormatKHR>, Failure> {
        let functions = &self.functions()?.surface;
        // SAFETY: as above.
        unsafe { functions.get_physical_device_surface_formats(self.gpu.physical(), self.raw) }
            .map_err(Failure::from_result("vkGetPhysicalDeviceSurfaceFormatsKHR", &self.name))
    }

    /// Queries the present modes that the library supports.
    pub(crate) fn present_modes(&self) -> Result<Vec<PresentMode>, Failure> {
        let functions = &self.functions()?.surface;
        // SAFETY: as above.
        let modes =
            unsafe { functions.get_physical_device_surface_present_modes(self.gpu.physical(), self.raw) }
                .map_err(Failure::from_result("vkGetPhysicalDeviceSurfacePresentModesKHR", &self.name))?;
        Ok(modes.into_iter().filter_map(PresentMode::from_raw).collect())
    }

    /// Queries the modes that a swapchain in `mode` can switch to without recreation, `mode` first. Returns only `mode`
    /// if the device cannot switch modes.
    pub(crate) fn compatible_modes(&self, mode: PresentMode) -> Result<Vec<PresentMode>, Failure> {
        let Some(functions) = &self.functions()?.maintenance else { return Ok(vec![mode]) };
        let mut asked = vk::SurfacePresentModeEXT::default().present_mode(mode.raw());
        let info = vk::PhysicalDeviceSurfaceInfo2KHR::default().surface(self.raw).push_next(&mut asked);
        let mut raw = [vk::PresentModeKHR::default(); 16];
        let mut compatible = vk::SurfacePresentModeCompatibilityEXT::default().present_modes(&mut raw);
        let mut capabilities = vk::SurfaceCapabilities2KHR::default().push_next(&mut compatible);
        // SAFETY: the surface belongs to the instance of the device, which has the extensions of the chain.
        unsafe {
            functions.get_physical_device_surface_capabilities2(self.gpu.physical(), &info, &mut capabilities)
        }
        .map_err(Failure::from_result("vkGetPhysicalDeviceSurfaceCapabilities2KHR", &self.name))?;
        let count = (compatible.present_mode_count as usize).min(raw.len());
        let others = raw[..count].iter().filter_map(|raw| PresentMode::from_raw(*raw));
        Ok([mode].into_iter().chain(others.filter(|other| *other != mode)).collect())
    }

    fn functions(&self) -> Result<&WindowFunctions, Failure> {
        Ok(self.gpu.window_functions()?)
    }
}

impl Drop for Surface {
    fn drop(&mut self) {
        if let Ok(functions) = self.gpu.window_functions() {
            // SAFETY: swapchains keep their surface alive, so they are destroyed; the window still exists.
            unsafe { functions.surface.destroy_surface(self.raw, None) };
        }
    }
}
