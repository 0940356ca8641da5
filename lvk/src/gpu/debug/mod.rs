//! Debugging: messages of the validation layer, object names, device faults.

pub(crate) mod device_fault;
pub(crate) mod messenger;
pub(crate) mod object_names;
