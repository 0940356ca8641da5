//! Improves a binary tree by moving nodes to better parents (Meister and Bittner, 2018, "Parallel reinsertion for
//! bounding volume hierarchy optimization").
//!
//! All threads search positions in an unchanged tree. Then the moves are applied, the best first; a move that touches a
//! node of an earlier one waits for the next round. So the result is the same for any number of threads.

use std::sync::atomic::{AtomicU32, Ordering};

use rayon::prelude::*;

use super::binary_node::{Aabb, BinaryNode, sibling};
use super::build_threads::TASK_LENGTH;

/// Rounds of moves. Round `n` moves a share of the nodes that is divided by `2 n + 1`, so that later rounds improve the
/// top of the tree.
const ROUNDS: usize = 16;
/// Searches of one task.
const TASK_SEARCHES: usize = 64;

/// Moves nodes of a tree to positions where the sum of all areas is less: at most `share` of the nodes in the first
/// round. Children must be behind their parents, and are anywhere afterwards.
pub(super) fn reinsert_nodes(nodes: &mut [BinaryNode], share: f32) {
    if nodes.len() < 3 || share <= 0.0 {
        return;
    }
    let mut tree = LinkedTree { parents: pair_parents(nodes), nodes };
    let mut touched = vec![false; tree.nodes.len()];
    for round in 0..ROUNDS {
        let batch = tree.nodes.len() as f32 * share / (2 * round + 1) as f32;
        let count = (batch as usize).clamp(1, tree.nodes.len() - 1);
        let candidates = largest_nodes(tree.nodes, count);
        let moves = tree.find_moves(&candidates);
        touched.fill(false);
        moves.iter().for_each(|best| tree.apply(best, &mut touched));
    }
    tree.count_primitives();
}

/// Returns the parent of each pair of siblings.
fn pair_parents(nodes: &[BinaryNode]) -> Vec<AtomicU32> {
    let parents: Vec<AtomicU32> = bytemuck::zeroed_vec(nodes.len() / 2);
    nodes.par_iter().enumerate().with_min_len(TASK_LENGTH).for_each(|(place, node)| {
        if !node.is_leaf() {
            parents[pair_of(node.children()[0])].store(place as u32, Ordering::Relaxed);
        }
    });
    parents
}

/// The number of a node's pair. The root has none.
fn pair_of(node: usize) -> usize {
    (node - 1) / 2
}

/// Returns the `count` nodes with the largest area of the first two times as many, in the order of the tree. The first
/// nodes are those near the root.
fn largest_nodes(nodes: &[BinaryNode], count: usize) -> Vec<u32> {
    // Areas are never negative, so that their bits have the same order.
    let key = |(place, node): (usize, &BinaryNode)| {
        u64::from(!node.aabb().half_area().to_bits()) << 32 | place as u64
    };
    let first = nodes[..(2 * (count + 1)).min(nodes.len())].par_iter().enumerate().skip(1);
    let keys: Vec<u64> = first.with_min_len(TASK_LENGTH).map(key).collect();
    let limit = if count < keys.len() { *keys.clone().select_nth_unstable(count).1 } else { u64::MAX };
    keys.into_par_iter().with_min_len(TASK_LENGTH).filter(|key| *key < limit).map(|key| key as u32).collect()
}

/// A position where a node costs less.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Move {
    node: u32,
    /// The node that becomes the sibling of `node`.
    to: u32,
    /// The area that is saved.
    saved: f32,
}

/// The node whose position is searched.
struct MovedNode {
    aabb: Aabb,
    area: f32,
}

/// A tree with links to parents.
struct LinkedTree<'a> {
    nodes: &'a mut [BinaryNode],
    /// The parent of each pair of siblings. Many threads write them at first.
    parents: Vec<AtomicU32>,
}

impl LinkedTree<'_> {
    /// Returns a move of each candidate that saves area, the best first.
    fn find_moves(&self, candidates: &[u32]) -> Vec<Move> {
        let mut moves: Vec<Move> = candidates
            .par_chunks(TASK_SEARCHES)
            .flat_map_iter(|candidates| {
                let mut open = Vec::with_capacity(128);
                let found = |node: &u32| self.best_move(*node as usize, &mut open);
                candidates.iter().filter_map(found).collect::<Vec<_>>()
            })
            .collect();
        moves.par_sort_unstable_by(|one, other| {
            other.saved.total_cmp(&one.saved).then(one.node.cmp(&other.node))
        });
        moves
    }

    /// Writes the number of primitives of each inner node, which moves have changed.
    fn count_primitives(&mut self) {
        let sums: Vec<AtomicU32> = bytemuck::zeroed_vec(self.nodes.len() / 2);
        let counts: Vec<AtomicU32> = bytemuck::zeroed_vec(self.nodes.len());
        self.nodes.par_iter().enumerate().with_min_len(TASK_LENGTH).for_each(|(mut place, node)| {
            let mut count = 1;
            // The second of two siblings that is counted goes on with their parent.
            while place != 0 && node.is_leaf() {
                let beside = sums[pair_of(place)].fetch_add(count, Ordering::Relaxed);
                if beside == 0 {
                    break;
                }
                place = self.parent(place);
                count += beside;
                counts[place].store(count, Ordering::Relaxed);
            }
        });
        let inner = self.nodes.par_iter_mut().zip(counts).with_min_len(TASK_LENGTH);
        inner
            .filter(|(node, _)| !node.is_leaf())
            .for_each(|(node, count)| node.set_count(count.into_inner()));
    }

    fn parent(&self, node: usize) -> usize {
        self.parents[pair_of(node)].load(Ordering::Relaxed) as usize
    }

    /// Returns the best move of a node. `open` is memory for the search.
    ///
    /// Without the node, its parent is gone and the ancestors are smaller. At the new position, there is a new parent
    /// and the ancestors are larger. The search goes up from the node, and from each ancestor down to the other side,
    /// as long as the node without enlarged ancestors would save more than the best position so far.
    fn best_move(&self, node: usize, open: &mut Vec<(f32, u32)>) -> Option<Move> {
        let aabb = self.nodes[node].aabb();
        let moved = MovedNode { aabb, area: aabb.half_area() };
        let parent = self.parent(node);
        let mut best = Move { node: node as u32, to: 0, saved: 0.0 };
        let (mut ancestor, mut side) = (parent, sibling(node));
        let mut saved = self.nodes[parent].aabb().half_area();
        let mut rest = self.nodes[side].aabb();
        loop {
            if saved - moved.area > best.saved {
                self.search_below(&moved, saved, side, open, &mut best);
            }
            if ancestor != parent {
                rest = rest.union(self.nodes[side].aabb());
                saved += self.nodes[ancestor].aabb().half_area() - rest.half_area();
            }
            if ancestor == 0 {
                break;
            }
            side = sibling(ancestor);
            ancestor = self.parent(ancestor);
        }
        let is_move = best.saved > 0.0 && ![sibling(node), parent].contains(&(best.to as usize));
        is_move.then_some(best)
    }

    /// Searches a subtree, with the area that is saved above it.
    fn search_below(
        &self,
        moved: &MovedNode,
        saved: f32,
        top: usize,
        open: &mut Vec<(f32, u32)>,
        best: &mut Move,
    ) {
        let Some(below) = self.consider(moved, saved, top as u32, best) else { return };
        open.push(below);
        while let Some((saved, first)) = open.pop() {
            if saved - moved.area <= best.saved {
                continue;
            }
            let one = self.consider(moved, saved, first, best);
            let other = self.consider(moved, saved, first + 1, best);
            open.extend(one.into_iter().chain(other));
        }
    }

    /// Tries a position. Returns the area that is saved above the children and the first child, unless the node is a
    /// leaf or nothing below can be better than the best.
    fn consider(&self, moved: &MovedNode, saved: f32, place: u32, best: &mut Move) -> Option<(f32, u32)> {
        let node = &self.nodes[place as usize];
        let aabb = node.aabb();
        let saved = saved - aabb.union(moved.aabb).half_area();
        if saved > best.saved {
            (best.to, best.saved) = (place, saved);
        }
        let below = saved + aabb.half_area();
        (!node.is_leaf() && below - moved.area > best.saved).then(|| (below, node.index()))
    }

    /// Applies a move, unless an earlier one touched the same nodes.
    fn apply(&mut self, best: &Move, touched: &mut [bool]) {
        let (node, to) = (best.node as usize, best.to as usize);
        let beside = sibling(node);
        let parent = self.parent(node);
        let above = if to == 0 { 0 } else { self.parent(to) };
        let nodes = [to, node, beside, above, parent];
        if nodes.iter().any(|node| touched[*node]) {
            return;
        }
        nodes.iter().for_each(|node| touched[*node] = true);
        // The pair of the node and its sibling moves below `to`, and the sibling's content to the old parent.
        let (moved, left) = (self.nodes[to], self.nodes[beside]);
        let first = node.min(beside) as u32;
        self.put(beside, moved);
        self.put(parent, left);
        self.nodes[to] = BinaryNode::parent_of(&self.nodes[node], &moved, first);
        *self.parents[pair_of(node)].get_mut() = to as u32;
        self.refit_above(to);
        self.refit_above(parent);
    }

    /// Writes a node to another place, and the link of its children.
    fn put(&mut self, place: usize, node: BinaryNode) {
        self.nodes[place] = node;
        if !node.is_leaf() {
            *self.parents[pair_of(node.children()[0])].get_mut() = place as u32;
        }
    }

    /// Recomputes the AABBs of the ancestors of a node, up to the first that stays.
    fn refit_above(&mut self, mut place: usize) {
        while place != 0 {
            place = self.parent(place);
            let [one, other] = self.nodes[place].children();
            let aabb = self.nodes[one].aabb().union(self.nodes[other].aabb());
            if aabb == self.nodes[place].aabb() {
                return;
            }
            self.nodes[place].set_aabb(aabb);
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use proptest::prelude::*;

    use super::*;
    use crate::accel::primitive_bounds::Bounds;
    use crate::software_ray_query::bvh::morton::morton_sorted_leaves;
    use crate::software_ray_query::bvh::ploc::build_ploc;

    /// Returns the sum of all areas. Fails unless each node has the union of its children, and each primitive one leaf.
    fn checked_area(nodes: &[BinaryNode], primitives: usize) -> f64 {
        let (mut open, mut seen, mut sum) = (vec![0], vec![false; primitives], 0.0);
        while let Some(place) = open.pop() {
            let node: &BinaryNode = &nodes[place];
            sum += f64::from(node.aabb().half_area());
            if node.is_leaf() {
                assert!(!std::mem::replace(&mut seen[node.index() as usize], true));
                continue;
            }
            let children = node.children().map(|child| nodes[child].count());
            assert_eq!(node.count(), children.iter().sum());
            let [one, other] = node.children();
            assert_eq!(node.aabb(), nodes[one].aabb().union(nodes[other].aabb()));
            open.extend([one, other]);
        }
        assert!(seen.into_iter().all(|seen| seen));
        sum
    }

    fn bounds((low, size): ([f32; 3], [f32; 3])) -> Bounds {
        Bounds { low: low.into(), high: Vec3::from(low) + Vec3::from(size) }
    }

    proptest! {
        /// Moves of one round may hinder each other, so that few of them may cost area.
        #[test]
        fn moves_keep_the_tree(
            corners in prop::collection::vec(
                (prop::array::uniform3(0.0_f32..9.0), prop::array::uniform3(0.0_f32..4.0)), 1..300
            ),
            share in 0.0_f32..1.5
        ) {
            let boxes: Vec<_> = corners.into_iter().map(bounds).collect();
            let mut nodes = build_ploc(morton_sorted_leaves(&boxes));
            let before = checked_area(&nodes, boxes.len());
            reinsert_nodes(&mut nodes, share);
            prop_assert!(checked_area(&nodes, boxes.len()) <= before * 1.2);
        }
    }

    #[test]
    fn moves_save_area() {
        let share = |number: u16| f32::from(number.wrapping_mul(40_503)) / f32::from(u16::MAX);
        let place = |number: u16| [0, 1, 2].map(|axis| share(number * 3 + axis) * 100.0);
        let boxes: Vec<_> =
            (0..3000).map(|number| bounds((place(number), [share(number + 7) * 30.0; 3]))).collect();
        let mut nodes = build_ploc(morton_sorted_leaves(&boxes));
        let before = checked_area(&nodes, boxes.len());
        reinsert_nodes(&mut nodes, 0.1);
        let after = checked_area(&nodes, boxes.len());
        assert!(after < before, "{after} of {before}");
    }

    #[test]
    fn a_node_in_the_wrong_subtree_moves_to_its_neighbour() {
        let at = |x: f32| Bounds { low: Vec3::splat(x), high: Vec3::splat(x + 1.0) };
        let leaf = |primitive: u32, x: f32| BinaryNode::leaf(&at(x), primitive);
        let mut nodes = vec![leaf(0, 0.0); 7];
        nodes[3..].copy_from_slice(&[leaf(0, 0.0), leaf(1, 100.0), leaf(2, 101.0), leaf(3, 103.0)]);
        (nodes[1], nodes[2]) =
            (BinaryNode::parent_of(&nodes[3], &nodes[4], 3), BinaryNode::parent_of(&nodes[5], &nodes[6], 5));
        nodes[0] = BinaryNode::parent_of(&nodes[1], &nodes[2], 1);
        reinsert_nodes(&mut nodes, 1.0);
        checked_area(&nodes, 4);
        let alone = nodes[0].children().into_iter().find(|child| nodes[*child].is_leaf());
        assert_eq!(alone.map(|child| nodes[child].index()), Some(0));
    }
}
