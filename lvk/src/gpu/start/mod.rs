//! The steps that create a logical device: instance, selection of a device, extensions, features.

mod built_in_profiles;
pub(crate) mod driver_workarounds;
mod drivers;
pub(crate) mod external;
pub(crate) mod feature_chain;
pub(crate) mod instance;
pub(crate) mod physical_device;
pub(crate) mod profile;
pub(crate) mod select;
#[cfg_attr(not(feature = "window"), path = "surface_disabled.rs")]
pub(crate) mod surface;
pub(crate) mod user_extensions;
#[cfg_attr(not(feature = "window"), path = "window_disabled.rs")]
pub(crate) mod window;
#[cfg(feature = "window")]
mod window_system;
