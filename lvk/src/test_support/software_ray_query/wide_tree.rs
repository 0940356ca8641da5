//! Trees of eight children in a plain form, to which those of several builders are converted.

#![allow(missing_docs, reason = "only tests and benchmarks see it")]

use bytemuck::pod_read_unaligned;
use glam::Vec3;
use obvhs::cwbvh::node::CwBvhNode;

use crate::software_ray_query::layout::{BLOCK_BYTES, BlobHeader, FORMAT_BVH8, LeafKind, LeafTriangle};

/// Children of a node.
pub const CHILDREN: usize = 8;

/// A tree over triangles. Node 0 is the root.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct WideTree {
    /// Nodes, each with its children.
    pub nodes: Vec<[WideChild; CHILDREN]>,
    /// The corners of each triangle, in the order of the leaves.
    pub triangles: Vec<[Vec3; 3]>,
}

/// A child of a node, with its bounds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WideChild {
    pub low: Vec3,
    pub high: Vec3,
    pub link: WideLink,
}

/// A place for a child: empty, a node or a leaf.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WideLink {
    /// No child.
    None,
    /// Index of a node.
    Node(u32),
    /// Triangles `first` to before `first + count`.
    Leaf { first: u32, count: u32 },
}

impl WideChild {
    /// No child.
    pub const NONE: Self = Self { low: Vec3::INFINITY, high: Vec3::NEG_INFINITY, link: WideLink::None };

    /// Decodes a child of a compressed node.
    fn of_compressed(node: &CwBvhNode, child: usize) -> Self {
        let low = [node.child_min_x[child], node.child_min_y[child], node.child_min_z[child]];
        let high = [node.child_max_x[child], node.child_max_y[child], node.child_max_z[child]];
        let unit = Vec3::from_array(node.e.map(|exponent| f32::from_bits(u32::from(exponent) << 23)));
        let point = |steps: [u8; 3]| node.p + Vec3::from_array(steps.map(f32::from)) * unit;
        let meta = u32::from(node.child_meta[child]);
        let link = if meta == 0 {
            return Self::NONE;
        } else if node.imask >> child & 1 == 1 {
            let before = u32::from(node.imask) & ((1 << child) - 1);
            WideLink::Node(node.child_base_idx + before.count_ones())
        } else {
            WideLink::Leaf { first: node.primitive_base_idx + (meta & 31), count: (meta >> 5).count_ones() }
        };
        Self { low: point(low), high: point(high), link }
    }

    /// Half of the area of the bounds.
    #[must_use]
    pub fn half_area(&self) -> f64 {
        let [x, y, z] = (self.high - self.low).to_array().map(f64::from);
        x * y + y * z + z * x
    }
}

impl WideTree {
    /// Decodes a tree of compressed nodes.
    pub(crate) fn of_compressed(
        nodes: impl Iterator<Item = CwBvhNode>,
        triangles: impl Iterator<Item = [Vec3; 3]>,
    ) -> Self {
        let children = |node: CwBvhNode| std::array::from_fn(|child| WideChild::of_compressed(&node, child));
        Self { nodes: nodes.map(children).collect(), triangles: triangles.collect() }
    }

    /// Decodes the tree of a BLAS from its bytes. `None` for a tree without wide nodes, or whose leaves have no positions.
    pub(crate) fn of_blas(bytes: &[u8]) -> Option<Self> {
        let header: BlobHeader = pod_read_unaligned(bytes.get(..size_of::<BlobHeader>())?);
        let has_triangles = header.leaf_kind == LeafKind::Triangles as u32;
        if header.format != FORMAT_BVH8 || header.node_count == 0 || !has_triangles {
            return None;
        }
        let part = |first: u32| bytes.get(first as usize * BLOCK_BYTES..);
        let nodes = part(header.nodes)?.chunks_exact(size_of::<CwBvhNode>()).map(pod_read_unaligned);
        let leaves = part(header.primitives)?.chunks_exact(size_of::<LeafTriangle>());
        let leaves = leaves.take(header.primitive_count as usize).map(pod_read_unaligned::<LeafTriangle>);
        Some(Self::of_compressed(
            nodes.take(header.node_count as usize),
            leaves.map(|leaf| [leaf.a, leaf.b, leaf.c]),
        ))
    }

    /// Returns the cost by the surface area heuristic: tests of nodes by a random ray that hits the bounds, plus 0.3 for each
    /// test of a triangle.
    #[must_use]
    pub fn sah_cost(&self) -> f64 {
        const TRIANGLE_COST: f64 = 0.3;
        let cost = |child: &WideChild| match child.link {
            WideLink::None => 0.0,
            WideLink::Node(_) => child.half_area(),
            WideLink::Leaf { count, .. } => child.half_area() * TRIANGLE_COST * f64::from(count),
        };
        let corners = || self.triangles.iter().flatten();
        let low = corners().fold(Vec3::INFINITY, |low, corner| low.min(*corner));
        let high = corners().fold(Vec3::NEG_INFINITY, |high, corner| high.max(*corner));
        let whole = WideChild { low, high, link: WideLink::Node(0) };
        1.0 + self.nodes.iter().flatten().map(cost).sum::<f64>() / whole.half_area()
    }
}
