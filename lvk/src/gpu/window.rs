//! What of the window system a context needs: nothing, unless it is given a window.

use std::ffi::CStr;
use std::fmt;

use ash::vk;
use raw_window_handle::{HasDisplayHandle, HasWindowHandle, RawDisplayHandle, RawWindowHandle};

use super::caps::optional_features::{FeatureSet, OF_WINDOWS, OptionalFeature};
use super::device::Gpu;
use super::start::instance::Instance;
use crate::error::{Error, Result};

/// A window, of whatever library made it: everything with the handles of the crate `raw-window-handle` is one.
///
/// Locks of the library may be held while its handles are asked for, and while the last reference to it goes: neither may use a
/// context.
pub trait WindowHandles: HasDisplayHandle + HasWindowHandle + Send + Sync {}

impl<T: HasDisplayHandle + HasWindowHandle + Send + Sync> WindowHandles for T {}

impl fmt::Debug for dyn WindowHandles + '_ {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("window")
    }
}

/// A window while an instance and a device are made.
pub(crate) type WindowRef<'a> = &'a dyn WindowHandles;

/// The extensions of an instance that knows windows.
#[derive(Debug, Clone)]
pub(crate) struct WindowExtensions {
    /// Of the window system, with `VK_KHR_surface`.
    system: Vec<&'static CStr>,
    /// `VK_EXT_surface_maintenance1`, with what it needs.
    maintenance: bool,
    /// `VK_EXT_swapchain_colorspace`.
    color_spaces: bool,
}

impl WindowExtensions {
    /// Those for windows like `window`, of which `has` says what there is.
    pub(crate) fn query(window: WindowRef<'_>, has: &dyn Fn(&CStr) -> bool) -> Result<Self> {
        let system = required_extensions(display(window)?)?;
        if let Some(name) = system.iter().find(|name| !has(name)) {
            let what = format!("the instance extension {}", name.to_string_lossy());
            return Err(Error::unsupported(what, "no Vulkan driver here can draw to this kind of window"));
        }
        Ok(Self {
            system,
            maintenance: MAINTENANCE.iter().all(|name| has(name)),
            color_spaces: has(ash::ext::swapchain_colorspace::NAME),
        })
    }

    /// All of them.
    pub(crate) fn names(&self) -> impl Iterator<Item = &'static CStr> {
        let maintenance = if self.maintenance { &MAINTENANCE[..] } else { &[] };
        let color_spaces = self.color_spaces.then_some(ash::ext::swapchain_colorspace::NAME);
        self.system.clone().into_iter().chain(maintenance.iter().copied()).chain(color_spaces)
    }
}

/// The features of a device for windows that cannot be enabled, for want of an extension of the instance.
pub(crate) fn unavailable_window_features(instance: &Instance) -> FeatureSet {
    match &instance.windows {
        None => OF_WINDOWS.into_iter().collect(),
        Some(windows) if windows.maintenance => FeatureSet::NONE,
        Some(_) => FeatureSet::NONE.with(OptionalFeature::SwapchainMaintenance1),
    }
}

const MAINTENANCE: [&CStr; 2] =
    [ash::khr::get_surface_capabilities2::NAME, ash::ext::surface_maintenance1::NAME];

/// The functions of windows.
pub(crate) struct WindowFunctions {
    pub(crate) surface: ash::khr::surface::Instance,
    pub(crate) swapchain: ash::khr::swapchain::Device,
    /// Fences and modes of single presents: `VK_EXT_swapchain_maintenance1`.
    pub(crate) maintenance: Option<ash::khr::get_surface_capabilities2::Instance>,
    pub(crate) hdr: Option<ash::ext::hdr_metadata::Device>,
}

impl WindowFunctions {
    /// `None` where the device has no swapchains, or the instance no windows.
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

impl Gpu {
    /// The functions of windows, or the error that says how to get them.
    pub(crate) fn window_functions(&self) -> Result<&WindowFunctions> {
        self.windows.as_ref().ok_or_else(|| {
            Error::unsupported(
                "a swapchain",
                "the context was made without a window; set ContextDesc::window",
            )
        })
    }
}

/// A window while a device is chosen, destroyed on drop.
pub(crate) struct SurfaceProbe<'a> {
    functions: ash::khr::surface::Instance,
    raw: vk::SurfaceKHR,
    instance: &'a ash::Instance,
}

impl<'a> SurfaceProbe<'a> {
    pub(crate) fn new(instance: &'a Instance, window: WindowRef<'_>) -> Result<Self> {
        Ok(Self {
            raw: create_surface(instance, window)?,
            functions: ash::khr::surface::Instance::new(&instance.entry, &instance.raw),
            instance: &instance.raw,
        })
    }

    /// The first queue family of the device for graphics, compute and this window.
    pub(crate) fn queue_family(&self, device: vk::PhysicalDevice) -> Option<u32> {
        let needed = vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE;
        // SAFETY: the device belongs to the instance.
        let families = unsafe { self.instance.get_physical_device_queue_family_properties(device) };
        let presents = |family| {
            // SAFETY: as above, and the surface too.
            unsafe { self.functions.get_physical_device_surface_support(device, family, self.raw) }
                .unwrap_or(false)
        };
        (0..).zip(&families).find_map(|(index, family)| {
            let fits = family.queue_flags.contains(needed) && presents(index);
            fits.then_some(index)
        })
    }
}

impl Drop for SurfaceProbe<'_> {
    fn drop(&mut self) {
        // SAFETY: nothing was made from the surface.
        unsafe { self.functions.destroy_surface(self.raw, None) };
    }
}

/// Makes a surface (`vkCreateXcbSurfaceKHR` and its kin). The window has to outlive it.
pub(crate) fn create_surface(instance: &Instance, window: &dyn WindowHandles) -> Result<vk::SurfaceKHR> {
    let (display, window) = (display(window)?, raw_window(window)?);
    let enabled = instance.windows.as_ref().map_or(&[][..], |windows| &windows.system);
    if required_extensions(display)?.iter().any(|name| !enabled.contains(name)) {
        let why =
            "the context was made for windows of another window system, or for none; set ContextDesc::window";
        return Err(Error::unsupported("this kind of window", why));
    }
    // SAFETY: the extensions of the window system are on, the handles belong together, and the caller keeps the window.
    unsafe { ash_window::create_surface(&instance.entry, &instance.raw, display, window, None) }
        .map_err(Error::vulkan("vkCreateSurfaceKHR"))
}

fn display(window: &dyn WindowHandles) -> Result<RawDisplayHandle> {
    window.display_handle().map(|display| display.as_raw()).map_err(no_handle)
}

fn raw_window(window: &dyn WindowHandles) -> Result<RawWindowHandle> {
    window.window_handle().map(|window| window.as_raw()).map_err(no_handle)
}

fn no_handle(error: raw_window_handle::HandleError) -> Error {
    Error::usage("window", format!("it gives no handle: {error}"))
}

fn required_extensions(display: RawDisplayHandle) -> Result<Vec<&'static CStr>> {
    let names = ash_window::enumerate_required_extensions(display).map_err(|_| {
        Error::unsupported("this kind of window", "Vulkan has no surfaces for its window system")
    })?;
    // SAFETY: the names are constants.
    Ok(names.iter().map(|name| unsafe { CStr::from_ptr(*name) }).collect())
}
