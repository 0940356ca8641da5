//! A tree over the primitives of a mesh, in the form that suits it.

use obvhs::cwbvh::node::CwBvhNode;

use super::bvh2;
use super::bvh8;
use crate::accel::primitive_bounds::Bounds;
use crate::software_ray_query::layout::{BinaryNode, NONE, leaf};

/// Nodes of either form.
pub(crate) enum Nodes {
    Wide(Vec<CwBvhNode>),
    Binary(Vec<BinaryNode>),
}

/// A tree, and the order of primitives in its leaves.
pub(crate) struct Tree {
    pub(crate) nodes: Nodes,
    /// A node or a leaf, or [`NONE`].
    pub(crate) root: u32,
    /// For each place in the leaves which primitive stands there.
    pub(crate) order: Vec<u32>,
}

impl Tree {
    /// The tree of a bottom-level structure: wide, but for meshes that wide nodes do not suit.
    pub(crate) fn of_mesh(bounds: &[Bounds]) -> Self {
        const ONE_LEAF: usize = 3;
        match bounds.len() {
            0 => Self { nodes: Nodes::Wide(Vec::new()), root: NONE, order: Vec::new() },
            count @ 1..=ONE_LEAF => {
                let order = (0..count as u32).collect();
                Self { nodes: Nodes::Wide(Vec::new()), root: leaf(0, count), order }
            }
            _ => bvh8::build(bounds).unwrap_or_else(|| bvh2::build(bounds, ONE_LEAF)),
        }
    }
}
