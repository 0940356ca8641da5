//! Pictures in windows. `decide` knows what to do, without a device; the rest does it.

pub(crate) mod chain;
pub(crate) mod choose;
pub(crate) mod desc;
pub(crate) mod lifecycle;
mod present_wait;
pub(crate) mod state;
pub(crate) mod surface;
