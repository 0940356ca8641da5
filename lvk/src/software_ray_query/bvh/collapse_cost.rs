//! Decides which nodes of a binary tree become wide nodes, which become leaves, and which vanish, at the least cost
//! (Ylitie et al., 2017, "Efficient incoherent ray traversal on GPUs through compressed wide BVHs").
//!
//! The cost of a subtree that becomes at most `n` children of a wide node follows from those of its two halves. It is
//! computed from the leaves up, first in the [subtrees](super::tree_regions) on all threads, and then above them.

use std::sync::atomic::{AtomicU64, Ordering};

use rayon::prelude::*;

use super::binary_node::BinaryNode;
use super::tree_regions::{TreeRegions, UpperNode};

/// Maximum primitives of a leaf. The node stores the count as unary in three bits.
const LARGEST_LEAF: u32 = 3;
/// Cost of a primitive's test, relative to that of a wide node.
const PRIMITIVE_COST: f32 = 0.3;
/// The numbers of children that a subtree may become: 1 to 7. The other half becomes at least one of eight.
const SHARES: usize = 7;

/// The form of a subtree in the wide tree.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// A leaf of at most three primitives.
    Leaf,
    /// A wide node.
    Node,
    /// The children of both halves.
    Halves,
}

/// The decision for a subtree that becomes at most a given number of children: the kind, and the shares of both halves.
/// A share is a number of children, less one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Decision {
    pub(super) kind: Kind,
    pub(super) shares: [usize; 2],
}

impl Decision {
    fn to_bits(self) -> u64 {
        self.kind as u64 | (self.shares[0] as u64) << 2 | (self.shares[1] as u64) << 5
    }

    fn from_bits(bits: u64) -> Self {
        let kind = match bits & 3 {
            0 => Kind::Leaf,
            1 => Kind::Node,
            _ => Kind::Halves,
        };
        Self { kind, shares: [bits >> 2 & 7, bits >> 5 & 7].map(|share| share as usize) }
    }
}

/// The decisions for all nodes of a binary tree, one byte for each number of children.
pub(super) struct Decisions(Vec<AtomicU64>);

impl Decisions {
    /// Decides for each node of the tree.
    pub(super) fn new(nodes: &[BinaryNode], regions: &TreeRegions) -> Self {
        let decisions = Self(bytemuck::zeroed_vec(nodes.len()));
        let costs: Vec<Cost> = regions
            .subtrees
            .par_iter()
            .map_init(<(Vec<u32>, Vec<Cost>)>::default, |(places, costs), root| {
                decisions.decide_subtree(nodes, *root, places, costs)
            })
            .collect();
        let mut subtrees = costs.into_iter().rev();
        let mut open = Vec::new();
        for node in regions.upper.iter().rev() {
            match node {
                UpperNode::Subtree => open.extend(subtrees.next()),
                UpperNode::Node(place) => decisions.decide(nodes, *place, &mut open),
            }
        }
        decisions
    }

    /// Returns the decision for a node that becomes at most `share + 1` children.
    pub(super) fn get(&self, node: u32, share: usize) -> Decision {
        Decision::from_bits(self.0[node as usize].load(Ordering::Relaxed) >> (8 * share))
    }

    /// Decides for each node of a subtree. `places` and `open` are memory that tasks reuse.
    fn decide_subtree(
        &self,
        nodes: &[BinaryNode],
        root: u32,
        places: &mut Vec<u32>,
        open: &mut Vec<Cost>,
    ) -> Cost {
        collect_preorder(nodes, root, places);
        open.clear();
        for place in places.iter().rev() {
            self.decide(nodes, *place, open);
        }
        open.pop().unwrap_or(Cost::ZERO)
    }

    /// Decides for a node whose children's costs are the last two of `open`, the first child's at the end. Replaces them
    /// by that of the node.
    fn decide(&self, nodes: &[BinaryNode], place: u32, open: &mut Vec<Cost>) {
        let node = &nodes[place as usize];
        if node.is_leaf() {
            open.push(Cost::of_leaf(node.aabb().half_area()));
            return;
        }
        let (Some(one), Some(other)) = (open.pop(), open.pop()) else { return };
        let (cost, bits) = decide_node(node.aabb().half_area(), &one, &other);
        self.0[place as usize].store(bits, Ordering::Relaxed);
        open.push(cost);
    }
}

/// Collects the nodes of a subtree, each before its children and the first child's before the second's.
fn collect_preorder(nodes: &[BinaryNode], root: u32, places: &mut Vec<u32>) {
    places.clear();
    let mut pending = vec![root];
    while let Some(place) = pending.pop() {
        places.push(place);
        let node = &nodes[place as usize];
        if !node.is_leaf() {
            pending.extend([node.index() + 1, node.index()]);
        }
    }
}

/// The cost of a subtree.
#[derive(Debug, Clone, Copy)]
struct Cost {
    /// The least cost as at most 1 to 7 children.
    areas: [f32; SHARES],
    /// Primitives, not counted further than [`LARGEST_LEAF`] plus one.
    primitives: u32,
}

impl Cost {
    const ZERO: Self = Self { areas: [0.0; SHARES], primitives: 0 };

    fn of_leaf(half_area: f32) -> Self {
        Self { areas: [half_area * PRIMITIVE_COST; SHARES], primitives: 1 }
    }
}

/// Returns the cost of a node with this half area and these halves, and the bits of its decisions.
fn decide_node(half_area: f32, one: &Cost, other: &Cost) -> (Cost, u64) {
    let primitives = (one.primitives + other.primitives).min(LARGEST_LEAF + 1);
    let (sums, shares) = best_shares(&one.areas, &other.areas);
    let halves = |most: usize| [shares[most] as usize, most - shares[most] as usize];
    let as_node = sums[SHARES - 1] + half_area;
    let as_leaf = if primitives <= LARGEST_LEAF {
        primitives as f32 * half_area * PRIMITIVE_COST
    } else {
        f32::INFINITY
    };
    let kind = if as_leaf < as_node { Kind::Leaf } else { Kind::Node };
    let mut decision = Decision { kind, shares: halves(SHARES - 1) };
    let mut cost = Cost { areas: [0.0; SHARES], primitives };
    cost.areas[0] = as_leaf.min(as_node);
    let mut bits = decision.to_bits();
    for most in 1..SHARES {
        let is_less = sums[most - 1] < cost.areas[most - 1];
        cost.areas[most] = if is_less { sums[most - 1] } else { cost.areas[most - 1] };
        if is_less {
            decision = Decision { kind: Kind::Halves, shares: halves(most - 1) };
        }
        bits |= decision.to_bits() << (8 * most);
    }
    (cost, bits)
}

/// Returns the least sum of the costs of two halves, and the share of the first, for each sum of their shares. Of equal
/// sums, the least share of the first is chosen.
fn best_shares(one: &[f32; SHARES], other: &[f32; SHARES]) -> ([f32; SHARES], [u8; SHARES]) {
    let (mut sums, mut shares) = ([f32::INFINITY; SHARES], [0; SHARES]);
    for both in 0..SHARES {
        for share in 0..=both {
            let sum = one[share] + other[both - share];
            if sum < sums[both] {
                (sums[both], shares[both]) = (sum, share as u8);
            }
        }
    }
    (sums, shares)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn decisions_are_read_as_written(kind in 0..3_usize, shares in prop::array::uniform2(0..SHARES)) {
            let kind = [Kind::Leaf, Kind::Node, Kind::Halves][kind];
            let decision = Decision { kind, shares };
            prop_assert_eq!(Decision::from_bits(decision.to_bits()), decision);
        }

        #[test]
        fn the_shares_have_the_least_sum(
            one in prop::array::uniform7(0.0_f32..9.0), other in prop::array::uniform7(0.0_f32..9.0)
        ) {
            let (sums, shares) = best_shares(&one, &other);
            for both in 0..SHARES {
                let least = (0..=both).map(|share| one[share] + other[both - share]).fold(f32::INFINITY, f32::min);
                let share = shares[both] as usize;
                prop_assert_eq!((sums[both], one[share] + other[both - share]), (least, least));
            }
        }
    }

    #[test]
    fn few_primitives_become_a_leaf_where_a_node_costs_more() {
        let far = Cost::of_leaf(1.0);
        let (cost, bits) = decide_node(1.5, &far, &far);
        assert_eq!((cost.areas[0], Decision::from_bits(bits).kind), (2.0 * 1.5 * PRIMITIVE_COST, Kind::Leaf));
        let (cost, bits) = decide_node(10.0, &far, &far);
        assert_eq!(
            (cost.areas[0], Decision::from_bits(bits).kind),
            (2.0 * 10.0 * PRIMITIVE_COST, Kind::Leaf)
        );
        let many = Cost { primitives: 4, ..far };
        assert_eq!(Decision::from_bits(decide_node(10.0, &many, &far).1).kind, Kind::Node);
    }
}
