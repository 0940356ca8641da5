//! Presentation to windows. `choose` and `lifecycle` decide without a device; the other files carry out the decisions.

pub(crate) mod chain;
pub(crate) mod choose;
pub(crate) mod desc;
pub(crate) mod failure;
pub(crate) mod lifecycle;
mod present_wait;
pub(crate) mod state;
pub(crate) mod surface;
