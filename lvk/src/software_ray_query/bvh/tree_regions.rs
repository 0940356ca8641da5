//! Divides a binary tree into subtrees for parallel work, and the nodes above them.

use std::collections::HashSet;

use super::binary_node::BinaryNode;

/// Subtrees of a large tree, about: enough that threads end at the same time.
const SUBTREES: u32 = 512;
/// Primitives of a subtree that is worth a task.
const MIN_SUBTREE: u32 = 256;

/// A place above the subtrees, or the root of one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum UpperNode {
    /// A node above the subtrees.
    Node(u32),
    /// The root of the next subtree.
    Subtree,
}

/// The subtrees of a binary tree, and the nodes above them.
pub(super) struct TreeRegions {
    /// The nodes above and the places of subtrees, each parent before its children, the first child before the
    /// second.
    pub(super) upper: Vec<UpperNode>,
    /// The roots of the subtrees, in this order.
    pub(super) subtrees: Vec<u32>,
    /// The nodes above.
    above: HashSet<u32>,
}

impl TreeRegions {
    /// Divides the tree. The size of subtrees depends on the tree only, not on the number of threads.
    pub(super) fn new(nodes: &[BinaryNode]) -> Self {
        Self::with_largest(nodes, (nodes[0].count() / SUBTREES).max(MIN_SUBTREE))
    }

    /// Divides the tree above the nodes of at most `largest` primitives, at least 1.
    pub(super) fn with_largest(nodes: &[BinaryNode], largest: u32) -> Self {
        let mut regions = Self { upper: Vec::new(), subtrees: Vec::new(), above: HashSet::new() };
        let mut open = vec![0];
        while let Some(place) = open.pop() {
            let node = &nodes[place as usize];
            if node.count() <= largest {
                regions.upper.push(UpperNode::Subtree);
                regions.subtrees.push(place);
            } else {
                regions.upper.push(UpperNode::Node(place));
                regions.above.insert(place);
                open.extend([node.index() + 1, node.index()]);
            }
        }
        regions
    }

    /// True if a node is above the subtrees.
    pub(super) fn is_above(&self, node: u32) -> bool {
        self.above.contains(&node)
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::accel::primitive_bounds::Bounds;
    use crate::software_ray_query::bvh::morton::morton_sorted_leaves;
    use crate::software_ray_query::bvh::ploc::build_ploc;

    #[test]
    fn each_leaf_is_in_one_subtree() {
        let bounds =
            |at: u16| Bounds { low: Vec3::splat(f32::from(at)), high: Vec3::splat(f32::from(at + at % 5)) };
        let nodes = build_ploc(morton_sorted_leaves(&(0..500).map(bounds).collect::<Vec<_>>()));
        for largest in [1, 3, 64, 1000] {
            let regions = TreeRegions::with_largest(&nodes, largest);
            let mut seen = vec![0; 500];
            for root in &regions.subtrees {
                assert!(!regions.is_above(*root));
                let mut open = vec![*root as usize];
                while let Some(place) = open.pop() {
                    match nodes[place].is_leaf() {
                        true => seen[nodes[place].index() as usize] += 1,
                        false => open.extend(nodes[place].children()),
                    }
                }
            }
            assert_eq!(seen, vec![1; 500], "{largest}");
            let above = regions
                .upper
                .iter()
                .filter(|node| matches!(node, UpperNode::Node(place) if regions.is_above(*place)));
            assert_eq!(
                (above.count() + 1, regions.upper.len()),
                (regions.subtrees.len(), 2 * regions.subtrees.len() - 1)
            );
        }
    }
}
