//! Builds a BVH2 by the binned surface area heuristic, with a depth below the limit of the traversal stack.

use super::nodes::{Bvh, BvhNodes};
use crate::accel::primitive_bounds::Bounds;
use crate::software_ray_query::layout::{
    Bvh2NodeRecord, LEAF, MAX_BVH2_DEPTH, MAX_LEAF_PRIMITIVES, NONE, leaf,
};

const BINS: usize = 16;
/// Depth from which halves have equal primitive counts, so that at most 27 levels follow.
const MEDIAN_SPLIT_DEPTH: usize = MAX_BVH2_DEPTH - 28;

/// A range of the order that becomes a node or a leaf.
#[derive(Clone, Copy)]
struct PendingRange {
    first: usize,
    end: usize,
    depth: usize,
}

struct Builder<'a> {
    bounds: &'a [Bounds],
    order: Vec<u32>,
    nodes: Vec<Bvh2NodeRecord>,
    leaf_size: usize,
}

/// Builds a BVH2 whose leaves have at most `leaf_size` primitives.
pub(crate) fn build_bvh2(bounds: &[Bounds], leaf_size: usize) -> Bvh {
    let leaf_size = leaf_size.clamp(1, MAX_LEAF_PRIMITIVES);
    let mut builder =
        Builder { bounds, order: (0..bounds.len() as u32).collect(), nodes: Vec::new(), leaf_size };
    let root = builder.build_root();
    Bvh { nodes: BvhNodes::Binary(builder.nodes), root, order: builder.order }
}

impl Builder<'_> {
    fn build_root(&mut self) -> u32 {
        let whole = PendingRange { first: 0, end: self.order.len(), depth: 1 };
        let mut open = Vec::new();
        let root = self.push_range(whole, &mut open);
        while let Some((node, work)) = open.pop() {
            self.fill_node(node, work, &mut open);
        }
        root
    }

    /// Returns the reference to a range: a leaf, or a node that is filled later.
    fn push_range(&mut self, work: PendingRange, open: &mut Vec<(usize, PendingRange)>) -> u32 {
        match work.end - work.first {
            0 => NONE,
            count if count <= self.leaf_size => leaf(work.first as u32, count),
            _ => {
                self.nodes.push(bytemuck::Zeroable::zeroed());
                open.push((self.nodes.len() - 1, work));
                self.nodes.len() as u32 - 1
            }
        }
    }

    fn fill_node(&mut self, node: usize, work: PendingRange, open: &mut Vec<(usize, PendingRange)>) {
        let middle = self.split_range(work);
        let (one, two) = (self.union(work.first, middle), self.union(middle, work.end));
        let depth = work.depth + 1;
        let child0 = self.push_range(PendingRange { end: middle, depth, ..work }, open);
        let child1 = self.push_range(PendingRange { first: middle, depth, ..work }, open);
        self.nodes[node] = Bvh2NodeRecord {
            low0: one.low,
            child0,
            high0: one.high,
            child1,
            low1: two.low,
            reserved0: 0,
            high1: two.high,
            reserved1: 0,
        };
    }

    fn union(&self, first: usize, end: usize) -> Bounds {
        let of = |number: &u32| self.bounds[*number as usize];
        self.order[first..end].iter().map(of).fold(Bounds::EMPTY, Bounds::union)
    }

    /// Partitions a range in two and returns the index of the second part.
    fn split_range(&mut self, work: PendingRange) -> usize {
        let PendingRange { first, end, depth } = work;
        let centers = self.order[first..end].iter().map(|number| center(&self.bounds[*number as usize]));
        let spread = centers.fold(Bounds::EMPTY, |all, at| all.union(Bounds { low: at, high: at }));
        if depth < MEDIAN_SPLIT_DEPTH
            && let Some((axis, bin)) = self.best_bin(work, &spread)
        {
            let bounds = self.bounds;
            let below = |number: &u32| bin_of(&bounds[*number as usize], &spread, axis) < bin;
            let middle = first + partition_primitives(&mut self.order[first..end], below);
            if middle > first && middle < end {
                return middle;
            }
        }
        let size = spread.high - spread.low;
        let axis = if size.x >= size.y && size.x >= size.z { 0 } else { 1 + usize::from(size.z > size.y) };
        let (bounds, middle) = (self.bounds, first + (end - first) / 2);
        self.order[first..end].select_nth_unstable_by(middle - first, |a, b| {
            let at = |number: &u32| center(&bounds[*number as usize])[axis];
            at(a).total_cmp(&at(b)).then(a.cmp(b))
        });
        middle
    }

    /// Returns the axis and the first bin of the second half for the cheapest children.
    fn best_bin(&self, work: PendingRange, spread: &Bounds) -> Option<(usize, usize)> {
        let mut best = None;
        let mut least = f32::INFINITY;
        for axis in 0..3 {
            if spread.high[axis] <= spread.low[axis] {
                continue;
            }
            let mut bins = [(Bounds::EMPTY, 0_usize); BINS];
            for number in &self.order[work.first..work.end] {
                let bounds = &self.bounds[*number as usize];
                let bin = &mut bins[bin_of(bounds, spread, axis)];
                *bin = (bin.0.union(*bounds), bin.1 + 1);
            }
            for (bin, cost) in costs(&bins) {
                if cost < least {
                    (least, best) = (cost, Some((axis, bin)));
                }
            }
        }
        best
    }
}

/// Returns the cost of a split before each bin except the first.
fn costs(bins: &[(Bounds, usize); BINS]) -> [(usize, f32); BINS - 1] {
    let mut after = [0.0; BINS];
    let (mut bounds, mut count) = (Bounds::EMPTY, 0);
    for bin in (1..BINS).rev() {
        (bounds, count) = (bounds.union(bins[bin].0), count + bins[bin].1);
        after[bin] = bounds.half_area() * count as f32;
    }
    (bounds, count) = (Bounds::EMPTY, 0);
    std::array::from_fn(|bin| {
        (bounds, count) = (bounds.union(bins[bin].0), count + bins[bin].1);
        (bin + 1, bounds.half_area() * count as f32 + after[bin + 1])
    })
}

fn center(bounds: &Bounds) -> glam::Vec3 {
    bounds.low * 0.5 + bounds.high * 0.5
}

fn bin_of(bounds: &Bounds, spread: &Bounds, axis: usize) -> usize {
    let share = (center(bounds)[axis] - spread.low[axis]) / (spread.high[axis] - spread.low[axis]);
    ((share * BINS as f32) as usize).min(BINS - 1)
}

/// Moves the primitives that satisfy `first` to the front. Returns their number.
fn partition_primitives(numbers: &mut [u32], first: impl Fn(&u32) -> bool) -> usize {
    let mut count = 0;
    for index in 0..numbers.len() {
        if first(&numbers[index]) {
            numbers.swap(count, index);
            count += 1;
        }
    }
    count
}

/// True if the nodes are a tree: every path from the first node ends in primitives that exist, no path is too long, no
/// two paths meet, and all nodes are on a path. Nodes may have any order.
pub(crate) fn is_valid_bvh2(nodes: &[Bvh2NodeRecord], primitives: usize) -> bool {
    let mut seen = vec![false; nodes.len()];
    let mut open = vec![(0_u32, 1_usize)];
    while let Some((place, depth)) = open.pop() {
        let Some(node) = nodes.get(place as usize) else { return false };
        if depth > MAX_BVH2_DEPTH || std::mem::replace(&mut seen[place as usize], true) {
            return false;
        }
        for child in [node.child0, node.child1].into_iter().filter(|child| *child != NONE) {
            if child & LEAF == 0 {
                open.push((child, depth + 1));
            } else if !is_valid_leaf(child, primitives) {
                return false;
            }
        }
    }
    seen.into_iter().all(|seen| seen)
}

/// True if a leaf reference refers to primitives that exist.
pub(crate) fn is_valid_leaf(reference: u32, primitives: usize) -> bool {
    let (first, count) = (reference & 0x07ff_ffff, (reference >> 27 & 15) + 1);
    reference & LEAF != 0 && first as usize + count as usize <= primitives
}
