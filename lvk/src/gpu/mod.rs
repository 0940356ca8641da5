//! One logical device: instance, selection, features, memory, debugging. It is independent of resources.

pub(crate) mod answers;
pub(crate) mod calibrated_timestamps;
pub(crate) mod caps;
pub(crate) mod checkpoints;
pub(crate) mod debug;
pub(crate) mod device;
pub(crate) mod host_clock;
pub(crate) mod memory;
pub(crate) mod object_memory;
pub(crate) mod object_names;
pub(crate) mod queries;
pub(crate) mod requirements;
pub(crate) mod start;
pub(crate) mod timestamp_scale;

pub(crate) use device::Gpu;
