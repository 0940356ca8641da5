//! The names of `surface.rs` in a build without the feature `window`: the type of a surface has no values.

use ash::vk;

use super::instance::Instance;
use super::window::WindowRef;
use crate::error::Result;

/// A window while a device is chosen: there is none.
pub(crate) enum SurfaceProbe {}

impl SurfaceProbe {
    pub(crate) fn new(_: &Instance, window: WindowRef<'_>) -> Result<Self> {
        match *window {}
    }

    pub(crate) fn queue_family(&self, _: vk::PhysicalDevice) -> Option<u32> {
        match *self {}
    }
}
