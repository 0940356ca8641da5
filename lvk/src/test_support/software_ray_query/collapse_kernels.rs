//! Runs the kernels that collapse binary nodes to wide ones without the rest of a build, for tests.

use std::sync::Arc;

use super::collapse_model::{BelowNode, Bvh2Reference, Bvh8Child, Bvh8Reference};
use crate::barrier::{Stages, Use};
use crate::command::CommandBuffer;
use crate::error::Result;
use crate::kernels::Kernel;
use crate::resource::Buffer;
use crate::software_ray_query::gpu_build::layout::{BlasShape, BuildSource, DECISION_BYTES, GpuBuildPlan};
use crate::software_ray_query::gpu_build::steps::wide_steps;
use crate::software_ray_query::layout::LeafKind;

/// Indices of state words, as numbered in `software_ray_query/kernels/build_params.glsl`.
const ACTIVE: usize = 6;
const WIDE_NODES: usize = 8;
const END_BYTES: usize = 9;
const BINARY_WORDS: usize = 16;
const WIDE_WORDS: usize = 20;
const DECISION_WORDS: usize = (DECISION_BYTES / 4) as usize;

/// A binary tree as input of the kernels: the memory of the BLAS, followed by the scratch memory of a build.
pub(crate) struct Collapser<'a> {
    tree: &'a Bvh2Reference,
    plan: GpuBuildPlan,
}

impl<'a> Collapser<'a> {
    pub(crate) fn new(tree: &'a Bvh2Reference) -> Result<Self> {
        let shape = BlasShape {
            leaf_kind: LeafKind::Triangles,
            primitive_count: tree.nodes.len() as u32 + 1,
            vertex_count: 0,
            geometry_count: 1,
        };
        Ok(Self { tree, plan: GpuBuildPlan::blas("collapse", &shape)? })
    }

    fn bytes(&self) -> u64 {
        self.plan.blob_bytes + self.plan.scratch_bytes
    }

    /// Returns the capacity for wide nodes.
    pub(crate) fn buffer_bytes(&self) -> usize {
        self.plan.wide_capacity as usize
    }

    /// Returns the memory before the kernels.
    pub(crate) fn words(&self) -> Vec<u32> {
        let mut words = vec![0; (self.bytes() / 4) as usize];
        let scratch = &mut words[(self.plan.blob_bytes / 4) as usize..];
        scratch[ACTIVE] = self.plan.capacity;
        (scratch[WIDE_NODES], scratch[END_BYTES]) = (1, 1);
        let nodes = scratch[self.plan.scratch.binary as usize..].chunks_exact_mut(BINARY_WORDS);
        for (words, node) in nodes.zip(&self.tree.nodes) {
            for (which, child) in node.iter().enumerate() {
                for (corner, at) in child.bounds.iter().zip([which * 8, which * 8 + 4]) {
                    words[at..at + 3].copy_from_slice(&corner.map(f32::to_bits));
                }
                words[3 + which * 4] = match child.below {
                    BelowNode::Node(node) => node as u32,
                    BelowNode::Leaf(number) => 1 << 31 | number,
                };
                words[11 + which * 4] = self.tree.shape(child.below).packed();
            }
        }
        let decisions = self.plan.scratch.binary as usize + self.tree.nodes.len() * BINARY_WORDS;
        let places = scratch[decisions..].chunks_exact_mut(DECISION_WORDS);
        for (words, decided) in places.zip(self.tree.decided()) {
            words[DECISION_WORDS - 1] = decided.decision;
        }
        let counts = &mut scratch[self.plan.scratch.parents as usize..];
        counts.iter_mut().zip(self.tree.primitive_counts()).for_each(|(word, count)| *word = count);
        words
    }

    pub(crate) fn record(&self, cmd: &mut CommandBuffer, target: &Arc<Buffer>, address: u64) -> Result<()> {
        cmd.use_buffer(target, Use::shader_write(Stages::COMPUTE));
        let source = BuildSource::Geometries(Vec::new());
        let job = self.plan.build_params(&source, 0, address, address + self.plan.blob_bytes);
        let mut steps = wide_steps(0, 0, &self.plan);
        steps.retain(|step| step.kernel == Kernel::Collapse);
        cmd.record_build_steps(&[job], &steps, std::iter::empty())
    }

    /// Returns the tree in the memory after the kernels; `None` if it did not fit.
    pub(crate) fn collapsed(&self, words: &[u32]) -> Option<Bvh8Reference> {
        let scratch = &words[(self.plan.blob_bytes / 4) as usize..];
        let order = &scratch[self.plan.scratch.spare_keys as usize..];
        let nodes = &words[self.plan.offsets.nodes as usize * 4..];
        (scratch[WIDE_NODES] <= self.plan.wide_capacity).then(|| wide(nodes, order, 0))
    }
}

fn wide(nodes: &[u32], order: &[u32], number: u32) -> Bvh8Reference {
    let node = &nodes[number as usize * WIDE_WORDS..][..WIDE_WORDS];
    let inner = node[3] >> 24;
    let child = |child: usize| {
        let meta = node[6 + child / 4] >> (child % 4 * 8) & 0xff;
        let before = (inner & ((1 << child) - 1)).count_ones();
        let first = (node[5] + (meta & 31)) as usize;
        match (meta, inner >> child & 1) {
            (0, _) => Bvh8Child::None,
            (_, 1) => Bvh8Child::Node(Box::new(wide(nodes, order, node[4] + before))),
            _ => Bvh8Child::Leaf(order[first..][..(meta >> 5).count_ones() as usize].to_vec()),
        }
    };
    Bvh8Reference { children: std::array::from_fn(child) }
}
