//! From host memory to the GPU.

pub(crate) mod ring;
pub(crate) mod spare;
pub(crate) mod staging;

pub(crate) use spare::SpareBuffers;
pub(crate) use staging::Staging;
