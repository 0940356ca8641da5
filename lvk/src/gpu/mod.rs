//! One logical device: instance, choice, features, memory, debugging. It knows no resource.

pub(crate) mod calibrated_timestamps;
pub(crate) mod caps;
pub(crate) mod debug;
pub(crate) mod device;
pub(crate) mod memory;
pub(crate) mod start;
#[cfg_attr(not(feature = "window"), path = "window_disabled.rs")]
pub(crate) mod window;

pub(crate) use device::Gpu;
