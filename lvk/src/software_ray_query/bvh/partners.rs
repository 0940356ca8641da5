//! The search of [`ploc`](super::ploc): the neighbour of each node whose union with it has the least area.

use glam::Vec4;
use rayon::prelude::*;

use super::binary_node::BinaryNode;

/// Largest search radius.
pub(super) const MAX_REACH: usize = 14;
/// Nodes that one thread searches at a time. Their numbers fit in the first cache.
const BLOCK: usize = 128;
/// Nodes of a block with the neighbours in front.
const ROW: usize = BLOCK + MAX_REACH;
/// Nodes of a block with all neighbours.
const SPAN: usize = ROW + MAX_REACH;
/// Blocks of one task.
const TASK_BLOCKS: usize = 8;

/// Finds for each node the node within `reach` positions whose union with it has the least area. There must be at least
/// two nodes.
///
/// Of equals, a node prefers the one at the position with the last bit flipped, so that equal nodes choose each other,
/// and then the first.
pub(super) fn find_partners(nodes: &[BinaryNode], reach: usize, partners: &mut [u32]) {
    let reach = reach.clamp(1, MAX_REACH);
    partners.par_chunks_mut(BLOCK * TASK_BLOCKS).enumerate().for_each(|(task, partners)| {
        let mut block = Block::default();
        for (number, partners) in partners.chunks_mut(BLOCK).enumerate() {
            block.search(nodes, (task * TASK_BLOCKS + number) * BLOCK, reach, partners);
        }
    });
}

/// Arrays over the nodes of a block, which the compiler turns into vector instructions.
struct Block {
    /// Low corners, then high corners, from [`MAX_REACH`] nodes before the block on. AABBs beyond the ends are infinite.
    corners: [[f32; SPAN]; 6],
    /// Half areas of the unions of each node with the one so many positions behind it, less one.
    areas: [[f32; ROW]; MAX_REACH],
}

impl Default for Block {
    fn default() -> Self {
        Self { corners: [[0.0; SPAN]; 6], areas: [[0.0; ROW]; MAX_REACH] }
    }
}

impl Block {
    /// Finds the partners of the nodes from `first` on.
    fn search(&mut self, nodes: &[BinaryNode], first: usize, reach: usize, partners: &mut [u32]) {
        self.load(nodes, first);
        for distance in 1..=reach {
            self.compute_areas(distance);
        }
        let mut best = self.flipped(nodes.len() - first);
        for distance in (1..=reach).rev() {
            best.keep_least(&self.areas[distance - 1][MAX_REACH - distance..], -(distance as f32));
        }
        for distance in 1..=reach {
            best.keep_least(&self.areas[distance - 1][MAX_REACH..], distance as f32);
        }
        let steps = best.steps.iter().flat_map(|steps| steps.to_array());
        for ((place, partner), step) in (first..).zip(partners).zip(steps) {
            *partner = place.wrapping_add_signed(step as isize) as u32;
        }
    }

    fn load(&mut self, nodes: &[BinaryNode], first: usize) {
        for index in 0..SPAN {
            let node = (first + index).checked_sub(MAX_REACH).and_then(|place| nodes.get(place));
            let (low, high) = node.map_or(([f32::NEG_INFINITY; 3], [f32::INFINITY; 3]), |node| {
                (node.aabb().low.to_array(), node.aabb().high.to_array())
            });
            for axis in 0..3 {
                self.corners[axis][index] = low[axis];
                self.corners[axis + 3][index] = high[axis];
            }
        }
    }

    fn compute_areas(&mut self, distance: usize) {
        let one = self.corners.each_ref().map(|corners| &corners[..ROW]);
        let other = self.corners.each_ref().map(|corners| &corners[distance..][..ROW]);
        let areas = &mut self.areas[distance - 1];
        for index in 0..ROW {
            let size = |axis: usize| {
                greatest(one[axis + 3][index], other[axis + 3][index])
                    - least_of(one[axis][index], other[axis][index])
            };
            let [x, y, z] = [size(0), size(1), size(2)];
            areas[index] = (x + y) * z + x * y;
        }
    }

    /// Returns the areas of the unions with the nodes at the positions with the last bit flipped, and the steps to them.
    /// The last of an odd number of nodes has the one before instead. The first node of the block is one of `count`
    /// that remain.
    fn flipped(&self, count: usize) -> BestPartners {
        let mut best =
            BestPartners { areas: [Vec4::ZERO; BLOCK / LANES], steps: [Vec4::ZERO; BLOCK / LANES] };
        for index in 0..BLOCK {
            let is_behind = index % 2 == 0 && index + 1 < count;
            let (before, step) = if is_behind { (0, 1.0) } else { (1, -1.0) };
            best.areas[index / LANES][index % LANES] = self.areas[0][MAX_REACH + index - before];
            best.steps[index / LANES][index % LANES] = step;
        }
        best
    }
}

/// Nodes that one vector instruction compares.
const LANES: usize = 4;

/// The best partners so far: the areas, and the steps to them.
struct BestPartners {
    areas: [Vec4; BLOCK / LANES],
    steps: [Vec4; BLOCK / LANES],
}

impl BestPartners {
    /// Takes the nodes `step` positions away from those of the block where they are better.
    fn keep_least(&mut self, areas: &[f32], step: f32) {
        let step = Vec4::splat(step);
        for ((least, kept), areas) in
            self.areas.iter_mut().zip(&mut self.steps).zip(areas.chunks_exact(LANES))
        {
            let areas = Vec4::from_slice(areas);
            let is_less = areas.cmplt(*least);
            *least = Vec4::select(is_less, areas, *least);
            *kept = Vec4::select(is_less, step, *kept);
        }
    }
}

/// The less of two numbers, in one instruction: neither is NaN.
fn least_of(one: f32, other: f32) -> f32 {
    if one < other { one } else { other }
}

/// The greater of two numbers, in one instruction: neither is NaN.
fn greatest(one: f32, other: f32) -> f32 {
    if one > other { one } else { other }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use proptest::prelude::*;

    use super::*;
    use crate::accel::primitive_bounds::Bounds;

    /// Searches as the docstring of [`find_partners`] says.
    fn slow_partner(nodes: &[BinaryNode], reach: usize, place: usize) -> u32 {
        let flipped = if place ^ 1 < nodes.len() { place ^ 1 } else { place - 1 };
        let near = place.saturating_sub(reach)..(place + reach + 1).min(nodes.len());
        let area = |other: usize| nodes[place].aabb().union(nodes[other].aabb()).half_area();
        let others = near.filter(|other| *other != place);
        let better = |best: usize, other: usize| if area(other) < area(best) { other } else { best };
        others.fold(flipped, better) as u32
    }

    proptest! {
        #[test]
        fn each_node_finds_the_best_neighbour(
            corners in prop::collection::vec(([0..9_u8, 0..9, 0..9], [0..4_u8, 0..4, 0..4]), 2..700),
            reach in 1..=MAX_REACH
        ) {
            let vec = |of: [u8; 3]| Vec3::from_array(of.map(f32::from));
            let node = |(number, (low, size)): (u32, ([u8; 3], [u8; 3]))| {
                BinaryNode::leaf(&Bounds { low: vec(low), high: vec(low) + vec(size) }, number)
            };
            let nodes: Vec<_> = (0..).zip(corners).map(node).collect();
            let mut partners = vec![0; nodes.len()];
            find_partners(&nodes, reach, &mut partners);
            let slow: Vec<_> = (0..nodes.len()).map(|place| slow_partner(&nodes, reach, place)).collect();
            prop_assert_eq!(partners, slow);
        }
    }
}
