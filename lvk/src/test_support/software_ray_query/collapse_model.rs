//! Reference for the collapse of a binary tree to a wide one in `decide.glsl` and `collapse.glsl` of
//! `software_ray_query/kernels`. Tests compare the kernels with it.

use super::gpu_build_check::{CheckBounds, union_bounds};
use crate::software_ray_query::layout::MAX_BVH8_DEPTH;

const CHILDREN: u32 = 8;
const MAX_GROUP_PRIMITIVES: u32 = 3;
const MAX_GROUPS: u32 = 3;
const PRIMITIVE_COST: f32 = 0.3125;
const NODE_COST: f32 = 2.0;
/// Cost of what is not allowed.
const NEVER: f32 = 1e38;
/// Shares of a subtree, by the maximum children less one.
const SHARES: usize = 7;
/// The decision of a share that is as that of the next lower one.
const AS_BELOW: u32 = 7;

/// Nodes of two children each, the root first.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Bvh2Reference {
    /// The two children of each node.
    pub nodes: Vec<[Bvh2Child; 2]>,
}

/// A child of a binary node.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bvh2Child {
    /// Bounds of the subtree.
    pub bounds: CheckBounds,
    /// The node or leaf.
    pub below: BelowNode,
}

/// The target of a child reference.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BelowNode {
    /// A node, by its index.
    Node(usize),
    /// A primitive, by its index.
    Leaf(u32),
}

/// A wide node with its subtree.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Bvh8Reference {
    /// The children, in the order of the node.
    pub children: [Bvh8Child; 8],
}

/// A child of a wide node.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Bvh8Child {
    /// No child.
    None,
    /// A node.
    Node(Box<Bvh8Reference>),
    /// Indices of primitives, in the order of their slots.
    Leaf(Vec<u32>),
}

/// `Fitted::shape` of a subtree in the kernels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct GroupShape {
    pub(crate) height: u32,
    pub(crate) groups: u32,
    pub(crate) count: u32,
}

/// The costs of a subtree for each share, and the decisions in the kernels' format.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Decided {
    pub(crate) costs: [f32; SHARES],
    pub(crate) decision: u32,
}

#[derive(Clone, Copy)]
struct CollapsePart {
    child: Bvh2Child,
    share: usize,
}

/// Properties of each node of the binary tree.
struct KnownNodes {
    shapes: Vec<GroupShape>,
    decided: Vec<Decided>,
}

impl GroupShape {
    pub(crate) const LEAF: Self = Self { height: 0, groups: 1, count: 1 };

    pub(crate) fn is_above(self, other: Self) -> Self {
        let count = (self.count + other.count).min(0xffff);
        let groups = if count <= MAX_GROUP_PRIMITIVES { 1 } else { (self.groups + other.groups).min(0xff) };
        Self { height: self.height.max(other.height) + 1, groups, count }
    }

    /// Returns the shape as one word in the kernels' format.
    pub(crate) fn packed(self) -> u32 {
        self.height | self.groups << 8 | self.count << 16
    }

    fn is_group(self) -> bool {
        self.count <= MAX_GROUP_PRIMITIVES
    }
}

impl Decided {
    fn of_leaf(bounds: &CheckBounds) -> Self {
        Self { costs: [half_area(bounds) * PRIMITIVE_COST; SHARES], decision: 0 }
    }

    /// Decides for a node of this area and shape, whose halves are decided.
    fn of_node(area: f32, shape: GroupShape, [one, two]: [&Self; 2]) -> Self {
        let mut least = [(f32::INFINITY, 0); SHARES];
        for (both, least) in least.iter_mut().enumerate() {
            for share in 0..=both {
                let sum = one.costs[share] + two.costs[both - share];
                if sum < least.0 {
                    *least = (sum, share as u32);
                }
            }
        }
        let whole = match shape {
            _ if shape.is_group() => area * PRIMITIVE_COST * shape.count as f32,
            _ if shape.groups <= MAX_GROUPS => NEVER,
            _ => least[SHARES - 1].0 + area * NODE_COST,
        };
        let (mut costs, mut decision) = ([whole; SHARES], least[SHARES - 1].1);
        for share in 1..SHARES {
            let (sum, first) = least[share - 1];
            let is_less = sum < costs[share - 1];
            costs[share] = if is_less { sum } else { costs[share - 1] }.min(NEVER);
            decision |= if is_less { first } else { AS_BELOW } << (3 * share);
        }
        Self { costs, decision }
    }

    /// Returns the shares of both halves if a subtree with this share is split.
    fn halves(&self, mut share: usize) -> Option<[usize; 2]> {
        let first = |share: usize| self.decision >> (3 * share) & 7;
        while share > 0 && first(share) == AS_BELOW {
            share -= 1;
        }
        let half = first(share) as usize;
        (share > 0).then(|| [half, share - 1 - half])
    }
}

impl Bvh2Reference {
    /// Returns the nodes below a child, each before those below it and the first half before the second.
    pub(crate) fn preorder(&self, root: BelowNode) -> Vec<usize> {
        let (mut open, mut found) = (vec![root], Vec::new());
        while let Some(below) = open.pop() {
            if let BelowNode::Node(node) = below {
                found.push(node);
                open.extend(self.nodes[node].iter().rev().map(|child| child.below));
            }
        }
        found
    }

    /// Returns the same tree with its nodes in [preorder](Self::preorder).
    pub(crate) fn in_preorder(&self, root: BelowNode) -> Self {
        let order = self.preorder(root);
        let mut places = vec![0; self.nodes.len()];
        order.iter().enumerate().for_each(|(place, node)| places[*node] = place);
        let moved = |child: Bvh2Child| match child.below {
            BelowNode::Node(node) => Bvh2Child { below: BelowNode::Node(places[node]), ..child },
            BelowNode::Leaf(_) => child,
        };
        Self { nodes: order.iter().map(|node| self.nodes[*node].map(moved)).collect() }
    }

    /// Returns the primitives of all leaves.
    #[cfg(test)]
    pub(crate) fn leaves(&self) -> Vec<u32> {
        let leaf = |child: &Bvh2Child| match child.below {
            BelowNode::Leaf(number) => Some(number),
            BelowNode::Node(_) => None,
        };
        self.nodes.iter().flatten().filter_map(leaf).collect()
    }

    /// Returns the decision about each node. Children must follow their parent.
    pub fn decisions(&self) -> Vec<u32> {
        self.decided().iter().map(|decided| decided.decision).collect()
    }

    /// Returns the shape of the subtree of a child.
    pub(crate) fn shape(&self, below: BelowNode) -> GroupShape {
        match below {
            BelowNode::Leaf(_) => GroupShape::LEAF,
            BelowNode::Node(node) => {
                let [one, two] = self.nodes[node].map(|child| self.shape(child.below));
                one.is_above(two)
            }
        }
    }

    /// Returns the costs of each node and the decisions about it. Children must follow their parent.
    pub(crate) fn decided(&self) -> Vec<Decided> {
        self.known().decided
    }

    /// Returns the number of primitives below each node. Children must follow their parent.
    pub(crate) fn primitive_counts(&self) -> Vec<u32> {
        let mut counts = vec![0; self.nodes.len()];
        for (index, node) in self.nodes.iter().enumerate().rev() {
            counts[index] = node
                .iter()
                .map(|child| match child.below {
                    BelowNode::Leaf(_) => 1,
                    BelowNode::Node(below) => counts[below],
                })
                .sum();
        }
        counts
    }

    fn known(&self) -> KnownNodes {
        let (shapes, decided) = (vec![GroupShape::LEAF; self.nodes.len()], Vec::new());
        let mut known = KnownNodes { shapes, decided };
        known.decided.resize(self.nodes.len(), Decided { costs: [0.0; SHARES], decision: 0 });
        for (index, node) in self.nodes.iter().enumerate().rev() {
            let [one, two] = node.map(|child| node_below(&known.shapes, child.below));
            known.shapes[index] = one.is_above(two);
            let halves = node.map(|child| match child.below {
                BelowNode::Leaf(_) => Decided::of_leaf(&child.bounds),
                BelowNode::Node(below) => known.decided[below],
            });
            let area = half_area(&union_bounds(node[0].bounds, node[1].bounds));
            known.decided[index] = Decided::of_node(area, known.shapes[index], [&halves[0], &halves[1]]);
        }
        known
    }

    /// Returns the wide tree. This tree must have more than three primitives.
    pub fn collapse(&self) -> Bvh8Reference {
        self.is_wide(&self.known(), 0, 0)
    }

    fn is_wide(&self, known: &KnownNodes, node: usize, level: usize) -> Bvh8Reference {
        let cut = self.cut(known, node, level);
        let order = slot_order(&cut);
        let child = |part: Option<usize>| {
            let Some(part) = part.map(|part| cut[part]) else { return Bvh8Child::None };
            match part.child.below {
                BelowNode::Node(below) if !known.shapes[below].is_group() => {
                    Bvh8Child::Node(Box::new(self.is_wide(known, below, level + 1)))
                }
                below => Bvh8Child::Leaf(self.primitives(below)),
            }
        };
        Bvh8Reference { children: order.map(child) }
    }

    /// Returns the children of the wide node that replaces a binary one.
    fn cut(&self, known: &KnownNodes, node: usize, level: usize) -> Vec<CollapsePart> {
        let first = (known.decided[node].decision & 7) as usize;
        let [one, two] = self.nodes[node];
        let mut cut = vec![
            CollapsePart { child: one, share: first },
            CollapsePart { child: two, share: SHARES - 1 - first },
        ];
        if (known.shapes[node].height as usize + 1) / 3 > MAX_BVH8_DEPTH - 1 - level {
            self.cut_highest(known, &mut cut);
            return cut;
        }
        loop {
            let halves = |part: &CollapsePart| match part.child.below {
                BelowNode::Node(below) => known.decided[below].halves(part.share),
                BelowNode::Leaf(_) => None,
            };
            let splits: Vec<_> = cut.iter().map(halves).collect();
            if splits.iter().all(Option::is_none) {
                return cut;
            }
            for (part, shares) in splits.into_iter().enumerate() {
                match shares {
                    Some(shares) => self.split(&mut cut, part, shares),
                    None => cut[part].share = 0,
                }
            }
        }
    }

    /// Splits the highest part until there is no more room.
    fn cut_highest(&self, known: &KnownNodes, cut: &mut Vec<CollapsePart>) {
        let height = |part: &CollapsePart| node_below(&known.shapes, part.child.below).height;
        while cut.len() < CHILDREN as usize {
            let mut next = 0;
            for index in 1..cut.len() {
                if height(&cut[index]) > height(&cut[next]) {
                    next = index;
                }
            }
            if matches!(cut[next].child.below, BelowNode::Leaf(_)) {
                break;
            }
            self.split(cut, next, [0; 2]);
        }
    }

    fn split(&self, cut: &mut Vec<CollapsePart>, part: usize, shares: [usize; 2]) {
        let BelowNode::Node(below) = cut[part].child.below else { return };
        let [one, two] = self.nodes[below];
        cut[part] = CollapsePart { child: one, share: shares[0] };
        cut.push(CollapsePart { child: two, share: shares[1] });
    }

    fn primitives(&self, below: BelowNode) -> Vec<u32> {
        match below {
            BelowNode::Leaf(number) => vec![number],
            BelowNode::Node(node) => {
                self.nodes[node].iter().flat_map(|child| self.primitives(child.below)).collect()
            }
        }
    }
}

impl Bvh8Reference {
    /// Returns the number of nodes on the longest path.
    pub fn depth(&self) -> usize {
        let depth = |child: &Bvh8Child| if let Bvh8Child::Node(below) = child { below.depth() } else { 0 };
        1 + self.children.iter().map(depth).max().unwrap_or(0)
    }

    /// Returns the number of nodes of all levels.
    pub fn node_count(&self) -> usize {
        let count =
            |child: &Bvh8Child| if let Bvh8Child::Node(below) = child { below.node_count() } else { 0 };
        1 + self.children.iter().map(count).sum::<usize>()
    }

    /// Returns the indices of all primitives.
    pub fn primitives(&self) -> Vec<u32> {
        let below = |child: &Bvh8Child| match child {
            Bvh8Child::None => Vec::new(),
            Bvh8Child::Node(below) => below.primitives(),
            Bvh8Child::Leaf(numbers) => numbers.clone(),
        };
        self.children.iter().flat_map(below).collect()
    }
}

fn node_below(shapes: &[GroupShape], below: BelowNode) -> GroupShape {
    match below {
        BelowNode::Leaf(_) => GroupShape::LEAF,
        BelowNode::Node(node) => shapes[node],
    }
}

/// Returns for each child slot the index of its part.
fn slot_order(cut: &[CollapsePart]) -> [Option<usize>; 8] {
    let centre = |bounds: &CheckBounds| -> [f32; 3] {
        std::array::from_fn(|axis| bounds[0][axis] * 0.5 + bounds[1][axis] * 0.5)
    };
    let all = |which: usize, best: fn(f32, f32) -> f32| -> [f32; 3] {
        let first = cut[0].child.bounds[which];
        cut.iter().fold(first, |all, part| {
            std::array::from_fn(|axis| best(all[axis], part.child.bounds[which][axis]))
        })
    };
    let middle = centre(&[all(0, f32::min), all(1, f32::max)]);
    let mut children = [None; 8];
    let mut waiting: Vec<usize> = (0..cut.len()).collect();
    while !waiting.is_empty() {
        let (mut least, mut chosen) = (f32::MAX, (0, 0));
        for (place, part) in waiting.iter().enumerate() {
            let at = centre(&cut[*part].child.bounds);
            for child in (0..8).filter(|child| children[*child].is_none()) {
                let along: f32 = (0..3)
                    .map(|axis| {
                        let offset = at[axis] - middle[axis];
                        if child & 4 >> axis == 0 { offset } else { -offset }
                    })
                    .sum();
                if along < least {
                    (least, chosen) = (along, (place, child));
                }
            }
        }
        children[chosen.1] = Some(waiting.remove(chosen.0));
    }
    children
}

pub(crate) fn half_area(bounds: &CheckBounds) -> f32 {
    let [x, y, z] = std::array::from_fn(|axis| (bounds[1][axis] - bounds[0][axis]).max(0.0));
    x * y + y * z + z * x
}

/// Generates a tree of `count` primitives, at least two, with vertices at small integers.
///
/// `choose` returns a number below its argument. In `even` of eight nodes, the halves have about the same number of
/// primitives; in the others, one half has only one. No path has more than `height` nodes, which must suffice for
/// `count`.
pub fn any_tree(
    count: usize,
    even: usize,
    height: u32,
    choose: &mut dyn FnMut(usize) -> usize,
) -> Bvh2Reference {
    let mut tree = Bvh2Reference::default();
    let leaves: Vec<u32> = (0..count as u32).collect();
    add_child(&mut tree, &leaves, even, height, choose);
    tree
}

fn add_child(
    tree: &mut Bvh2Reference,
    leaves: &[u32],
    even: usize,
    height: u32,
    choose: &mut dyn FnMut(usize) -> usize,
) -> Bvh2Child {
    if let [number] = leaves {
        let low: [usize; 3] = std::array::from_fn(|_| choose(1000));
        let high: [usize; 3] = std::array::from_fn(|axis| low[axis] + choose(8));
        let bounds = [low, high].map(|corner| corner.map(|number| number as f32));
        return Bvh2Child { bounds, below: BelowNode::Leaf(*number) };
    }
    let node = tree.nodes.len();
    let empty = Bvh2Child { bounds: super::gpu_build_check::EMPTY, below: BelowNode::Leaf(0) };
    tree.nodes.push([empty; 2]);
    let most = 1_usize.checked_shl(height - 1).unwrap_or(usize::MAX);
    let half = leaves.len() / 2;
    let wanted = if choose(8) < even { half - choose(half.div_ceil(4)) } else { 1 };
    let middle = wanted.max(leaves.len().saturating_sub(most)).min(leaves.len() - 1);
    let (one, two) = leaves.split_at(middle);
    let mut parts = [one, two];
    if choose(2) == 0 {
        parts.reverse();
    }
    let children = parts.map(|part| add_child(tree, part, even, height - 1, choose));
    tree.nodes[node] = children;
    let [one, two] = children.map(|child| child.bounds);
    Bvh2Child { bounds: union_bounds(one, two), below: BelowNode::Node(node) }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn tree(count: usize, even: usize, height: u32, seed: u64) -> Bvh2Reference {
        let mut state = seed;
        any_tree(count, even, height, &mut |below| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as usize % below
        })
    }

    /// Returns the fewest children of any node except the root.
    fn min_groups(tree: &Bvh8Reference) -> usize {
        let own =
            |tree: &Bvh8Reference| tree.children.iter().filter(|child| **child != Bvh8Child::None).count();
        let below = tree.children.iter().filter_map(|child| match child {
            Bvh8Child::Node(below) => Some(own(below).min(min_groups(below))),
            _ => None,
        });
        below.min().unwrap_or(8)
    }

    proptest! {
        #[test]
        fn every_primitive_is_in_one_leaf(count in 4..3000_usize, even in 0..=8_usize, seed: u64, height in 12..=64_u32) {
            let wide = tree(count, even, height, seed).collapse();
            let mut found = wide.primitives();
            found.sort_unstable();
            prop_assert!(found.into_iter().eq(0..count as u32));
            prop_assert!(wide.depth() <= MAX_BVH8_DEPTH, "{}", wide.depth());
        }

        #[test]
        fn even_trees_fit_the_capacity(count in 4..5000_usize, even in 7..=8_usize, seed: u64) {
            let wide = tree(count, even, 64, seed).collapse();
            prop_assert!(wide.node_count() <= count * 99 / 1000 + 2, "{} of {count}", wide.node_count());
            prop_assert!(min_groups(&wide) >= 2);
        }
    }

    /// Paths as long as codes allow, with a large sibling beside every node.
    #[test]
    fn the_longest_paths_are_short_enough() {
        for seed in 0..200 {
            let deep = tree(4_000, 0, 64, seed);
            assert_eq!(deep.shape(BelowNode::Node(0)).height, 64);
            assert!(deep.collapse().depth() <= MAX_BVH8_DEPTH);
        }
    }
}
