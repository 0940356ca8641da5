//! Acceleration structures: checked, sized and planned here, recorded by the command layer.

pub(crate) mod build;
pub(crate) mod desc;
pub(crate) mod geometry;
pub(crate) mod instance;
pub(crate) mod scratch;
pub(crate) mod scratch_buffer;
pub(crate) mod structure;

pub(crate) use structure::AccelStruct;
