//! A tree over the primitives of a mesh, in the form that suits it.

use obvhs::cwbvh::node::CwBvhNode;

use super::bvh2;
use super::bvh8;
use crate::accel::primitive_bounds::Bounds;
use crate::software_ray_query::layout::{Bvh2NodeRecord, NONE, leaf};

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

impl Bvh {
    /// The tree of a bottom-level structure: wide, but for meshes that wide nodes do not suit.
    pub(crate) fn build(bounds: &[Bounds]) -> Self {
        const ONE_LEAF: usize = 3;
        match bounds.len() {
            0 => Self { nodes: BvhNodes::Wide(Vec::new()), root: NONE, order: Vec::new() },
            count @ 1..=ONE_LEAF => {
                let order = (0..count as u32).collect();
                Self { nodes: BvhNodes::Wide(Vec::new()), root: leaf(0, count), order }
            }
            _ => bvh8::build_bvh8(bounds).unwrap_or_else(|| bvh2::build_bvh2(bounds, ONE_LEAF)),
        }
    }
}
