//! Pictures in windows. `decide` knows what to do, without a device; the rest does it.

pub(crate) mod chain;
pub(crate) mod course;
pub(crate) mod decide;
pub(crate) mod desc;
mod patience;
pub(crate) mod state;
pub(crate) mod surface;
