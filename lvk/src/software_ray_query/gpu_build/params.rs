//! Parameters of the build kernels.

use bytemuck::{Pod, Zeroable};

/// `GpuBuildParams` of `software_ray_query/kernels/build_params.glsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
pub(crate) struct GpuBuildParams {
    pub(crate) inputs: u64,
    pub(crate) table: u64,
    pub(crate) blob: u64,
    pub(crate) scratch: u64,
    pub(crate) parents: u64,
    pub(crate) binary: u64,
    pub(crate) count: u32,
    pub(crate) input_count: u32,
    pub(crate) leaf_kind: u32,
    pub(crate) low_bits: u32,
    pub(crate) nodes: u32,
    pub(crate) primitives: u32,
    pub(crate) vertices: u32,
    pub(crate) geometries: u32,
    pub(crate) vertex_count: u32,
    pub(crate) boxes: u32,
    pub(crate) keys: u32,
    pub(crate) spare_keys: u32,
    pub(crate) digits: u32,
    pub(crate) arrivals: u32,
    pub(crate) node_capacity: u32,
    /// Not used.
    pub(crate) reserved: u32,
    pub(crate) wide_capacity: u32,
    pub(crate) header_flags: u32,
    /// Pads the record to a multiple of 16 bytes.
    pub(crate) unused: [u32; 2],
}

/// Push constants of every kernel of a build.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub(crate) struct BuildPushConstants {
    pub(crate) jobs: u64,
    pub(crate) first_job: u32,
    pub(crate) pass_or_jobs: u32,
    pub(crate) groups_of_job: u32,
    /// Pads the block to the alignment of its address.
    pub(crate) unused: u32,
}
