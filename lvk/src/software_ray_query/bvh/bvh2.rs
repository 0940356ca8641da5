//! Builds a BVH2 by the binned surface area heuristic (Wald, 2007), with a depth below the limit of the traversal stack.
//!
//! Primitives move with their bounds, so that each pass over a range reads memory in order. A large range is divided among
//! threads; the tree is the same for any number of them.

use glam::Vec3A;

use super::build_threads::on_build_threads;
use super::nodes::{Bvh, BvhNodes};
use crate::accel::primitive_bounds::Bounds;
use crate::software_ray_query::layout::{
    Bvh2NodeRecord, LEAF, MAX_BVH2_DEPTH, MAX_LEAF_PRIMITIVES, NONE, leaf,
};

const BINS: usize = 16;
/// Depth from which halves have equal primitive counts, so that at most 27 levels follow.
const MEDIAN_SPLIT_DEPTH: usize = MAX_BVH2_DEPTH - 28;
/// Primitives of a range above which its halves are tasks of their own.
const TASK_LENGTH: usize = 16 << 10;

/// Bounds in vectors of the processor.
#[derive(Clone, Copy)]
struct FastBounds {
    low: Vec3A,
    high: Vec3A,
}

impl FastBounds {
    const EMPTY: Self = Self { low: Vec3A::INFINITY, high: Vec3A::NEG_INFINITY };

    fn union(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    fn center(self) -> Vec3A {
        self.low * 0.5 + self.high * 0.5
    }

    fn half_area(self) -> f32 {
        Bounds { low: self.low.into(), high: self.high.into() }.half_area()
    }
}

/// A primitive, with its index in the caller's list.
#[derive(Clone, Copy)]
struct Primitive {
    bounds: FastBounds,
    index: u32,
}

impl Primitive {
    fn new(bounds: &Bounds, index: u32) -> Self {
        Self { bounds: FastBounds { low: bounds.low.into(), high: bounds.high.into() }, index }
    }
}

/// The place of a range in the tree.
#[derive(Clone, Copy)]
struct Place {
    /// Number of its first primitive in the order of the leaves.
    first: usize,
    /// Nodes on the path to it.
    depth: usize,
}

/// Nodes of a range, whose references count from the first of them.
struct Subtree {
    nodes: Vec<Bvh2NodeRecord>,
    root: u32,
}

/// A range in two parts.
struct Split {
    /// Primitives of the first part.
    count: usize,
    bounds: [FastBounds; 2],
}

/// Builds a BVH2 whose leaves have at most `leaf_size` primitives.
pub(crate) fn build_bvh2(bounds: &[Bounds], leaf_size: usize) -> Bvh {
    let leaf_size = leaf_size.clamp(1, MAX_LEAF_PRIMITIVES);
    let mut primitives: Vec<_> =
        bounds.iter().zip(0..).map(|(bounds, index)| Primitive::new(bounds, index)).collect();
    let whole = Place { first: 0, depth: 1 };
    let tree = match primitives.len() > TASK_LENGTH {
        true => on_build_threads(|| build_range(&mut primitives, whole, leaf_size)),
        false => build_range(&mut primitives, whole, leaf_size),
    };
    let order = primitives.iter().map(|primitive| primitive.index).collect();
    Bvh { nodes: BvhNodes::Binary(tree.nodes), root: tree.root, order }
}

/// Builds the tree of a range, with tasks for the halves of a large one.
fn build_range(primitives: &mut [Primitive], place: Place, leaf_size: usize) -> Subtree {
    if primitives.len() <= TASK_LENGTH {
        return build_alone(primitives, place, leaf_size);
    }
    let split = split_range(primitives, place.depth);
    let (one, two) = primitives.split_at_mut(split.count);
    let depth = place.depth + 1;
    let (one, two) = rayon::join(
        || build_range(one, Place { depth, ..place }, leaf_size),
        || build_range(two, Place { first: place.first + split.count, depth }, leaf_size),
    );
    let mut nodes = Vec::with_capacity(1 + one.nodes.len() + two.nodes.len());
    let behind = 1 + one.nodes.len() as u32;
    nodes.push(node(split.bounds, [moved(one.root, 1), moved(two.root, behind)]));
    let of = |part: Subtree, by| {
        part.nodes.into_iter().map(move |node| Bvh2NodeRecord {
            child0: moved(node.child0, by),
            child1: moved(node.child1, by),
            ..node
        })
    };
    nodes.extend(of(one, 1));
    nodes.extend(of(two, behind));
    Subtree { nodes, root: 0 }
}

/// Returns a reference to a node as one to the node `by` places behind it. Leaves stay as they are.
fn moved(reference: u32, by: u32) -> u32 {
    if reference & LEAF == 0 { reference + by } else { reference }
}

/// Builds the tree of a range on this thread.
fn build_alone(primitives: &mut [Primitive], place: Place, leaf_size: usize) -> Subtree {
    let mut nodes: Vec<Bvh2NodeRecord> = Vec::with_capacity(primitives.len().div_ceil(leaf_size));
    let mut open = Vec::new();
    let whole = (0, primitives.len(), place.depth);
    let reference = |nodes: &mut Vec<_>, open: &mut Vec<_>, (first, end, depth)| match end - first {
        0 => NONE,
        count if count <= leaf_size => leaf((place.first + first) as u32, count),
        _ => {
            nodes.push(bytemuck::Zeroable::zeroed());
            open.push((nodes.len() - 1, (first, end, depth)));
            nodes.len() as u32 - 1
        }
    };
    let root = reference(&mut nodes, &mut open, whole);
    while let Some((slot, (first, end, depth))) = open.pop() {
        let split = split_range(&mut primitives[first..end], depth);
        let middle = first + split.count;
        let parts = [(first, middle, depth + 1), (middle, end, depth + 1)];
        let children = parts.map(|part| reference(&mut nodes, &mut open, part));
        nodes[slot] = node(split.bounds, children);
    }
    Subtree { nodes, root }
}

fn node([one, two]: [FastBounds; 2], [child0, child1]: [u32; 2]) -> Bvh2NodeRecord {
    Bvh2NodeRecord {
        low0: one.low.into(),
        child0,
        high0: one.high.into(),
        child1,
        low1: two.low.into(),
        reserved0: 0,
        high1: two.high.into(),
        reserved1: 0,
    }
}

/// Partitions a range of at least two primitives in two, neither of which is empty.
fn split_range(primitives: &mut [Primitive], depth: usize) -> Split {
    if let [one, two] = &*primitives {
        return Split { count: 1, bounds: [one.bounds, two.bounds] };
    }
    let centers = primitives.iter().map(|primitive| primitive.bounds.center());
    let spread = centers.fold(FastBounds::EMPTY, |all, at| all.union(FastBounds { low: at, high: at }));
    let binned = if depth < MEDIAN_SPLIT_DEPTH { split_by_bins(primitives, &spread) } else { None };
    binned.unwrap_or_else(|| split_at_median(primitives, &spread))
}

/// Partitions a range in halves along the axis of its largest extent.
fn split_at_median(primitives: &mut [Primitive], spread: &FastBounds) -> Split {
    let axis = (spread.high - spread.low).max_position();
    let count = primitives.len() / 2;
    primitives.select_nth_unstable_by(count, |a, b| {
        let at = |primitive: &Primitive| primitive.bounds.center()[axis];
        at(a).total_cmp(&at(b)).then(a.index.cmp(&b.index))
    });
    let union =
        |part: &[Primitive]| part.iter().map(|one| one.bounds).fold(FastBounds::EMPTY, FastBounds::union);
    Split { count, bounds: [union(&primitives[..count]), union(&primitives[count..])] }
}

/// Primitives in equal parts of the extent of their centers, along one axis.
#[derive(Clone, Copy)]
struct Bin {
    bounds: FastBounds,
    count: u32,
}

impl Bin {
    const EMPTY: Self = Self { bounds: FastBounds::EMPTY, count: 0 };

    fn and(self, other: Self) -> Self {
        Self { bounds: self.bounds.union(other.bounds), count: self.count + other.count }
    }

    /// Returns the cost of its primitives as a child.
    fn cost(&self) -> f32 {
        self.bounds.half_area() * self.count as f32
    }
}

/// A boundary of bins, with what lies before and behind it.
struct Boundary {
    axis: usize,
    bin: usize,
    parts: [Bin; 2],
    cost: f32,
}

/// Partitions a range for the cheapest children; `None` if all centers lie in one bin of each axis.
fn split_by_bins(primitives: &mut [Primitive], spread: &FastBounds) -> Option<Split> {
    // Small ranges are most of all: they need few bins.
    let bin_count = (2 * primitives.len()).min(BINS);
    let scale = Vec3A::splat(bin_count as f32) / (spread.high - spread.low);
    let bin_of = |primitive: &Primitive| {
        let place = (primitive.bounds.center() - spread.low) * scale;
        // What is no number, where an extent is zero or infinite, lies in the first bin.
        place.to_array().map(|place| (place as usize).min(bin_count - 1))
    };
    let mut bins = [[Bin::EMPTY; BINS]; 3];
    for primitive in &*primitives {
        for (bins, place) in bins.iter_mut().zip(bin_of(primitive)) {
            bins[place] = bins[place].and(Bin { bounds: primitive.bounds, count: 1 });
        }
    }
    let boundaries = bins.iter().enumerate().filter_map(|(axis, bins)| cheapest(axis, &bins[..bin_count]));
    let best = boundaries.reduce(|one, two| if two.cost < one.cost { two } else { one })?;
    partition(primitives, |primitive| bin_of(primitive)[best.axis] < best.bin);
    Some(Split { count: best.parts[0].count as usize, bounds: best.parts.map(|part| part.bounds) })
}

/// Returns the boundary of the bins of an axis with the least cost; `None` if all primitives lie in one bin.
fn cheapest(axis: usize, bins: &[Bin]) -> Option<Boundary> {
    let mut behind = [Bin::EMPTY; BINS];
    let mut sum = Bin::EMPTY;
    for (place, bin) in bins.iter().enumerate().rev() {
        sum = sum.and(*bin);
        behind[place] = sum;
    }
    let (mut before, mut best) = (Bin::EMPTY, None::<Boundary>);
    for bin in 1..bins.len() {
        before = before.and(bins[bin - 1]);
        let parts = [before, behind[bin]];
        let cost = parts[0].cost() + parts[1].cost();
        let is_split = parts.iter().all(|part| part.count > 0);
        if is_split && best.as_ref().is_none_or(|best| cost < best.cost) {
            best = Some(Boundary { axis, bin, parts, cost });
        }
    }
    best
}

/// Moves the primitives that satisfy `is_first` to the front.
fn partition(primitives: &mut [Primitive], is_first: impl Fn(&Primitive) -> bool) {
    let mut count = 0;
    for place in 0..primitives.len() {
        if is_first(&primitives[place]) {
            primitives.swap(count, place);
            count += 1;
        }
    }
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

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use proptest::prelude::*;

    use super::*;
    use crate::software_ray_query::bvh::build_threads::on_new_threads;

    fn cube(center: [f32; 3], side: f32) -> Bounds {
        let (center, half) = (Vec3::from_array(center), Vec3::splat(side / 2.0));
        Bounds { low: center - half, high: center + half }
    }

    /// Cubes along a spiral, more than one task has.
    fn spiral(count: usize) -> Vec<Bounds> {
        let at = |number: usize| {
            let turn = number as f32 * 0.01;
            cube([turn.cos() * turn, number as f32 * 1e-3, turn.sin() * turn], 0.02)
        };
        (0..count).map(at).collect()
    }

    fn nodes(bvh: &Bvh) -> &[Bvh2NodeRecord] {
        match &bvh.nodes {
            BvhNodes::Binary(nodes) => nodes,
            BvhNodes::Wide(_) => panic!("wide nodes"),
        }
    }

    /// Returns the bounds of what a reference refers to. Asserts that those of children in nodes are exact.
    fn bounds_of(bvh: &Bvh, bounds: &[Bounds], reference: u32) -> Bounds {
        if reference & LEAF != 0 {
            let (first, count) = ((reference & 0x07ff_ffff) as usize, (reference >> 27 & 15) as usize + 1);
            let of = |index: &u32| bounds[*index as usize];
            return bvh.order[first..first + count].iter().map(of).fold(Bounds::EMPTY, Bounds::union);
        }
        let node = nodes(bvh)[reference as usize];
        let stated = [(node.low0, node.high0, node.child0), (node.low1, node.high1, node.child1)];
        stated.into_iter().fold(Bounds::EMPTY, |all, (low, high, child)| {
            assert_eq!(bounds_of(bvh, bounds, child), Bounds { low, high });
            all.union(Bounds { low, high })
        })
    }

    #[test]
    fn a_tree_is_the_same_for_any_number_of_threads() {
        let bounds = spiral(2 * TASK_LENGTH + 1000);
        let build = |threads| on_new_threads(threads, || build_bvh2(&bounds, 1));
        let (one, many) = (build(1), build(5));
        let bytes = |bvh: &Bvh| bytemuck::cast_slice::<_, u8>(nodes(bvh)).to_vec();
        assert!(bytes(&one) == bytes(&many) && one.order == many.order && one.root == many.root);
        assert!(is_valid_bvh2(nodes(&one), bounds.len()));
        assert_eq!(nodes(&one).len(), bounds.len() - 1);
        bounds_of(&one, &bounds, one.root);
    }

    #[test]
    fn empty_lists_and_lists_of_one_have_no_node() {
        assert_eq!(build_bvh2(&[], 1).root, NONE);
        assert_eq!(build_bvh2(&spiral(1), 1).root, leaf(0, 1));
    }

    proptest! {
        /// Also of primitives at one place, in a row, and of huge extents.
        #[test]
        fn any_bounds_have_a_tree_of_exact_bounds(
            seeds in prop::collection::vec((prop::array::uniform3(-4_i32..4), -1.0_f32..30.0), 1..200),
            scale in prop::sample::select(vec![0.0, 1e-30, 1.0, 1e30, f32::MAX / 8.0]),
            leaf_size in 1_usize..5,
        ) {
            let of = |(at, exponent): &([i32; 3], f32)| {
                let center = at.map(|at| at as f32 * scale);
                cube(center, exponent.exp2().min(scale))
            };
            let bounds: Vec<Bounds> = seeds.iter().map(of).collect();
            let bvh = build_bvh2(&bounds, leaf_size);
            if bounds.len() > leaf_size {
                prop_assert!(is_valid_bvh2(nodes(&bvh), bounds.len()));
            }
            bounds_of(&bvh, &bounds, bvh.root);
            let mut order = bvh.order.clone();
            order.sort_unstable();
            prop_assert!(order.into_iter().eq(0..bounds.len() as u32));
        }
    }
}
