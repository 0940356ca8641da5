//! The steps that create a logical device: instance, choice of a device, extensions, features.

pub(crate) mod driver_workarounds;
pub(crate) mod external;
pub(crate) mod instance;
pub(crate) mod physical_device;
pub(crate) mod profile;
pub(crate) mod select;
pub(crate) mod surface;
pub(crate) mod user_extensions;
pub(crate) mod window;
