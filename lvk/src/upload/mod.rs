//! From host memory to the GPU.

mod page_set;
mod pages;
pub(crate) mod pending;
pub(crate) mod pieces;
pub(crate) mod spare;
pub(crate) mod staging;

pub(crate) use pending::PendingUploads;
pub(crate) use spare::SpareBuffers;
pub(crate) use staging::Staging;
