//! Instance extensions and surfaces of each window system.

use std::ffi::CStr;

use ash::prelude::VkResult;
use ash::{khr, vk};
use raw_window_handle::{RawDisplayHandle, RawWindowHandle};

use crate::error::{Error, Result};

/// Returns the instance extensions of all window systems, and the one that they share.
pub(super) fn all() -> [&'static CStr; 7] {
    [
        khr::surface::NAME,
        khr::xlib_surface::NAME,
        khr::xcb_surface::NAME,
        khr::wayland_surface::NAME,
        khr::win32_surface::NAME,
        khr::android_surface::NAME,
        ash::ext::metal_surface::NAME,
    ]
}

/// Returns the instance extensions for windows of a display; `None` if Vulkan has no surfaces for its window system.
pub(super) fn extensions(display: RawDisplayHandle) -> Option<Vec<&'static CStr>> {
    let system = match display {
        RawDisplayHandle::Xlib(_) => khr::xlib_surface::NAME,
        RawDisplayHandle::Xcb(_) => khr::xcb_surface::NAME,
        RawDisplayHandle::Wayland(_) => khr::wayland_surface::NAME,
        RawDisplayHandle::Windows(_) => khr::win32_surface::NAME,
        RawDisplayHandle::Android(_) => khr::android_surface::NAME,
        RawDisplayHandle::AppKit(_) | RawDisplayHandle::UiKit(_) => ash::ext::metal_surface::NAME,
        _ => return None,
    };
    Some(vec![khr::surface::NAME, system])
}

/// Creates a surface (`vkCreateXcbSurfaceKHR` and the like).
///
/// # Safety
/// The extensions of the display are enabled, both handles are valid and belong together, and the window outlives the
/// surface.
pub(super) unsafe fn create_surface(
    entry: &ash::Entry,
    instance: &ash::Instance,
    display: RawDisplayHandle,
    window: RawWindowHandle,
    name: &str,
) -> Result<vk::SurfaceKHR> {
    let incomplete = || Error::usage("window", "its handle names no display, connection or program");
    let (made, call): (VkResult<vk::SurfaceKHR>, _) = match (display, window) {
        (RawDisplayHandle::Xlib(display), RawWindowHandle::Xlib(window)) => {
            let display = display.display.ok_or_else(incomplete)?;
            let info = vk::XlibSurfaceCreateInfoKHR::default().dpy(display.as_ptr()).window(window.window);
            let functions = khr::xlib_surface::Instance::new(entry, instance);
            // SAFETY: the caller promises what the call needs.
            (unsafe { functions.create_xlib_surface(&info, None) }, "vkCreateXlibSurfaceKHR")
        }
        (RawDisplayHandle::Xcb(display), RawWindowHandle::Xcb(window)) => {
            let connection = display.connection.ok_or_else(incomplete)?;
            let info = vk::XcbSurfaceCreateInfoKHR::default()
                .connection(connection.as_ptr())
                .window(window.window.get());
            let functions = khr::xcb_surface::Instance::new(entry, instance);
            // SAFETY: as above.
            (unsafe { functions.create_xcb_surface(&info, None) }, "vkCreateXcbSurfaceKHR")
        }
        (RawDisplayHandle::Wayland(display), RawWindowHandle::Wayland(window)) => {
            let info = vk::WaylandSurfaceCreateInfoKHR::default()
                .display(display.display.as_ptr())
                .surface(window.surface.as_ptr());
            let functions = khr::wayland_surface::Instance::new(entry, instance);
            // SAFETY: as above.
            (unsafe { functions.create_wayland_surface(&info, None) }, "vkCreateWaylandSurfaceKHR")
        }
        (RawDisplayHandle::Windows(_), RawWindowHandle::Win32(window)) => {
            let program = window.hinstance.ok_or_else(incomplete)?;
            let info =
                vk::Win32SurfaceCreateInfoKHR::default().hinstance(program.get()).hwnd(window.hwnd.get());
            let functions = khr::win32_surface::Instance::new(entry, instance);
            // SAFETY: as above.
            (unsafe { functions.create_win32_surface(&info, None) }, "vkCreateWin32SurfaceKHR")
        }
        (RawDisplayHandle::Android(_), RawWindowHandle::AndroidNdk(window)) => {
            let info = vk::AndroidSurfaceCreateInfoKHR::default().window(window.a_native_window.as_ptr());
            let functions = khr::android_surface::Instance::new(entry, instance);
            // SAFETY: as above.
            (unsafe { functions.create_android_surface(&info, None) }, "vkCreateAndroidSurfaceKHR")
        }
        #[cfg(target_vendor = "apple")]
        (RawDisplayHandle::AppKit(_) | RawDisplayHandle::UiKit(_), window) => {
            // SAFETY: as above.
            let layer = unsafe { metal_layer(window) }?;
            let info = vk::MetalSurfaceCreateInfoEXT::default().layer(layer.as_ptr().as_ptr().cast());
            let functions = ash::ext::metal_surface::Instance::new(entry, instance);
            // SAFETY: the layer is alive; afterwards the view keeps it.
            (unsafe { functions.create_metal_surface(&info, None) }, "vkCreateMetalSurfaceEXT")
        }
        _ => return Err(Error::usage("window", "its two handles are of different window systems")),
    };
    made.map_err(Error::vulkan(call, name))
}

/// Returns the Metal layer of a view, or puts one into the view, which then keeps it.
///
/// # Safety
/// The view exists.
#[cfg(target_vendor = "apple")]
unsafe fn metal_layer(window: RawWindowHandle) -> Result<raw_window_metal::Layer> {
    unsafe extern "C" {
        safe fn pthread_main_np() -> std::ffi::c_int;
    }
    if pthread_main_np() == 0 {
        let message =
            "macOS and iOS allow access to views on the main thread only; create context and swapchain there";
        return Err(Error::usage("window", message));
    }
    match window {
        // SAFETY: the view exists.
        RawWindowHandle::AppKit(window) => {
            Ok(unsafe { raw_window_metal::Layer::from_ns_view(window.ns_view) })
        }
        // SAFETY: as above.
        RawWindowHandle::UiKit(window) => {
            Ok(unsafe { raw_window_metal::Layer::from_ui_view(window.ui_view) })
        }
        _ => Err(Error::usage("window", "its two handles are of different window systems")),
    }
}

#[cfg(test)]
mod tests {
    use raw_window_handle::{
        AndroidDisplayHandle, AppKitDisplayHandle, HaikuDisplayHandle, UiKitDisplayHandle,
        WindowsDisplayHandle, XcbDisplayHandle, XlibDisplayHandle,
    };

    use super::*;

    #[test]
    fn each_window_system_has_its_extension() {
        for (display, system) in [
            (RawDisplayHandle::Xlib(XlibDisplayHandle::new(None, 0)), c"VK_KHR_xlib_surface"),
            (RawDisplayHandle::Xcb(XcbDisplayHandle::new(None, 0)), c"VK_KHR_xcb_surface"),
            (RawDisplayHandle::Windows(WindowsDisplayHandle::new()), c"VK_KHR_win32_surface"),
            (RawDisplayHandle::Android(AndroidDisplayHandle::new()), c"VK_KHR_android_surface"),
            (RawDisplayHandle::AppKit(AppKitDisplayHandle::new()), c"VK_EXT_metal_surface"),
            (RawDisplayHandle::UiKit(UiKitDisplayHandle::new()), c"VK_EXT_metal_surface"),
        ] {
            assert_eq!(extensions(display), Some(vec![c"VK_KHR_surface", system]));
            assert!(all().contains(&system));
        }
        assert_eq!(extensions(RawDisplayHandle::Haiku(HaikuDisplayHandle::new())), None);
    }
}
