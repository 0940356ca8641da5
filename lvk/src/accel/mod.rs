//! Acceleration structures: checked, sized and planned here, recorded by the command layer.

pub(crate) mod blas;
pub(crate) mod blob;
pub(crate) mod bounds;
pub(crate) mod build;
pub(crate) mod build_run;
pub(crate) mod compaction;
pub(crate) mod culling;
pub(crate) mod cut;
pub(crate) mod desc;
pub(crate) mod flags;
pub(crate) mod geometry;
pub(crate) mod instance;
pub(crate) mod instance_plan;
pub(crate) mod order;
pub(crate) mod primitive_map;
pub(crate) mod ranges;
pub(crate) mod raw_structure;
pub(crate) mod scratch;
pub(crate) mod scratch_buffer;
pub(crate) mod shown;
mod size_model;
pub(crate) mod software;
pub(crate) mod split;
pub(crate) mod storage;
pub(crate) mod structure;
pub(crate) mod tlas;
pub(crate) mod tlas_updates;

pub(crate) use structure::AccelStruct;
