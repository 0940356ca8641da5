//! Acceleration structures: checked, sized and planned here, recorded by the command layer.

pub(crate) mod accel_struct;
pub(crate) mod blas;
pub(crate) mod blas_file;
pub(crate) mod blas_refs;
pub(crate) mod build;
pub(crate) mod build_overlap;
pub(crate) mod compaction;
pub(crate) mod culling;
pub(crate) mod desc;
pub(crate) mod flags;
pub(crate) mod geometry;
pub(crate) mod instance;
pub(crate) mod instance_writing;
pub(crate) mod micromap;
pub(crate) mod micromap_desc;
pub(crate) mod partition;
pub(crate) mod primitive_bounds;
pub(crate) mod primitive_map;
mod profile_sizes;
pub(crate) mod range_allocator;
pub(crate) mod raw_accel_struct;
pub(crate) mod reorder;
pub(crate) mod scratch;
pub(crate) mod scratch_buffer;
pub(crate) mod split;
pub(crate) mod storage;
pub(crate) mod tlas;
pub(crate) mod tlas_desc;
pub(crate) mod tlas_tracker;
pub(crate) mod transform;

pub(crate) use accel_struct::AccelStruct;
