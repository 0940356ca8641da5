//! Runs the kernel that builds binary trees without the rest of a build, for tests.

use std::sync::Arc;

use super::cluster_model::SortedPrimitives;
use super::collapse_model::{BelowNode, Bvh2Child, Bvh2Reference};
use crate::barrier::{Stages, Use};
use crate::command::CommandBuffer;
use crate::error::Result;
use crate::resource::Buffer;
use crate::software_ray_query::gpu_build::layout::{BlasShape, BuildSource, DECISION_BYTES, GpuBuildPlan};
use crate::software_ray_query::gpu_build::steps::cluster_step;
use crate::software_ray_query::layout::LeafKind;

/// Index of a state word, as numbered in `software_ray_query/kernels/build_params.glsl`.
const ACTIVE: usize = 6;
const BINARY_WORDS: usize = 16;
const DECISION_WORDS: usize = (DECISION_BYTES / 4) as usize;
const BOX_WORDS: usize = 6;
const LEAF: u32 = 1 << 31;

/// Sorted primitives as input of the kernel: the memory of the BLAS, followed by the scratch memory of a build.
pub(crate) struct ClusterRun<'a> {
    primitives: &'a SortedPrimitives,
    plan: GpuBuildPlan,
}

impl<'a> ClusterRun<'a> {
    /// Sets the bits of the codes to those that builds of so many primitives have.
    pub(crate) fn new(primitives: &'a SortedPrimitives) -> Result<Self> {
        Ok(Self { primitives, plan: plan(primitives.codes.len())? })
    }

    /// Returns the memory before the kernel.
    pub(crate) fn words(&self) -> Vec<u32> {
        let (plan, count) = (&self.plan, self.primitives.codes.len());
        let mut words = vec![0; ((plan.blob_bytes + plan.scratch_bytes) / 4) as usize];
        let scratch = &mut words[(plan.blob_bytes / 4) as usize..];
        scratch[ACTIVE] = count as u32;
        for (place, bounds) in self.primitives.bounds.iter().enumerate() {
            let at = plan.scratch.boxes as usize + place * BOX_WORDS;
            scratch[at..][..3].copy_from_slice(&bounds[0].map(f32::to_bits));
            scratch[at + 3..][..3].copy_from_slice(&bounds[1].map(f32::to_bits));
        }
        let keys = plan.scratch.keys as usize;
        for (place, code) in self.primitives.codes.iter().enumerate() {
            scratch[keys + place] = (code >> plan.low_bits) as u32;
            scratch[keys + count + place] = place as u32;
            if plan.low_bits > 0 {
                scratch[keys + 2 * count + place] = (code & ((1 << plan.low_bits) - 1)) as u32;
            }
        }
        scratch[plan.scratch.arrivals as usize..][..count - 1].fill(u32::MAX);
        words
    }

    pub(crate) fn record(&self, cmd: &mut CommandBuffer, target: &Arc<Buffer>, address: u64) -> Result<()> {
        cmd.use_buffer(target, Use::shader_write(Stages::COMPUTE));
        let source = BuildSource::Geometries(Vec::new());
        let job = self.plan.build_params(&source, 0, address, address + self.plan.blob_bytes);
        cmd.record_build_steps(&[job], &[cluster_step(0, 0, 1, self.plan.capacity)], std::iter::empty())
    }

    /// Returns the tree in the memory after the kernel, from the root, and the decision about each node.
    pub(crate) fn built(&self, words: &[u32]) -> (Bvh2Reference, Vec<u32>) {
        let scratch = &words[(self.plan.blob_bytes / 4) as usize..];
        let (nodes, decisions) = scratch[self.plan.scratch.binary as usize..]
            .split_at(self.plan.node_capacity() as usize * BINARY_WORDS);
        let child = |node: &[u32], which: usize| {
            let corner = |at: usize| std::array::from_fn(|axis| f32::from_bits(node[which * 8 + at + axis]));
            let reference = node[3 + which * 4];
            let below = match reference & LEAF {
                0 => BelowNode::Node(reference as usize),
                _ => BelowNode::Leaf(reference & !LEAF),
            };
            Bvh2Child { bounds: [corner(0), corner(4)], below }
        };
        let nodes = nodes.chunks_exact(BINARY_WORDS).map(|node| [child(node, 0), child(node, 1)]).collect();
        let tree = Bvh2Reference { nodes };
        let root = BelowNode::Node(words[2] as usize);
        let decision = |node: &usize| decisions[node * DECISION_WORDS + DECISION_WORDS - 1];
        let decisions = tree.preorder(root).iter().map(decision).collect();
        (tree.in_preorder(root), decisions)
    }
}

/// Returns the bits of codes in a build of `count` primitives.
pub(crate) fn code_bits(count: usize) -> Result<u32> {
    const FIRST_WORD_BITS: u32 = 30;
    Ok(FIRST_WORD_BITS + plan(count)?.low_bits)
}

fn plan(count: usize) -> Result<GpuBuildPlan> {
    let shape = BlasShape {
        leaf_kind: LeafKind::Triangles,
        primitive_count: count as u32,
        vertex_count: 0,
        geometry_count: 1,
    };
    GpuBuildPlan::blas("cluster", &shape)
}
