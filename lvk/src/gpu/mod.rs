//! One logical device: instance, choice, features, memory, debugging. It knows no resource.

pub(crate) mod budget;
pub(crate) mod caps;
pub(crate) mod clock;
pub(crate) mod debug;
pub(crate) mod descriptor_limits;
pub(crate) mod device;
pub(crate) mod device_changes;
pub(crate) mod extensions;
pub(crate) mod extra;
#[cfg(feature = "test-hooks")]
pub(crate) mod failing;
pub(crate) mod fault;
pub(crate) mod features;
pub(crate) mod foreign;
pub(crate) mod format_features;
pub(crate) mod host_copy;
mod image_limits;
pub(crate) mod instance;
pub(crate) mod limits;
pub(crate) mod memory;
pub(crate) mod mesh_limits;
mod naming;
pub(crate) mod optional;
pub(crate) mod profile;
pub(crate) mod queues;
pub(crate) mod ray_query_path;
pub(crate) mod resolve_modes;
pub(crate) mod select;
pub(crate) mod shading_rate;
#[cfg(feature = "test-hooks")]
pub(crate) mod silent;
mod slab;
pub(crate) mod window;

pub(crate) use device::Gpu;
