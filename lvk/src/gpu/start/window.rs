//! The window that a context is created for, and the instance extensions it needs.

use std::ffi::CStr;
use std::fmt;

use raw_window_handle::{HasDisplayHandle, HasWindowHandle, RawDisplayHandle, RawWindowHandle};

use super::window_system;
use crate::error::{Error, Result};
use crate::gpu::caps::optional_features::{FeatureSet, OF_WINDOWS, OptionalFeature};

/// A window of any windowing library: every type that implements the traits of the crate `raw-window-handle`.
///
/// The library may hold its locks while it queries the handles and while it drops the last reference to the
/// window. Neither operation may use a context.
///
/// The surface uses the handles for as long as the library holds the value, not only while they are lent. An own
/// implementation therefore closes the window no earlier than its drop, and returns handles that belong together. Else
/// the driver uses a window that no longer exists, which is undefined behaviour.
pub trait WindowHandles: HasDisplayHandle + HasWindowHandle + Send + Sync {}

impl<T: HasDisplayHandle + HasWindowHandle + Send + Sync> WindowHandles for T {}

impl fmt::Debug for dyn WindowHandles + '_ {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("window")
    }
}

/// A window during the creation of an instance and a device.
pub(crate) type WindowRef<'a> = &'a dyn WindowHandles;

/// The instance extensions for presenting to windows.
#[derive(Debug, Clone)]
pub(crate) struct WindowExtensions {
    /// Extensions of the window system, with `VK_KHR_surface`.
    system: Vec<&'static CStr>,
    /// `VK_EXT_surface_maintenance1`, with the extension it depends on.
    maintenance: bool,
    /// `VK_EXT_swapchain_colorspace`.
    color_spaces: bool,
}

impl WindowExtensions {
    /// Returns the extensions for windows like `window`. `has` returns true for available extensions.
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

    /// Returns the extensions among those that another engine has enabled. `None` if these allow no surfaces.
    pub(super) fn enabled(names: &[&CStr]) -> Option<Self> {
        let has = |name: &CStr| names.contains(&name);
        has(ash::khr::surface::NAME).then(|| Self {
            system: window_system::all().into_iter().filter(|name| has(name)).collect(),
            maintenance: MAINTENANCE.iter().all(|name| has(name)),
            color_spaces: has(ash::ext::swapchain_colorspace::NAME),
        })
    }

    /// Returns an extension that surfaces of the window need and `enabled` lacks.
    pub(crate) fn missing(enabled: Option<&Self>, window: WindowRef<'_>) -> Result<Option<&'static CStr>> {
        let needed = required_extensions(display(window)?)?;
        let enabled = enabled.map_or(&[][..], Self::system);
        Ok(needed.into_iter().find(|name| !enabled.contains(name)))
    }

    /// Returns the extensions of the window system.
    pub(super) fn system(&self) -> &[&'static CStr] {
        &self.system
    }

    /// Returns the presentation features of a device that cannot be enabled with these extensions.
    pub(crate) fn unavailable_features(extensions: Option<&Self>) -> FeatureSet {
        match extensions {
            None => OF_WINDOWS.into_iter().collect(),
            Some(extensions) if extensions.maintenance => FeatureSet::NONE,
            Some(_) => FeatureSet::NONE.with(OptionalFeature::SwapchainMaintenance1),
        }
    }

    /// Returns the names of all the extensions.
    pub(crate) fn names(&self) -> impl Iterator<Item = &'static CStr> {
        let maintenance = if self.maintenance { &MAINTENANCE[..] } else { &[] };
        let color_spaces = self.color_spaces.then_some(ash::ext::swapchain_colorspace::NAME);
        self.system.clone().into_iter().chain(maintenance.iter().copied()).chain(color_spaces)
    }
}

const MAINTENANCE: [&CStr; 2] =
    [ash::khr::get_surface_capabilities2::NAME, ash::ext::surface_maintenance1::NAME];

pub(super) fn display(window: &dyn WindowHandles) -> Result<RawDisplayHandle> {
    window.display_handle().map(|display| display.as_raw()).map_err(no_handle)
}

pub(super) fn raw_window(window: &dyn WindowHandles) -> Result<RawWindowHandle> {
    window.window_handle().map(|window| window.as_raw()).map_err(no_handle)
}

/// True if both are the same window of the window system.
pub(crate) fn is_same_window(one: &dyn WindowHandles, other: &dyn WindowHandles) -> bool {
    matches!((raw_window(one), raw_window(other)), (Ok(one), Ok(other)) if one == other)
}

fn no_handle(error: raw_window_handle::HandleError) -> Error {
    Error::usage("window", format!("the window has no handle: {error}"))
}

pub(super) fn required_extensions(display: RawDisplayHandle) -> Result<Vec<&'static CStr>> {
    window_system::extensions(display).ok_or_else(|| {
        Error::unsupported("this kind of window", "Vulkan has no surfaces for its window system")
    })
}
