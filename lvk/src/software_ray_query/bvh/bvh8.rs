//! Builds a BVH8: [`ploc`] with [`reinsertion`], collapsed to eight compressed children.

use obvhs::cwbvh::node::CwBvhNode;
use rayon::prelude::*;

use super::binary_node::BinaryNode;
use super::build_threads::TASK_LENGTH;
use super::collapse_cost::Decisions;
use super::morton::morton_sorted_leaves;
use super::nodes::{Bvh, BvhNodes};
use super::phase_times::PhaseTimes;
use super::tree_regions::TreeRegions;
use super::wide_tree::wide_tree;
use super::{ploc, reinsertion};
use crate::accel::primitive_bounds::Bounds;
use crate::software_ray_query::layout::{Bvh2NodeRecord, MAX_BVH8_DEPTH};

/// Share of nodes that reinsertion moves. On an NVIDIA H200, it makes rays up to 7 % faster than half of it, for a
/// quarter more build time.
const REINSERTION_SHARE: f32 = 0.1;
/// Maximum node visits of the reinsertion search, for each node of the tree.
const REINSERTION_SEARCH_COST: f32 = 100.0;

/// Builds a BVH8 of at least two primitives. Returns `None` if it would be too deep, or larger than a BVH2.
pub(crate) fn build_bvh8(bounds: Vec<Bounds>, times: &mut PhaseTimes) -> Option<Bvh> {
    let count = bounds.len();
    let leaves = times.run("Morton order", || {
        let leaves = morton_sorted_leaves(&bounds);
        drop(bounds);
        leaves
    });
    let mut binary = times.run("clustering", || ploc::build_ploc(leaves));
    times.run("reinsertion", || {
        let share = reinsertion_share(&binary);
        reinsertion::reinsert_nodes(&mut binary, share);
    });
    let regions = TreeRegions::new(&binary);
    let decisions = times.run("collapse: costs", || Decisions::new(&binary, &regions));
    let wide = times.run("collapse: nodes", || wide_tree(&binary, &regions, &decisions));
    times.run("release of the binary tree", || rayon::join(|| drop(binary), || drop(decisions)));
    // Bounds without area cost nothing, so that nodes of more than two children gain nothing.
    let is_small = size_of_val(&wide.nodes[..]) <= (count - 1) * size_of::<Bvh2NodeRecord>();
    let is_fit = is_small && wide.depth <= MAX_BVH8_DEPTH && wide.order.len() == count;
    is_fit.then_some(Bvh { nodes: BvhNodes::Wide(wide.nodes), root: 0, order: wide.order })
}

/// Returns the share of nodes to move. The search for a position visits the nodes that a node overlaps. Their number is
/// about that of a ray, which follows from the areas. Nested bounds overlap most of the tree, and fewer nodes are
/// moved.
fn reinsertion_share(nodes: &[BinaryNode]) -> f32 {
    let area = |node: &BinaryNode| f64::from(node.aabb().half_area());
    // Sums of chunks of one length: the same for any number of threads.
    let parts: Vec<f64> = nodes.par_chunks(TASK_LENGTH).map(|nodes| nodes.iter().map(area).sum()).collect();
    let whole = nodes.first().map_or(0.0, area);
    let met = parts.into_iter().sum::<f64>() / whole;
    REINSERTION_SHARE.min(REINSERTION_SEARCH_COST / met as f32)
}

/// Returns the number of nodes on the longest path. Children must follow their parents.
fn max_depth(nodes: &[CwBvhNode]) -> usize {
    let mut depths = vec![1_u32; nodes.len()];
    for index in 0..nodes.len() {
        let below = depths[index] + 1;
        for child in children(&nodes[index]) {
            if let Some(depth) = depths.get_mut(child as usize) {
                *depth = (*depth).max(below);
            }
        }
    }
    depths.into_iter().max().unwrap_or(0) as usize
}

/// Returns the indices of a node's inner children.
pub(crate) fn children(node: &CwBvhNode) -> std::ops::Range<u32> {
    node.child_base_idx..node.child_base_idx.saturating_add(node.imask.count_ones())
}

/// True if all children and primitives exist, children follow their parents, each has one parent, and no path is too
/// long.
pub(crate) fn is_valid_bvh8(nodes: &[CwBvhNode], primitives: usize) -> bool {
    let is_node_valid = |(index, node): (usize, &CwBvhNode)| {
        let children = children(node);
        let has_children = !children.is_empty();
        let inner =
            !has_children || (children.start as usize > index && children.end as usize <= nodes.len());
        inner && (0..8).all(|child| is_valid_leaf(node, child, primitives))
    };
    !nodes.is_empty()
        && nodes.iter().enumerate().all(is_node_valid)
        && each_has_one_parent(nodes)
        && max_depth(nodes) <= MAX_BVH8_DEPTH
}

/// True if each node except the first has exactly one parent. Otherwise paths meet, and are traversed repeatedly.
fn each_has_one_parent(nodes: &[CwBvhNode]) -> bool {
    let mut parents = vec![0_u32; nodes.len()];
    for child in nodes.iter().flat_map(children) {
        if let Some(count) = parents.get_mut(child as usize) {
            *count += 1;
        }
    }
    parents.iter().skip(1).all(|count| *count == 1)
}

fn is_valid_leaf(node: &CwBvhNode, child: usize, primitives: usize) -> bool {
    let meta = node.child_meta[child];
    let is_inner = node.imask >> child & 1 == 1;
    if is_inner {
        return meta == 0x20 | (24 + child as u8);
    }
    let count = (meta >> 5).count_ones();
    let end = u64::from(node.primitive_base_idx) + u64::from(meta & 0x1f) + u64::from(count);
    // An entry with an offset but without primitives would alias another one.
    let unary = matches!(meta >> 5, 1 | 3 | 7);
    meta == 0 || (unary && u32::from(meta & 0x1f) + count <= 24 && end <= primitives as u64)
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    fn nodes(bounds: &[Bounds]) -> usize {
        match build_bvh8(bounds.to_vec(), &mut PhaseTimes::off()).expect("a tree").nodes {
            BvhNodes::Wide(nodes) => nodes.len(),
            BvhNodes::Binary(_) => unreachable!("wide trees were asked for"),
        }
    }

    fn share(bounds: impl Iterator<Item = [f32; 2]>) -> f32 {
        let bounds = bounds.map(|[low, high]| Bounds { low: Vec3::splat(low), high: Vec3::splat(high) });
        reinsertion_share(&ploc::build_ploc(morton_sorted_leaves(&bounds.collect::<Vec<_>>())))
    }

    #[test]
    fn fewer_nodes_move_where_boxes_lie_in_one_another() {
        let sizes = || (1..10_000_u16).map(f32::from);
        assert_eq!(share(sizes().map(|at| [at, at + 1.0])), REINSERTION_SHARE);
        assert!(share(sizes().map(|size| [0.0, size])) < 0.5 * REINSERTION_SHARE);
        assert_eq!(share(sizes().map(|_| [7.0, 7.0])), REINSERTION_SHARE, "points");
    }

    /// Each AABB is slightly larger than the one before, from a hair to a continent.
    #[test]
    fn boxes_within_each_other_need_no_deep_stack() {
        let grown = |number: i32| Vec3::splat(1e-12 * 1.003_f32.powi(number));
        let boxes: Vec<_> =
            (0..10_000).map(|number| Bounds { low: Vec3::ZERO, high: grown(number) }).collect();
        let made = std::thread::Builder::new()
            .stack_size(64 << 10)
            .spawn(move || build_bvh8(boxes, &mut PhaseTimes::off()).is_none());
        assert!(made.unwrap().join().unwrap(), "a tree of a thousand levels");
    }

    #[test]
    fn points_and_lines_take_no_more_than_binary_nodes() {
        let all: [fn(f32) -> Vec3; 3] = [|_| Vec3::ONE, |at| Vec3::X * at, |at| Vec3::new(at, -at, 2.0 * at)];
        for place in all {
            let bounds = (0..1024_u16).map(|at| place(f32::from(at))).map(|at| Bounds { low: at, high: at });
            let bounds: Vec<_> = bounds.collect();
            let bytes = build_bvh8(bounds, &mut PhaseTimes::off()).map_or(0, |tree| match tree.nodes {
                BvhNodes::Wide(nodes) => size_of_val(&nodes[..]),
                BvhNodes::Binary(_) => unreachable!("wide trees were asked for"),
            });
            assert!(bytes <= 1023 * size_of::<Bvh2NodeRecord>());
        }
    }

    #[test]
    fn the_largest_boxes_make_a_tree_as_good_as_others() {
        let boxes = |half: f32| vec![Bounds { low: Vec3::splat(-half), high: Vec3::splat(half) }; 200];
        assert!(nodes(&boxes(1e15)) <= 2 * nodes(&boxes(1.0)));
    }
}
