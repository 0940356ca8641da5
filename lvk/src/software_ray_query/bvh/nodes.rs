//! A BVH as its builders return it: nodes of either form, and the order of primitives in its leaves.

use obvhs::cwbvh::node::CwBvhNode;

use crate::software_ray_query::layout::Bvh2NodeRecord;

/// Nodes of either form.
pub(crate) enum BvhNodes {
    Wide(Vec<CwBvhNode>),
    Binary(Vec<Bvh2NodeRecord>),
}

/// A tree, and the order of primitives in its leaves.
pub(crate) struct Bvh {
    pub(crate) nodes: BvhNodes,
    /// A node or a leaf, or [`NONE`].
    pub(crate) root: u32,
    /// For each place in the leaves which primitive stands there.
    pub(crate) order: Vec<u32>,
}
