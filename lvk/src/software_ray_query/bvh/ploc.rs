//! Binary trees by parallel locally ordered clustering (Meister and Bittner, 2018), in O(n log n) for any bounds.
//!
//! Nodes are sorted along a Morton curve. In each round, every node searches the neighbour whose union with it has the
//! least area, and two nodes that choose each other become one. If each node chooses its successor, as nested bounds
//! do, a round would merge one pair only. Such a round also pairs by position, so that every round removes a share of
//! the nodes.

use glam::{DVec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::node::Bvh2Node;
use obvhs::ploc::morton::morton_encode_u64_unorm;

use super::thread_budget::ThreadBudget;
use crate::accel::primitive_bounds::Bounds;
use crate::parallel::parallel_for;

/// Rounds that search the direct neighbours only; they pair most small nodes.
const SHORT_SEARCH_ROUNDS: usize = 2;
/// Search radius of later rounds to either side.
const LONG_SEARCH_RADIUS: usize = 14;
/// A round that pairs less than one in this many nodes also pairs direct neighbours.
const MIN_PAIRED_FRACTION: usize = 32;
/// Largest node count at which rounds pair mutual choices only.
const FINAL_NODE_COUNT: usize = 32;

/// Builds a tree of at least one AABB, with one AABB in each leaf.
pub(crate) fn build_ploc(boxes: &[Bounds]) -> Bvh2 {
    cluster_counting_searches(boxes).0
}

/// Returns the tree, and the number of searches over all rounds: at most [`MIN_PAIRED_FRACTION`] for each AABB.
fn cluster_counting_searches(boxes: &[Bounds]) -> (Bvh2, usize) {
    let mut tree = Bvh2::zeroed(boxes.len());
    tree.primitive_indices = (0..boxes.len() as u32).collect();
    let build = ThreadBudget::new();
    let mut nodes = morton_sorted_leaves(&build, boxes);
    let mut next = Vec::with_capacity(nodes.len());
    let mut partners = vec![0; nodes.len()];
    let (mut rounds, mut searches, mut free) = (0, 0, tree.nodes.len());
    while nodes.len() > 1 {
        let partners = &mut partners[..nodes.len()];
        find_partners(
            &build,
            &nodes,
            if rounds < SHORT_SEARCH_ROUNDS { 1 } else { LONG_SEARCH_RADIUS },
            partners,
        );
        pair_neighbours(partners);
        merge_pairs(&nodes, partners, &mut tree.nodes[..free], &mut next);
        free -= 2 * (nodes.len() - next.len());
        searches += nodes.len();
        rounds += 1;
        std::mem::swap(&mut nodes, &mut next);
    }
    tree.nodes[0] = nodes[0];
    tree.max_depth = tree.max_depth.max(rounds + 1);
    tree.children_are_ordered_after_parents = true;
    (tree, searches)
}

fn aabb(bounds: &Bounds) -> Aabb {
    Aabb { min: Vec3A::from(bounds.low), max: Vec3A::from(bounds.high) }
}

/// Returns the leaves along a Morton curve through their centers.
fn morton_sorted_leaves(build: &ThreadBudget, boxes: &[Bounds]) -> Vec<Bvh2Node> {
    let whole = aabb(&boxes.iter().copied().fold(Bounds::EMPTY, Bounds::union));
    let scale = 1.0 / whole.diagonal().as_dvec3().max(DVec3::splat(f64::MIN_POSITIVE));
    let low = whole.min.as_dvec3();
    let mut codes = vec![(0_u64, 0_u32); boxes.len()];
    let threads = build.thread_count(boxes.len());
    let length = boxes.len().div_ceil(threads).max(1);
    parallel_for(threads, codes.chunks_mut(length).enumerate(), |(chunk, codes)| {
        for (place, number) in codes.iter_mut().zip((chunk * length) as u32..) {
            let center = aabb(&boxes[number as usize]).center().as_dvec3();
            *place = (morton_encode_u64_unorm((center - low) * scale), number);
        }
        codes.sort_unstable();
    });
    // The stable sort detects the sorted chunks and merges them.
    codes.sort();
    codes.iter().map(|(_, number)| Bvh2Node::new(aabb(&boxes[*number as usize]), 1, *number)).collect()
}

/// Finds for each node the node within `reach` positions whose union with it has the least area.
///
/// Of equals, a node prefers the one at the position with the last bit flipped, so that equal nodes choose each other.
fn find_partners(build: &ThreadBudget, nodes: &[Bvh2Node], reach: usize, partners: &mut [u32]) {
    let threads = build.thread_count(nodes.len());
    // More chunks than threads, because some take longer.
    let pieces = if threads == 1 { 1 } else { threads * 4 };
    let length = nodes.len().div_ceil(pieces);
    parallel_for(threads, partners.chunks_mut(length).enumerate(), |(chunk, partners)| {
        find_partners_from(nodes, reach, chunk * length, partners);
    });
}

/// Finds the partners of the nodes from `first` on.
fn find_partners_from(nodes: &[Bvh2Node], reach: usize, first: usize, partners: &mut [u32]) {
    let end = first + partners.len();
    let mut least = vec![f32::INFINITY; partners.len()];
    for place in first..end {
        let other = if place ^ 1 < nodes.len() { place ^ 1 } else { place - 1 };
        partners[place - first] = other as u32;
        least[place - first] = merged_half_area(&nodes[place], &nodes[other]);
    }
    for place in first.saturating_sub(reach)..end {
        let own = nodes[place];
        let (mut best, mut best_cost) = match place.checked_sub(first) {
            Some(index) => (partners[index], least[index]),
            None => (0, f32::NEG_INFINITY),
        };
        let behind = place + 1..(place + reach + 1).min(nodes.len());
        for (other, node) in behind.clone().zip(&nodes[behind]) {
            let cost = merged_half_area(&own, node);
            if cost < best_cost {
                (best, best_cost) = (other as u32, cost);
            }
            if let Some(index) = other.checked_sub(first)
                && index < partners.len()
                && cost < least[index]
            {
                (partners[index], least[index]) = (place as u32, cost);
            }
        }
        if let Some(index) = place.checked_sub(first) {
            (partners[index], least[index]) = (best, best_cost);
        }
    }
}

fn merged_half_area(one: &Bvh2Node, other: &Bvh2Node) -> f32 {
    one.aabb().union(other.aabb()).half_area()
}

/// Pairs unpaired direct neighbours if too few nodes chose each other. This happens if each node chooses its successor.
fn pair_neighbours(partners: &mut [u32]) {
    let found = |partners: &[u32], place: usize| partners[partners[place] as usize] as usize == place;
    let count = partners.len();
    let found_one = || (0..count).filter(|place| found(partners, *place)).count();
    if count <= FINAL_NODE_COUNT || found_one() * MIN_PAIRED_FRACTION >= 2 * count {
        return;
    }
    for place in (0..count - 1).step_by(2) {
        if !found(partners, place) && !found(partners, place + 1) {
            partners[place] = place as u32 + 1;
            partners[place + 1] = place as u32;
        }
    }
}

/// Merges each pair to one node. The two children are written to the end of `free`.
fn merge_pairs(nodes: &[Bvh2Node], partners: &[u32], free: &mut [Bvh2Node], next: &mut Vec<Bvh2Node>) {
    next.clear();
    let mut end = free.len();
    for (place, node) in nodes.iter().enumerate() {
        let other = partners[place] as usize;
        if partners[other] as usize != place {
            next.push(*node);
        } else if other < place {
            end -= 2;
            free[end] = nodes[other];
            free[end + 1] = *node;
            next.push(Bvh2Node::new(nodes[other].aabb().union(node.aabb()), 0, end as u32));
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::vec3a;
    use proptest::prelude::*;

    use super::*;

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

    /// Fails unless each AABB is in one leaf and inside all bounds above it.
    fn check(boxes: &[Bounds], tree: &Bvh2) {
        let (mut open, mut found) = (vec![(0, 1)], vec![false; boxes.len()]);
        while let Some((number, depth)) = open.pop() {
            let node: &Bvh2Node = &tree.nodes[number];
            assert!(depth <= tree.max_depth);
            if node.is_leaf() {
                let primitive = tree.primitive_indices[node.first_index as usize] as usize;
                assert!(!std::mem::replace(&mut found[primitive], true));
                assert_eq!(*node.aabb(), aabb(&boxes[primitive]));
                continue;
            }
            for child in [0, 1].map(|side| node.first_index as usize + side) {
                let inside = tree.nodes[child].aabb();
                assert!(child > number && node.aabb().union(inside) == *node.aabb());
                open.push((child, depth + 1));
            }
        }
        assert!(found.into_iter().all(|found| found));
    }

    #[test]
    fn no_boxes_take_more_searches_than_are_promised() {
        for kinds in [1, 10, 200, 700, 2_000] {
            for (name, boxes) in worst(kinds) {
                let (tree, searches) = cluster_counting_searches(&boxes);
                assert!(searches <= MIN_PAIRED_FRACTION * boxes.len(), "{kinds} x {name}: {searches}");
                check(&boxes, &tree);
            }
        }
    }

    #[test]
    fn threads_find_what_one_finds() {
        let boxes: Vec<_> =
            (0..40_960).map(|it| place(any_position(it), Vec3A::splat(paired_share(it)))).collect();
        let nodes = morton_sorted_leaves(&ThreadBudget::new(), &boxes);
        for reach in [1, LONG_SEARCH_RADIUS] {
            let [mut one, mut many] = [vec![0; nodes.len()], vec![0; nodes.len()]];
            find_partners_from(&nodes, reach, 0, &mut one);
            let length = nodes.len().div_ceil(7);
            many.chunks_mut(length)
                .enumerate()
                .for_each(|(chunk, part)| find_partners_from(&nodes, reach, chunk * length, part));
            assert!(one == many, "{reach}");
        }
        check(&boxes, &build_ploc(&boxes));
    }

    proptest! {
        #[test]
        fn every_box_is_in_one_leaf(
            corners in prop::collection::vec(([0..4_u8, 0..4, 0..4], [0..3_u8, 0..3, 0..3]), 1..400)
        ) {
            let vec = |of: [u8; 3]| Vec3A::from(of.map(f32::from));
            let boxes: Vec<_> = corners.into_iter().map(|(low, size)| place(vec(low), vec(size))).collect();
            let (tree, searches) = cluster_counting_searches(&boxes);
            prop_assert!(searches <= MIN_PAIRED_FRACTION * boxes.len());
            check(&boxes, &tree);
        }
    }
}
