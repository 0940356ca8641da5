//! Cuts a binary tree into subtrees for parallel work, and the nodes above them.

use std::collections::HashSet;

use super::binary_node::BinaryNode;

/// Subtrees of a large tree, about: enough that threads end at the same time.
const SUBTREES: u32 = 512;
/// Primitives of a subtree that is worth a task.
const MIN_SUBTREE: u32 = 256;

/// A place above or at the cut.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum UpperNode {
    /// A node above the cut.
    Node(u32),
    /// The root of the next subtree.
    Subtree,
}

/// A cut through a binary tree.
pub(super) struct TreeCut {
    /// The nodes above the cut and the places of subtrees, each parent before its children, the first child before the
    /// second.
    pub(super) upper: Vec<UpperNode>,
    /// The roots of the subtrees, in this order.
    pub(super) subtrees: Vec<u32>,
    /// The nodes above the cut.
    above: HashSet<u32>,
}

impl TreeCut {
    /// Cuts the tree. The size of subtrees depends on the tree only, not on the number of threads.
    pub(super) fn new(nodes: &[BinaryNode]) -> Self {
        let largest = (nodes[0].count() / SUBTREES).max(MIN_SUBTREE);
        let mut cut = Self { upper: Vec::new(), subtrees: Vec::new(), above: HashSet::new() };
        let mut open = vec![0];
        while let Some(place) = open.pop() {
            let node = &nodes[place as usize];
            if node.count() <= largest {
                cut.upper.push(UpperNode::Subtree);
                cut.subtrees.push(place);
            } else {
                cut.upper.push(UpperNode::Node(place));
                cut.above.insert(place);
                open.extend([node.index() + 1, node.index()]);
            }
        }
        cut
    }

    /// True if a node is above the cut.
    pub(super) fn is_above(&self, node: u32) -> bool {
        self.above.contains(&node)
    }
}
