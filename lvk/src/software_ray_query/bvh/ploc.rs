//! Binary trees by parallel locally ordered clustering (Meister and Bittner, 2018), in O(n log n) for any bounds.
//!
//! Nodes are sorted along a Morton curve. In each round, every node searches the neighbour whose union with it has the
//! least area, and two nodes that choose each other become one. If each node chooses its successor, as nested bounds
//! do, a round would merge one pair only. Such a round also pairs by position, so that every round removes a share of
//! the nodes.
//!
//! The tasks of a round are chunks of nodes. Their places in the results follow from sums over the chunks before, and so
//! the tree is the same for any number of threads.

use rayon::prelude::*;

use super::binary_node::BinaryNode;
use super::build_threads::TASK_LENGTH;
use super::partners::{MAX_REACH, find_partners};

/// Rounds that search the direct neighbours only; they pair most small nodes.
const SHORT_SEARCH_ROUNDS: usize = 2;
/// A round that pairs less than one in this many nodes also pairs direct neighbours.
const MIN_PAIRED_FRACTION: usize = 32;
/// Largest node count at which rounds pair mutual choices only.
const FINAL_NODE_COUNT: usize = 32;

/// Builds a tree of at least one leaf. Children are behind their parents.
pub(super) fn build_ploc(leaves: Vec<BinaryNode>) -> Vec<BinaryNode> {
    cluster_counting_searches(leaves).0
}

/// Returns the tree, and the number of searches over all rounds: at most [`MIN_PAIRED_FRACTION`] for each leaf.
fn cluster_counting_searches(mut nodes: Vec<BinaryNode>) -> (Vec<BinaryNode>, usize) {
    let count = nodes.len();
    let mut tree: Vec<BinaryNode> = bytemuck::zeroed_vec((2 * count).saturating_sub(1));
    let mut partners: Vec<u32> = bytemuck::zeroed_vec(count);
    // Both sequences keep their memory: the system takes time to give new memory and to take it back.
    let mut next = Vec::new();
    let (mut rounds, mut searches, mut free) = (0, 0, tree.len());
    while nodes.len() > 1 {
        let partners = &mut partners[..nodes.len()];
        find_partners(&nodes, if rounds < SHORT_SEARCH_ROUNDS { 1 } else { MAX_REACH }, partners);
        let mut tasks = count_pairs(partners);
        if is_pairing_needed(partners.len(), &tasks) {
            pair_neighbours(partners);
            tasks = count_pairs(partners);
        }
        merge_pairs(&nodes, partners, &tasks, &mut tree[..free], &mut next);
        free -= 2 * (nodes.len() - next.len());
        searches += nodes.len();
        rounds += 1;
        std::mem::swap(&mut nodes, &mut next);
    }
    if let (Some(root), [node]) = (tree.first_mut(), &nodes[..]) {
        *root = *node;
    }
    (tree, searches)
}

/// The pairs of a task's nodes.
#[derive(Clone, Copy)]
struct TaskPairs {
    /// Nodes whose partner is before them.
    merged: usize,
    /// Nodes whose partner is behind them, which leave the sequence.
    removed: usize,
}

fn is_mutual(partners: &[u32], place: usize) -> bool {
    partners[partners[place] as usize] as usize == place
}

fn count_pairs(partners: &[u32]) -> Vec<TaskPairs> {
    let count = |task: usize| {
        let mut pairs = TaskPairs { merged: 0, removed: 0 };
        let first = task * TASK_LENGTH;
        for place in first..(first + TASK_LENGTH).min(partners.len()) {
            let (is_found, is_before) = (is_mutual(partners, place), (partners[place] as usize) < place);
            pairs.merged += usize::from(is_found && is_before);
            pairs.removed += usize::from(is_found && !is_before);
        }
        pairs
    };
    (0..partners.len().div_ceil(TASK_LENGTH)).into_par_iter().map(count).collect()
}

/// True if too few nodes chose each other. This happens if each node chooses its successor.
fn is_pairing_needed(count: usize, tasks: &[TaskPairs]) -> bool {
    let pairs: usize = tasks.iter().map(|task| task.merged).sum();
    count > FINAL_NODE_COUNT && pairs * MIN_PAIRED_FRACTION < count
}

/// Pairs unpaired direct neighbours.
fn pair_neighbours(partners: &mut [u32]) {
    for place in (0..partners.len() - 1).step_by(2) {
        if !is_mutual(partners, place) && !is_mutual(partners, place + 1) {
            partners[place] = place as u32 + 1;
            partners[place + 1] = place as u32;
        }
    }
}

/// Merges each pair to one node, and writes the remaining nodes to `next`. The children are written to the end of
/// `free`.
fn merge_pairs(
    nodes: &[BinaryNode],
    partners: &[u32],
    tasks: &[TaskPairs],
    free: &mut [BinaryNode],
    next: &mut Vec<BinaryNode>,
) {
    let remaining = nodes.len() - tasks.iter().map(|task| task.removed).sum::<usize>();
    if next.len() < remaining {
        *next = bytemuck::zeroed_vec(remaining);
    }
    next.truncate(remaining);
    let (mut places, mut space) = (&mut next[..], free);
    let mut work = Vec::with_capacity(tasks.len());
    for (task, pairs) in tasks.iter().enumerate() {
        let range = task * TASK_LENGTH..((task + 1) * TASK_LENGTH).min(nodes.len());
        let (of_task, rest) = places.split_at_mut(range.len() - pairs.removed);
        let (free, children) = space.split_at_mut(space.len() - 2 * pairs.merged);
        work.push((range, of_task, free.len(), children));
        (places, space) = (rest, free);
    }
    work.into_par_iter().for_each(|(range, next, first_child, children)| {
        let mut end = children.len();
        let mut next = next.iter_mut();
        let mut push = |node| next.next().into_iter().for_each(|place| *place = node);
        for place in range {
            let other = partners[place] as usize;
            if !is_mutual(partners, place) {
                push(nodes[place]);
            } else if other < place {
                end -= 2;
                (children[end], children[end + 1]) = (nodes[other], nodes[place]);
                push(BinaryNode::parent_of(&nodes[other], &nodes[place], (first_child + end) as u32));
            }
        }
    });
}

#[cfg(test)]
mod tests {
    use glam::{Vec3A, vec3a};
    use proptest::prelude::*;

    use super::*;
    use crate::accel::primitive_bounds::Bounds;
    use crate::software_ray_query::bvh::binary_node::Aabb;
    use crate::software_ray_query::bvh::build_threads::on_new_threads;
    use crate::software_ray_query::bvh::morton::morton_sorted_leaves;

    const COUNT: usize = 24_000;

    fn place(low: Vec3A, size: Vec3A) -> Bounds {
        Bounds { low: low.into(), high: (low + size).into() }
    }

    /// Returns a pseudo-random number below 1 for each `number`.
    fn paired_share(number: usize) -> f32 {
        (number as u32).wrapping_mul(0x9e37_79b9) as f32 / u32::MAX as f32
    }

    fn any_position(number: usize) -> Vec3A {
        vec3a(paired_share(3 * number + 1), paired_share(7 * number + 2), paired_share(11 * number + 5))
            * 100.0
    }

    /// Bounds for which each node may choose its successor, `kinds` times side by side.
    fn worst(kinds: usize) -> [(&'static str, Vec<Bounds>); 6] {
        let each = COUNT / kinds;
        let make = |of: &dyn Fn(usize, f32) -> Bounds| {
            (0..COUNT).map(|number| of(number / each, (number % each) as f32)).collect::<Vec<_>>()
        };
        let part = |at: f32| 1.0 + at / each as f32;
        [
            ("equal", make(&|kind, _| place(any_position(kind), Vec3A::splat(0.1 + paired_share(kind))))),
            ("from one corner", make(&|kind, at| place(any_position(kind), Vec3A::splat(part(at))))),
            (
                "around one point",
                make(&|kind, at| place(any_position(kind) - part(at), Vec3A::splat(2.0 * part(at)))),
            ),
            (
                "with growing gaps",
                make(&|kind, at| place(vec3a(at * at, kind as f32 * 1e7, 0.0), Vec3A::ONE)),
            ),
            (
                "one in 200 equal",
                (0..COUNT)
                    .map(|number| {
                        let at = if number % 200 < kinds { number % 200 } else { number };
                        place(any_position(at), Vec3A::splat(paired_share(at)))
                    })
                    .collect(),
            ),
            (
                "flat and in one plane",
                make(&|kind, at| place(Vec3A::Z * kind as f32, vec3a(part(at), part(at), 0.0))),
            ),
        ]
    }

    fn clustered(boxes: &[Bounds]) -> (Vec<BinaryNode>, usize) {
        cluster_counting_searches(morton_sorted_leaves(boxes))
    }

    /// Fails unless each AABB is in one leaf and inside all bounds above it.
    fn check(boxes: &[Bounds], tree: &[BinaryNode]) {
        let (mut open, mut found) = (vec![0], vec![false; boxes.len()]);
        while let Some(place) = open.pop() {
            let node = &tree[place];
            if node.is_leaf() {
                let primitive = node.index() as usize;
                assert!(!std::mem::replace(&mut found[primitive], true));
                assert_eq!(node.aabb(), Aabb::from(&boxes[primitive]));
                continue;
            }
            let children = node.children();
            assert!(children[0] > place && children[0] % 2 == 1);
            assert_eq!(node.count(), children.map(|child| tree[child].count()).iter().sum());
            assert_eq!(node.aabb(), tree[children[0]].aabb().union(tree[children[1]].aabb()));
            open.extend(children);
        }
        assert!(found.into_iter().all(|found| found));
    }

    #[test]
    fn no_boxes_take_more_searches_than_are_promised() {
        for kinds in [1, 10, 200, 700, 2_000] {
            for (name, boxes) in worst(kinds) {
                let (tree, searches) = clustered(&boxes);
                assert!(searches <= MIN_PAIRED_FRACTION * boxes.len(), "{kinds} x {name}: {searches}");
                check(&boxes, &tree);
            }
        }
    }

    #[test]
    fn threads_make_the_tree_that_one_makes() {
        let boxes: Vec<_> =
            (0..40_960).map(|it| place(any_position(it), Vec3A::splat(paired_share(it)))).collect();
        let nodes = |threads| on_new_threads(threads, || clustered(&boxes).0);
        let one = nodes(1);
        check(&boxes, &one);
        let bytes: &[u8] = bytemuck::cast_slice(&one);
        assert!([2, 5].into_iter().all(|threads| bytemuck::cast_slice::<_, u8>(&nodes(threads)) == bytes));
    }

    proptest! {
        #[test]
        fn every_box_is_in_one_leaf(
            corners in prop::collection::vec(([0..4_u8, 0..4, 0..4], [0..3_u8, 0..3, 0..3]), 1..400)
        ) {
            let vec = |of: [u8; 3]| Vec3A::from(of.map(f32::from));
            let boxes: Vec<_> = corners.into_iter().map(|(low, size)| place(vec(low), vec(size))).collect();
            let (tree, searches) = clustered(&boxes);
            prop_assert!(searches <= MIN_PAIRED_FRACTION * boxes.len());
            check(&boxes, &tree);
        }
    }
}
