//! Makes the wide nodes of a collapsed binary tree.
//!
//! Nodes have the order of a depth-first traversal. The nodes of each [subtree](super::tree_regions) are made by one task,
//! with indices from the first. Then they are copied between those above, with the indices that follow from the sizes
//! of the parts before them.

use obvhs::cwbvh::node::CwBvhNode;
use rayon::prelude::*;

use super::binary_node::BinaryNode;
use super::collapse_cost::Decisions;
use super::tree_regions::TreeRegions;
use super::wide_node::{WideChildren, wide_node};

/// The nodes of a wide tree or of a part of one, and the primitives in the order of the leaves.
#[derive(Default)]
pub(super) struct WideTree {
    pub(super) nodes: Vec<CwBvhNode>,
    pub(super) order: Vec<u32>,
    /// Nodes on the longest path.
    pub(super) depth: usize,
}

/// Makes the wide tree of a binary tree of at least two primitives.
pub(super) fn wide_tree(nodes: &[BinaryNode], regions: &TreeRegions, decisions: &Decisions) -> WideTree {
    let mut upper = Maker::new(nodes, decisions);
    upper.make(0, |node| !regions.is_above(node));
    let part = |place: &PartPlace| {
        let mut maker = Maker::new(nodes, decisions);
        maker.make(place.root, |_| false);
        maker.tree
    };
    let parts: Vec<WideTree> = upper.parts.par_iter().map(part).collect();
    upper.assemble(&parts)
}

/// Indices of a node and of a primitive.
#[derive(Debug, Clone, Copy, Default)]
struct Offsets {
    nodes: usize,
    primitives: usize,
}

/// A part that another task makes.
#[derive(Debug, Clone, Copy)]
struct PartPlace {
    /// The node of the binary tree.
    root: u32,
    /// The index of its first node.
    slot: usize,
    /// The ends of the nodes and primitives that stand before those of the part. Its first node is not counted.
    before: Offsets,
    /// Nodes on the path to it, with its first node.
    depth: usize,
}

/// Makes wide nodes in the order of a depth-first traversal.
struct Maker<'a> {
    source: &'a [BinaryNode],
    decisions: &'a Decisions,
    tree: WideTree,
    /// Parts that other tasks make, in order.
    parts: Vec<PartPlace>,
    /// Nodes behind a part, each with the number of parts before its children and primitives.
    behind: Vec<(usize, usize)>,
}

impl<'a> Maker<'a> {
    fn new(source: &'a [BinaryNode], decisions: &'a Decisions) -> Self {
        Self { source, decisions, tree: WideTree::default(), parts: Vec::new(), behind: Vec::new() }
    }

    /// Makes the nodes from a node of the binary tree down, except those that are parts of their own.
    fn make(&mut self, root: u32, is_part: impl Fn(u32) -> bool) {
        self.tree.nodes.push(CwBvhNode::default());
        let mut open = vec![(root, 0, 1)];
        while let Some((place, slot, depth)) = open.pop() {
            if is_part(place) {
                let before = Offsets { nodes: self.tree.nodes.len(), primitives: self.tree.order.len() };
                self.parts.push(PartPlace { root: place, slot, before, depth });
                continue;
            }
            self.tree.depth = self.tree.depth.max(depth);
            if !self.parts.is_empty() {
                self.behind.push((slot, self.parts.len()));
            }
            let children = WideChildren::new(self.source, self.decisions, place);
            let first = self.tree.nodes.len();
            let node = wide_node(self.source, &children, place, first as u32, &mut self.tree.order);
            self.tree.nodes[slot] = node;
            let end = first + node.imask.count_ones() as usize;
            self.tree.nodes.resize(end, CwBvhNode::default());
            let below = (first..end).rev().zip(children.nodes().rev());
            open.extend(below.map(|(slot, child)| (child, slot, depth + 1)));
        }
    }

    /// Puts the parts between the nodes above them.
    fn assemble(mut self, parts: &[WideTree]) -> WideTree {
        let added = offsets(parts);
        for (slot, number) in &self.behind {
            let node = &mut self.tree.nodes[*slot];
            *node = moved(node, added[*number]);
        }
        for ((place, part), added) in self.parts.iter().zip(parts).zip(&added) {
            self.tree.depth = self.tree.depth.max(place.depth + part.depth - 1);
            self.tree.nodes[place.slot] = moved(&part.nodes[0], part_offset(place, *added));
        }
        let whole = added[parts.len()];
        let mut nodes: Vec<CwBvhNode> = bytemuck::zeroed_vec(self.tree.nodes.len() + whole.nodes);
        let mut order: Vec<u32> = bytemuck::zeroed_vec(self.tree.order.len() + whole.primitives);
        let own_nodes = Gaps::new(&mut nodes, &self.tree.nodes);
        let own_order = Gaps::new(&mut order, &self.tree.order);
        let nodes_of_parts = own_nodes.fill(
            self.parts.iter().zip(parts).map(|(place, part)| (place.before.nodes, part.nodes.len() - 1)),
        );
        let order_of_parts = own_order.fill(
            self.parts.iter().zip(parts).map(|(place, part)| (place.before.primitives, part.order.len())),
        );
        let targets: Vec<_> = nodes_of_parts.into_iter().zip(order_of_parts).collect();
        targets.into_par_iter().enumerate().for_each(|(number, (nodes, order))| {
            let (part, offset) = (&parts[number], part_offset(&self.parts[number], added[number]));
            order.copy_from_slice(&part.order);
            for (place, node) in nodes.iter_mut().zip(&part.nodes[1..]) {
                *place = moved(node, offset);
            }
        });
        WideTree { nodes, order, depth: self.tree.depth }
    }
}

/// Returns the numbers of nodes and primitives of the parts before each, and of all. The first node of a part has its
/// place among the nodes above.
fn offsets(parts: &[WideTree]) -> Vec<Offsets> {
    let mut all = vec![Offsets::default()];
    let mut end = Offsets::default();
    for part in parts {
        end.nodes += part.nodes.len() - 1;
        end.primitives += part.order.len();
        all.push(end);
    }
    all
}

/// Returns what to add to the indices of a part, whose second node has index 1.
fn part_offset(place: &PartPlace, added: Offsets) -> Offsets {
    Offsets {
        nodes: place.before.nodes + added.nodes - 1,
        primitives: place.before.primitives + added.primitives,
    }
}

fn moved(node: &CwBvhNode, by: Offsets) -> CwBvhNode {
    let mut node = *node;
    node.child_base_idx += by.nodes as u32;
    node.primitive_base_idx += by.primitives as u32;
    node
}

/// A slice that is filled from another one, except for gaps.
struct Gaps<'a, T> {
    target: &'a mut [T],
    source: &'a [T],
}

impl<'a, T: Copy> Gaps<'a, T> {
    fn new(target: &'a mut [T], source: &'a [T]) -> Self {
        Self { target, source }
    }

    /// Copies the source, and returns the gaps: each with the number of items of the source before it, and its length.
    fn fill(self, gaps: impl Iterator<Item = (usize, usize)>) -> Vec<&'a mut [T]> {
        let (mut rest, mut done, mut all) = (self.target, 0, Vec::new());
        for (before, length) in gaps {
            let (copied, behind) = rest.split_at_mut(before - done);
            copied.copy_from_slice(&self.source[done..before]);
            let (gap, behind) = behind.split_at_mut(length);
            all.push(gap);
            (rest, done) = (behind, before);
        }
        rest.copy_from_slice(&self.source[done..]);
        all
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use obvhs::aabb::Aabb;
    use obvhs::bvh2::Bvh2;
    use obvhs::bvh2::node::Bvh2Node;
    use obvhs::cwbvh::bvh2_to_cwbvh::bvh2_to_cwbvh;
    use proptest::prelude::*;

    use super::*;
    use crate::accel::primitive_bounds::Bounds;
    use crate::software_ray_query::bvh::morton::morton_sorted_leaves;
    use crate::software_ray_query::bvh::ploc::build_ploc;
    use crate::software_ray_query::bvh::reinsertion::reinsert_nodes;

    /// Returns the same tree for the crate `obvhs`.
    fn other_tree(nodes: &[BinaryNode], primitives: usize) -> Bvh2 {
        let mut tree = Bvh2::zeroed(primitives);
        tree.primitive_indices = (0..primitives as u32).collect();
        for (other, node) in tree.nodes.iter_mut().zip(nodes) {
            let aabb = Aabb { min: node.aabb().low, max: node.aabb().high };
            *other = Bvh2Node::new(aabb, u32::from(node.is_leaf()), node.index());
        }
        tree
    }

    proptest! {
        #[test]
        fn the_tree_is_that_of_another_collapse_for_any_regions(
            corners in prop::collection::vec((prop::array::uniform3(0.0_f32..9.0), prop::array::uniform3(0.1_f32..2.0)), 2..400),
            largest in 1..200_u32
        ) {
            let bounds = |(low, size): ([f32; 3], [f32; 3])| {
                Bounds { low: low.into(), high: Vec3::from(low) + Vec3::from(size) }
            };
            let boxes: Vec<_> = corners.into_iter().map(bounds).collect();
            let mut nodes = build_ploc(morton_sorted_leaves(&boxes));
            reinsert_nodes(&mut nodes, 0.3);
            let regions = TreeRegions::with_largest(&nodes, largest);
            let tree = wide_tree(&nodes, &regions, &Decisions::new(&nodes, &regions));
            let other = bvh2_to_cwbvh(&other_tree(&nodes, boxes.len()), 3, true, false);
            prop_assert_eq!(&tree.order, &other.primitive_indices);
            prop_assert_eq!(tree.nodes.len(), other.nodes.len());
            for (node, other) in tree.nodes.iter().zip(&other.nodes) {
                prop_assert_eq!((node.p, node.imask, node.child_meta), (other.p, other.imask, other.child_meta));
                prop_assert_eq!(node.child_base_idx, other.child_base_idx);
                prop_assert_eq!(node.primitive_base_idx, other.primitive_base_idx);
            }
            let whole_region = TreeRegions::with_largest(&nodes, u32::MAX);
            let whole = wide_tree(&nodes, &whole_region, &Decisions::new(&nodes, &whole_region));
            prop_assert!(whole.nodes == tree.nodes && whole.order == tree.order && whole.depth == tree.depth);
        }
    }
}
