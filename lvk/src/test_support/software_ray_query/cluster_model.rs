//! Reference for the binary tree of sorted primitives in `software_ray_query/kernels/cluster.glsl`. Tests compare the
//! kernel with it.

use super::collapse_model::{BelowNode, Bvh2Child, Bvh2Reference, GroupShape, half_area};
use super::gpu_build_check::{CheckBounds, union_bounds};
use crate::software_ray_query::gpu_build::layout::MAX_HEIGHT;

/// Clusters that stay of a range.
const STAYING: usize = 16;
const REACH: usize = 8;
const ROUNDS: usize = 16;

/// Sorted primitives.
#[derive(Debug, Clone)]
pub struct SortedPrimitives {
    /// Bounds, in the order of the codes.
    pub bounds: Vec<CheckBounds>,
    /// Codes along the curve, in order. Equal codes are allowed.
    pub codes: Vec<u64>,
    /// Bits of a code: 30 in the first word and the rest in the second.
    pub bits: u32,
}

/// A subtree without a parent.
#[derive(Clone, Copy)]
struct Cluster {
    child: Bvh2Child,
    shape: GroupShape,
}

struct Clusterer<'a> {
    primitives: &'a SortedPrimitives,
    tree: Bvh2Reference,
}

impl SortedPrimitives {
    /// Returns the tree over at least two primitives. Leaves are places in the order, and the root is the first node.
    pub fn cluster(&self) -> Bvh2Reference {
        let mut clusterer = Clusterer { primitives: self, tree: Bvh2Reference::default() };
        let root = clusterer.clusters(0, self.codes.len() - 1);
        clusterer.tree.in_preorder(root[0].child.below)
    }

    fn index_bits(&self) -> u32 {
        usize::BITS - (self.codes.len() - 1).leading_zeros()
    }

    fn key(&self, place: usize) -> u128 {
        u128::from(self.codes[place]) << self.index_bits() | place as u128
    }

    /// Returns the highest bit that changes in a range.
    fn changed_bit(&self, first: usize, last: usize) -> u32 {
        (self.key(first) ^ self.key(last)).ilog2()
    }
}

impl Clusterer<'_> {
    /// Returns the clusters of a range.
    fn clusters(&mut self, first: usize, last: usize) -> Vec<Cluster> {
        let primitives = self.primitives;
        if first == last {
            let child = Bvh2Child { bounds: primitives.bounds[first], below: BelowNode::Leaf(first as u32) };
            return vec![Cluster { child, shape: GroupShape::LEAF }];
        }
        let bit = primitives.changed_bit(first, last);
        let count = last + 1 - first;
        let second = first + (0..count).filter(|place| primitives.key(first + place) >> bit & 1 == 0).count();
        let mut clusters = self.clusters(first, second - 1);
        clusters.extend(self.clusters(second, last));
        let is_whole = count == primitives.codes.len();
        if count > STAYING || is_whole {
            let shared = primitives.bits + primitives.index_bits() - 1 - bit;
            let target = if is_whole { 1 } else { STAYING };
            for round in 0.. {
                if clusters.len() <= target {
                    break;
                }
                let later = if is_whole { (clusters.len() - 1).ilog2() + 1 } else { 5 + shared };
                clusters = self.merge_pairs(&clusters, MAX_HEIGHT.saturating_sub(later), round >= ROUNDS);
            }
        }
        clusters
    }

    fn merge_pairs(&mut self, clusters: &[Cluster], highest: u32, by_position: bool) -> Vec<Cluster> {
        let count = clusters.len();
        let nearest: Vec<usize> = (0..count).map(|own| find_nearest(clusters, own)).collect();
        let mut partner: Vec<Option<usize>> = (0..count)
            .map(|own| {
                let other = nearest[own];
                let is_low = clusters[own].shape.is_above(clusters[other].shape).height <= highest;
                (!by_position && nearest[other] == own && is_low).then_some(other)
            })
            .collect();
        if partner.iter().all(Option::is_none) {
            partner = (0..count).map(|own| Some(own ^ 1).filter(|other| *other < count)).collect();
        }
        let mut staying = Vec::new();
        for (own, other) in partner.iter().enumerate() {
            match *other {
                None => staying.push(clusters[own]),
                Some(other) if own < other => staying.push(self.merged(clusters[own], clusters[other])),
                Some(_) => {}
            }
        }
        staying
    }

    fn merged(&mut self, one: Cluster, two: Cluster) -> Cluster {
        let below = BelowNode::Node(self.tree.nodes.len());
        self.tree.nodes.push([one.child, two.child]);
        let bounds = union_bounds(one.child.bounds, two.child.bounds);
        Cluster { child: Bvh2Child { bounds, below }, shape: one.shape.is_above(two.shape) }
    }
}

fn find_nearest(clusters: &[Cluster], own: usize) -> usize {
    let area =
        |other: usize| half_area(&union_bounds(clusters[own].child.bounds, clusters[other].child.bounds));
    let flipped = own ^ 1;
    let first = if flipped < clusters.len() { flipped } else { own - 1 };
    let sides = |step: usize| [own.checked_sub(step), Some(own + step)];
    let others = (1..=REACH).flat_map(sides).flatten().filter(|other| *other < clusters.len());
    others
        .fold(
            (first, area(first)),
            |best, other| if area(other) < best.1 { (other, area(other)) } else { best },
        )
        .0
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn every_primitive_is_below_once_and_paths_are_short(
            mut codes in prop::collection::vec((0..64_u32, 0..100_u64), 2..400), corner in 0..9_u8
        ) {
            codes.sort_by_key(|(shift, code)| code << (shift % 20));
            let codes: Vec<u64> = codes.iter().map(|(shift, code)| code << (shift % 20)).collect();
            // Nested bounds are nearest to their successors.
            let bounds = |place: usize| [[f32::from(corner); 3], [10.0 + place as f32; 3]];
            let bounds = (0..codes.len()).map(bounds).collect();
            let tree = SortedPrimitives { bounds, codes: codes.clone(), bits: 30 }.cluster();
            let mut leaves = tree.leaves();
            leaves.sort_unstable();
            prop_assert!(leaves.into_iter().eq(0..codes.len() as u32));
            prop_assert!(tree.shape(BelowNode::Node(0)).height <= MAX_HEIGHT);
        }
    }
}
