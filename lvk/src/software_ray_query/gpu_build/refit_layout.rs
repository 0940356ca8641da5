//! Refits of BLASes, built by the CPU or the GPU.

use bytemuck::Zeroable;

use super::layout::{BlobOffsets, GpuBuildPlan};
use super::params::GpuBuildParams;
use crate::software_ray_query::layout::{BLOCK_BYTES, LeafKind};

const ARRIVAL_BYTES: u64 = 4;
const PARENT_BYTES: u64 = 4;
const BOX_BYTES: u64 = 24;

/// Format of nodes, by the number in the header.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub(crate) enum NodeFormat {
    /// Eight children with bounds of 8 bits, 80 bytes.
    Wide = 0,
    /// Two children, 64 bytes.
    Binary = 1,
}

/// Layout of a BLAS to refit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct GpuRefitPlan {
    pub(crate) format: NodeFormat,
    pub(crate) leaf_kind: LeafKind,
    pub(crate) offsets: BlobOffsets,
    /// Number of nodes, or an upper bound.
    pub(crate) node_count: u32,
    /// Number of primitives in leaves, or an upper bound.
    pub(crate) primitive_count: u32,
}

impl GpuRefitPlan {
    /// Returns the plan of a BLAS that was built on the GPU.
    pub(crate) fn from_build(plan: &GpuBuildPlan) -> Self {
        Self {
            format: NodeFormat::Wide,
            leaf_kind: plan.leaf_kind,
            offsets: plan.offsets,
            node_count: plan.wide_capacity,
            primitive_count: plan.capacity,
        }
    }

    /// Returns the bytes of scratch memory, at an address that is a multiple of 16.
    pub(crate) fn scratch_bytes(&self) -> u64 {
        let boxes = if self.format == NodeFormat::Wide { BOX_BYTES } else { 0 };
        (u64::from(self.node_count) * (ARRIVAL_BYTES + PARENT_BYTES + boxes)).next_multiple_of(16)
    }

    /// Returns the parameters of the kernels for one refit. `inputs` is the address of `input_count` geometries.
    pub(crate) fn refit_params(
        &self,
        inputs: u64,
        input_count: u32,
        blob: u64,
        scratch: u64,
    ) -> GpuBuildParams {
        GpuBuildParams {
            inputs,
            blob,
            scratch,
            parents: scratch + u64::from(self.node_count) * ARRIVAL_BYTES,
            binary: blob + u64::from(self.offsets.nodes) * BLOCK_BYTES as u64,
            count: self.primitive_count,
            input_count,
            leaf_kind: self.leaf_kind as u32,
            nodes: self.offsets.nodes,
            primitives: self.offsets.primitives,
            vertices: self.offsets.vertices,
            geometries: self.offsets.geometries,
            boxes: 2 * self.node_count,
            node_capacity: self.node_count,
            ..Zeroable::zeroed()
        }
    }
}
