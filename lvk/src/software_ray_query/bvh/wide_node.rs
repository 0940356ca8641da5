//! One node of eight compressed children (Ylitie et al., 2017).

use glam::{Vec3A, Vec4};
use obvhs::cwbvh::node::CwBvhNode;

use super::binary_node::BinaryNode;
use super::collapse_cost::{Decisions, Kind};

/// Maximum children of a wide node, and number of ray octants.
const WIDTH: usize = 8;
/// An empty slot.
const NO_CHILD: u32 = u32::MAX;
/// Steps of the box of a node along an axis, in which corners of children are stored.
const GRID_STEPS: f32 = 255.0;
/// Least length of a node along an axis.
const MIN_LENGTH: f32 = 1e-20;

/// The children of a wide node: nodes of the binary tree, by slot.
pub(super) struct WideChildren {
    slots: [u32; WIDTH],
    kinds: [Kind; WIDTH],
}

impl WideChildren {
    /// Returns the children that were decided for a node. A ray visits the slots in the order that its octant gives.
    pub(super) fn new(nodes: &[BinaryNode], decisions: &Decisions, place: u32) -> Self {
        let mut found = CollapsedChildren { places: [NO_CHILD; WIDTH], count: 0 };
        found.collect(nodes, decisions, place, 0);
        let mut centers = [Vec3A::ZERO; WIDTH];
        for (center, child) in centers.iter_mut().zip(&found.places[..found.count]) {
            *center = nodes[*child as usize].aabb().center();
        }
        let slots = slots_by_octant(nodes[place as usize].aabb().center(), &centers[..found.count]);
        let mut all = Self { slots: [NO_CHILD; WIDTH], kinds: [Kind::Leaf; WIDTH] };
        for (slot, child) in slots.into_iter().zip(&found.places[..found.count]) {
            all.slots[slot] = *child;
            all.kinds[slot] = decisions.get(*child, 0).kind;
        }
        all
    }

    /// Returns the children that become nodes, in order.
    pub(super) fn nodes(&self) -> impl DoubleEndedIterator<Item = u32> {
        self.slots.iter().zip(&self.kinds).filter(|(_, kind)| **kind == Kind::Node).map(|(child, _)| *child)
    }
}

/// The children of a wide node in the order of the binary tree.
struct CollapsedChildren {
    places: [u32; WIDTH],
    count: usize,
}

impl CollapsedChildren {
    fn collect(&mut self, nodes: &[BinaryNode], decisions: &Decisions, place: u32, share: usize) {
        let shares = decisions.get(place, share).shares;
        let first = nodes[place as usize].index();
        for (child, share) in [first, first + 1].into_iter().zip(shares) {
            if decisions.get(child, share).kind == Kind::Halves {
                self.collect(nodes, decisions, child, share);
            } else if let Some(found) = self.places.get_mut(self.count) {
                *found = child;
                self.count += 1;
            }
        }
    }
}

/// Returns a slot for each child, so that children lie in the direction of their slot: bits 2, 1 and 0 of a slot mean
/// negative x, y and z. Of the free slots and children, the pair with the least product is chosen again and again.
fn slots_by_octant(middle: Vec3A, centers: &[Vec3A]) -> [usize; WIDTH] {
    let (mut costs, mut best) = ([Eight::INFINITE; WIDTH], Eight::INFINITE);
    let (mut slots, mut best_slots) = ([WIDTH; WIDTH], [0; WIDTH]);
    for (child, center) in centers.iter().enumerate() {
        costs[child] = Eight::octant_products((*center - middle).to_array());
        (best_slots[child], *best.get_mut(child)) = costs[child].least();
    }
    let mut taken = Eight::ZERO;
    for _ in centers {
        let child = best.least().0;
        let slot = best_slots[child];
        slots[child] = slot;
        *best.get_mut(child) = f32::INFINITY;
        *taken.get_mut(slot) = f32::INFINITY;
        for other in 0..centers.len() {
            if slots[other] == WIDTH && best_slots[other] == slot {
                (best_slots[other], *best.get_mut(other)) = costs[other].plus(&taken).least();
            }
        }
    }
    slots
}

/// Eight numbers, of slots or children.
#[derive(Clone, Copy)]
struct Eight([Vec4; 2]);

impl Eight {
    const ZERO: Self = Self([Vec4::ZERO; 2]);
    const INFINITE: Self = Self([Vec4::INFINITY; 2]);

    /// Returns the products of a direction and the eight diagonals.
    fn octant_products([x, y, z]: [f32; 3]) -> Self {
        const Y_SIGNS: Vec4 = Vec4::new(1.0, 1.0, -1.0, -1.0);
        const Z_SIGNS: Vec4 = Vec4::new(1.0, -1.0, 1.0, -1.0);
        Self([x, -x].map(|x| (Vec4::splat(x) + Y_SIGNS * y) + Z_SIGNS * z))
    }

    fn plus(&self, other: &Self) -> Self {
        Self([self.0[0] + other.0[0], self.0[1] + other.0[1]])
    }

    fn get_mut(&mut self, index: usize) -> &mut f32 {
        &mut self.0[index / 4][index % 4]
    }

    /// Returns the index of the first least number, and the number.
    fn least(&self) -> (usize, f32) {
        let least = self.0[0].min(self.0[1]).min_element();
        let [low, high] = self.0.map(|four| four.cmpeq(Vec4::splat(least)).bitmask());
        (((low | high << 4).trailing_zeros() as usize).min(WIDTH - 1), least)
    }
}

/// Encodes a wide node whose first child node has the index `first_child`. Appends the primitives of its leaves to
/// `order`.
pub(super) fn wide_node(
    nodes: &[BinaryNode],
    children: &WideChildren,
    place: u32,
    first_child: u32,
    order: &mut Vec<u32>,
) -> CwBvhNode {
    let aabb = nodes[place as usize].aabb();
    let exponents = (aabb.high - aabb.low).to_array().map(step_exponent);
    let steps = Vec3A::from_array(exponents.map(|exponent| f32::from_bits(u32::from(exponent) << 23)));
    let per_step = steps.recip();
    let first_primitive = order.len();
    let mut node = CwBvhNode {
        p: aabb.low.into(),
        e: exponents,
        child_base_idx: first_child,
        primitive_base_idx: first_primitive as u32,
        ..CwBvhNode::default()
    };
    for (slot, child) in children.slots.iter().enumerate().filter(|(_, child)| **child != NO_CHILD) {
        let of_child = nodes[*child as usize].aabb();
        let on_grid =
            |corner: Vec3A| corner.clamp(Vec3A::ZERO, Vec3A::splat(GRID_STEPS)).to_array().map(|at| at as u8);
        let low = on_grid(((of_child.low - aabb.low) * per_step).floor());
        let high = on_grid(((of_child.high - aabb.low) * per_step).ceil());
        (node.child_min_x[slot], node.child_min_y[slot], node.child_min_z[slot]) = (low[0], low[1], low[2]);
        (node.child_max_x[slot], node.child_max_y[slot], node.child_max_z[slot]) =
            (high[0], high[1], high[2]);
        if children.kinds[slot] == Kind::Node {
            node.imask |= 1 << slot;
            node.child_meta[slot] = 0x20 | (24 + slot as u8);
        } else {
            let start = order.len();
            append_primitives(nodes, *child, order);
            let unary = (1_u8 << (order.len() - start)) - 1;
            node.child_meta[slot] = unary << 5 | (start - first_primitive) as u8;
        }
    }
    widen_thin_node(&mut node);
    node
}

/// Enlarges the steps along an axis on which a node is much thinner than on others. Rays that run along the node and
/// touch it then take longer to leave the outermost step than to reach it. Kernels do the same in
/// `kernels/encode.glsl`.
fn widen_thin_node(node: &mut CwBvhNode) {
    const THIN: u8 = 20;
    const OF_POINT: u8 = 87;
    let highs = [node.child_max_x, node.child_max_y, node.child_max_z];
    let is_point = highs.as_flattened().iter().all(|high| *high == 0);
    let widest = node.e.into_iter().max().unwrap_or(0);
    let least = if is_point { OF_POINT } else { widest.saturating_sub(THIN) };
    let lows = [&mut node.child_min_x, &mut node.child_min_y, &mut node.child_min_z];
    let highs = [&mut node.child_max_x, &mut node.child_max_y, &mut node.child_max_z];
    for ((exponent, lows), highs) in node.e.iter_mut().zip(lows).zip(highs) {
        let shift = u32::from(least.saturating_sub(*exponent));
        if shift > 0 {
            *exponent = least;
            lows.iter_mut().for_each(|low| *low = low.checked_shr(shift).unwrap_or(0));
            highs.iter_mut().for_each(|high| *high = high.checked_shr(shift).unwrap_or(0) + 1);
        }
    }
}

/// Returns the biased exponent of the least power of two of which [`GRID_STEPS`] cover a length.
fn step_exponent(length: f32) -> u8 {
    let step = (length.max(MIN_LENGTH) * (1.0 / GRID_STEPS)).to_bits();
    let is_power = step & ((1 << 23) - 1) == 0;
    ((step >> 23) + u32::from(!is_power)) as u8
}

/// Appends the primitives of a subtree of few.
fn append_primitives(nodes: &[BinaryNode], place: u32, order: &mut Vec<u32>) {
    let node = &nodes[place as usize];
    if node.is_leaf() {
        order.push(node.index());
    } else {
        append_primitives(nodes, node.index(), order);
        append_primitives(nodes, node.index() + 1, order);
    }
}

#[cfg(test)]
mod tests {
    use glam::vec3a;
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn a_step_is_the_least_power_of_two_that_covers_the_length(length in 1e-18_f32..1e15) {
            let covered = |exponent: u8| f64::from(f32::from_bits(u32::from(exponent) << 23)) * 255.0;
            let exponent = step_exponent(length);
            prop_assert!(covered(exponent) >= f64::from(length) * (1.0 - 1e-6));
            prop_assert!(covered(exponent - 1) < f64::from(length) * (1.0 + 1e-6));
        }

        #[test]
        fn each_child_has_a_slot_of_its_own(
            centers in prop::collection::vec(prop::array::uniform3(-1e15_f32..1e15), 1..=WIDTH)
        ) {
            let centers: Vec<_> = centers.into_iter().map(Vec3A::from).collect();
            let slots = slots_by_octant(Vec3A::ZERO, &centers);
            for (child, slot) in slots.iter().enumerate() {
                prop_assert_eq!(*slot < WIDTH, child < centers.len());
                prop_assert!(*slot == WIDTH || !slots[..child].contains(slot));
            }
        }
    }

    #[test]
    fn children_lie_in_the_direction_of_their_slots() {
        let corner = |slot: usize| {
            let sign = |bit: usize| if slot >> bit & 1 == 1 { 1.0 } else { -1.0 };
            vec3a(sign(2), sign(1), sign(0))
        };
        let centers: [Vec3A; WIDTH] = std::array::from_fn(|child| corner(WIDTH - 1 - child));
        assert_eq!(slots_by_octant(Vec3A::ZERO, &centers), std::array::from_fn(|child| WIDTH - 1 - child));
    }
}
