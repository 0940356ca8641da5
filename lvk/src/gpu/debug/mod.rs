//! Debugging: messages of the validation layer, labels, device faults.

pub(crate) mod debugger;
pub(crate) mod device_fault;
pub(crate) mod label;
pub(crate) mod messenger;
