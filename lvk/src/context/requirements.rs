//! Requirements of a context on the instance and the device of another engine.

use std::ffi::CStr;

use ash::vk;

use super::Context;
use super::config::ContextDesc;
use super::new::external_request;
use crate::error::Result;
use crate::gpu::requirements::DeviceRequirements;
use crate::gpu::start::instance::external_extensions;

impl Context {
    /// Returns the instance extensions that another engine enables for a context with `desc`: those of the window
    /// system of [`ContextDesc::window`], with the optional ones for presentation that the loader has, and
    /// `VK_EXT_debug_utils` where [`ContextDesc::debug_names`] is `Some(true)`. Empty without both. The instance also
    /// needs the API version 1.3.
    ///
    /// # Errors
    /// [`Unsupported`](crate::Error::Unsupported) where the loader lacks one of them.
    pub fn instance_requirements(entry: &ash::Entry, desc: &ContextDesc<'_>) -> Result<Vec<&'static CStr>> {
        external_extensions(entry, desc.window_ref(), desc.debug_names == Some(true))
    }

    /// Returns the extensions, features and queues that another engine enables on a physical device, so that
    /// [`from_raw`](Self::from_raw) can create a context with `desc`.
    ///
    /// `instance_extensions` are those that the instance was created with. The same members of `desc` count as in
    /// `from_raw`: the requests for ray tracing pipelines and ray queries, the queues, the window and the names; here
    /// also [`ContextDesc::required_features`]. See the manual's page on [interoperation](crate::manual::interop).
    ///
    /// # Safety
    /// `entry` and `instance` belong together and are alive until the requirements are dropped.
    /// `instance_extensions` were enabled at creation of the instance.
    ///
    /// # Errors
    /// [`NoDevice`](crate::Error::NoDevice) with all that the device lacks of the requirements;
    /// [`InvalidUsage`](crate::Error::InvalidUsage) for a physical device that is not of the instance, and for a window
    /// that needs an extension which is not among `instance_extensions`;
    /// [`Unsupported`](crate::Error::Unsupported) for
    /// [`RayQueryRequest::Software`](crate::RayQueryRequest::Software) without the feature `software-ray-query`.
    pub unsafe fn requirements<'a>(
        entry: &ash::Entry,
        instance: &ash::Instance,
        instance_extensions: &'a [&'a CStr],
        physical_device: vk::PhysicalDevice,
        desc: &ContextDesc<'_>,
    ) -> Result<DeviceRequirements<'a>> {
        desc.ray_query.check()?;
        desc.ray_tracing_pipeline.check()?;
        let request = external_request(desc);
        // SAFETY: by the caller's promise.
        unsafe { DeviceRequirements::query(entry, instance, instance_extensions, physical_device, &request) }
    }
}
