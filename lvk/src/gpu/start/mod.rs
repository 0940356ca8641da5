//! The steps that create a logical device: instance, choice of a device, extensions, features.

pub(crate) mod driver_workarounds;
pub(crate) mod extensions;
pub(crate) mod external;
pub(crate) mod features;
pub(crate) mod instance;
pub(crate) mod profile;
pub(crate) mod select;
pub(crate) mod user_extensions;
