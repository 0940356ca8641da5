//! Stand-in for `surface.rs` in a build without the feature `window`. The surface type has no values.

use ash::vk;

use super::instance::Instance;
use super::window::WindowRef;
use crate::error::Result;

/// Stand-in for the surface of a window; never constructed.
pub(crate) enum SurfaceProbe {}

impl SurfaceProbe {
    pub(crate) fn new(_: &Instance, window: WindowRef<'_>) -> Result<Self> {
        match *window {}
    }

    pub(crate) fn presents(&self, _: vk::PhysicalDevice, _: u32) -> Result<bool> {
        match *self {}
    }

    pub(crate) fn queue_family(&self, _: vk::PhysicalDevice) -> Result<Option<u32>> {
        match *self {}
    }
}
