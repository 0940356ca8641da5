//! Wide trees: PLOC with reinsertion, collapsed to eight compressed children, by the crate `obvhs`.

use std::collections::{HashMap, HashSet};

use glam::{Vec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::cwbvh::bvh2_to_cwbvh::bvh2_to_cwbvh;
use obvhs::cwbvh::node::CwBvhNode;
use obvhs::ploc::PlocBuilder;

use super::quality::Quality;
use super::tree::{Nodes, Tree};
use crate::accel::bounds::Bounds;
use crate::accel::software::layout::{DEEPEST_WIDE, NONE};

/// Most primitives of a leaf: they are counted in three bits, one by one.
const LARGEST_LEAF: u32 = 3;
/// A binary tree deeper than this is not collapsed, which recurses.
const DEEPEST_SOURCE: usize = 1_000;

/// A wide tree; `None` where the primitives make it too deep.
pub(super) fn build(bounds: &[Bounds], quality: Quality) -> Option<Tree> {
    let params = quality.params();
    let boxes = distinct(bounds);
    let numbers = (0..boxes.len() as u32).collect();
    let mut binary = PlocBuilder::with_capacity(boxes.len()).build(
        params.ploc_search_distance,
        &boxes,
        numbers,
        params.sort_precision,
        params.search_depth_threshold,
    );
    if binary.max_depth > DEEPEST_SOURCE {
        return None;
    }
    ReinsertionOptimizer::default().run(&mut binary, params.reinsertion_batch_ratio, None);
    let wide = bvh2_to_cwbvh(&binary, params.max_prims_per_leaf.clamp(1, LARGEST_LEAF), true, false);
    let shallow = depth(&wide.nodes) <= DEEPEST_WIDE;
    shallow.then_some(Tree { nodes: Nodes::Wide(wide.nodes), root: 0, order: wide.primitive_indices })
}

/// The boxes; those of a size that many have are a little larger, each in its own way. Boxes that are alike would be merged
/// by one pair a round, and a round looks at them all.
fn distinct(bounds: &[Bounds]) -> Vec<Aabb> {
    let place = |bounds: &Bounds| Aabb { min: Vec3A::from(bounds.low), max: Vec3A::from(bounds.high) };
    let common = common_sizes(bounds);
    if common.is_empty() {
        return bounds.iter().map(place).collect();
    }
    let whole = bounds.iter().fold(0.0_f32, |most, bounds| {
        most.max(bounds.low.abs().max_element()).max(bounds.high.abs().max_element())
    });
    let least = (whole * 1e-7).max(f32::MIN_POSITIVE.sqrt());
    let grown = |(number, bounds): (u32, &Bounds)| {
        let mut place = place(bounds);
        if common.contains(&size_bits(bounds)) {
            let most = (bounds.high - bounds.low) * 1e-4 + least;
            place.min -= Vec3A::from(most * fractions(2 * number));
            place.max += Vec3A::from(most * fractions(2 * number + 1));
        }
        place
    };
    (0..).zip(bounds).map(grown).collect()
}

/// The sizes that one box in 128 or more has, judged by some of them.
fn common_sizes(bounds: &[Bounds]) -> HashSet<[u32; 3]> {
    const SAMPLES: usize = 1_024;
    let mut counts = HashMap::new();
    for place in bounds.iter().step_by(bounds.len().div_ceil(SAMPLES).max(1)) {
        *counts.entry(size_bits(place)).or_insert(0) += 1;
    }
    counts.retain(|_, count| *count >= SAMPLES / 128);
    counts.into_keys().collect()
}

fn size_bits(bounds: &Bounds) -> [u32; 3] {
    (bounds.high - bounds.low).to_array().map(f32::to_bits)
}

/// Three numbers from 0 to 1, others for each `seed` (the finaliser of MurmurHash3).
fn fractions(seed: u32) -> Vec3 {
    let mixed = |axis: u32| {
        let mut bits = seed.wrapping_mul(3).wrapping_add(axis);
        bits = (bits ^ bits >> 16).wrapping_mul(0x85EB_CA6B);
        bits = (bits ^ bits >> 13).wrapping_mul(0xC2B2_AE35);
        (bits ^ bits >> 16) as f32 / u32::MAX as f32
    };
    Vec3::new(mixed(0), mixed(1), mixed(2))
}

/// Nodes on the longest path. Children stand behind their parents.
fn depth(nodes: &[CwBvhNode]) -> usize {
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

/// The numbers of a node's inner children.
pub(super) fn children(node: &CwBvhNode) -> std::ops::Range<u32> {
    node.child_base_idx..node.child_base_idx.saturating_add(node.imask.count_ones())
}

/// For each node its parent and, in the highest three bits, which child it is.
pub(super) fn parents(nodes: &[CwBvhNode]) -> Vec<u32> {
    let mut parents = vec![NONE; nodes.len()];
    for (number, node) in (0_u32..).zip(nodes) {
        let inner = (0..8_u32).filter(|child| node.imask >> child & 1 == 1);
        for (child, place) in inner.zip(children(node)) {
            if let Some(parent) = parents.get_mut(place as usize) {
                *parent = number | child << 29;
            }
        }
    }
    parents
}

/// Whether all children and primitives exist, children behind their parents and each below but one, and no path is too
/// long.
pub(super) fn is_sound(nodes: &[CwBvhNode], primitives: usize) -> bool {
    let sound = |(index, node): (usize, &CwBvhNode)| {
        let children = children(node);
        let has_children = !children.is_empty();
        let inner =
            !has_children || (children.start as usize > index && children.end as usize <= nodes.len());
        inner && (0..8).all(|child| leaf_is_sound(node, child, primitives))
    };
    !nodes.is_empty()
        && nodes.iter().enumerate().all(sound)
        && have_one_parent(nodes)
        && depth(nodes) <= DEEPEST_WIDE
}

/// Whether each node but the first is the child of exactly one: paths that meet would be walked over and over.
fn have_one_parent(nodes: &[CwBvhNode]) -> bool {
    let mut parents = vec![0_u32; nodes.len()];
    for child in nodes.iter().flat_map(children) {
        if let Some(count) = parents.get_mut(child as usize) {
            *count += 1;
        }
    }
    parents.iter().skip(1).all(|count| *count == 1)
}

fn leaf_is_sound(node: &CwBvhNode, child: usize, primitives: usize) -> bool {
    let meta = node.child_meta[child];
    let is_inner = node.imask >> child & 1 == 1;
    if is_inner {
        return meta == 0x20 | (24 + child as u8);
    }
    let count = (meta >> 5).count_ones();
    let end = u64::from(node.primitive_base_idx) + u64::from(meta & 0x1f) + u64::from(count);
    let unary = matches!(meta >> 5, 0 | 1 | 3 | 7);
    meta == 0 || (unary && u32::from(meta & 0x1f) + count <= 24 && end <= primitives as u64)
}

#[cfg(test)]
mod tests {
    use super::*;

    const STATIC: Quality = Quality { fast_build: false, low_memory: false, refit: false };

    fn nodes(bounds: &[Bounds]) -> usize {
        match build(bounds, STATIC).expect("a tree").nodes {
            Nodes::Wide(nodes) => nodes.len(),
            Nodes::Binary(_) => unreachable!("wide trees were asked for"),
        }
    }

    #[test]
    fn the_largest_boxes_make_a_tree_as_good_as_others() {
        let boxes = |half: f32| vec![Bounds { low: Vec3::splat(-half), high: Vec3::splat(half) }; 200];
        assert!(nodes(&boxes(1e15)) <= 2 * nodes(&boxes(1.0)));
    }

    #[test]
    fn only_boxes_of_common_sizes_are_changed() {
        let size = |number: u32| Vec3::new(1.0, 2.0, 0.5 + number as f32);
        let sizes = (0..2_000).map(|number| if number % 4 == 0 { size(0) } else { size(number) });
        let bounds: Vec<_> = sizes.map(|high| Bounds { low: Vec3::ZERO, high }).collect();
        let changed = distinct(&bounds).into_iter().zip(&bounds).filter(|(after, before)| {
            let same = after.max == Vec3A::from(before.high) && after.min == Vec3A::from(before.low);
            let holds = after.max.cmpge(before.high.into()).all() && after.min.cmple(before.low.into()).all();
            assert!(holds);
            !same
        });
        assert_eq!(changed.count(), 500);
    }
}
