//! A BVH as its builders return it: nodes of either format, and the order of primitives in its leaves.

use obvhs::cwbvh::node::CwBvhNode;

use crate::software_ray_query::layout::Bvh2NodeRecord;

/// Nodes of either format.
pub(crate) enum BvhNodes {
    Wide(Vec<CwBvhNode>),
    Binary(Vec<Bvh2NodeRecord>),
}

/// A BVH, and the order of primitives in its leaves.
pub(crate) struct Bvh {
    pub(crate) nodes: BvhNodes,
    /// Reference to a node or a leaf, or [`NONE`].
    pub(crate) root: u32,
    /// The index of the primitive in each slot of the leaves.
    pub(crate) order: Vec<u32>,
}
