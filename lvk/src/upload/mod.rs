//! From host memory to the GPU.

pub(crate) mod ring;
pub(crate) mod staging;

pub(crate) use staging::Staging;
