//! Debugging: messages of the validation layer, object names, device faults.

pub(crate) mod debugger;
pub(crate) mod device_fault;
pub(crate) mod messenger;
