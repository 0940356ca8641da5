//! Nodes of the binary tree that a build makes before the tree is collapsed to wide nodes.

use bytemuck::{Pod, Zeroable};
use glam::{Vec3, Vec3A, Vec4};

use crate::accel::primitive_bounds::Bounds;

/// An AABB in the registers of the CPU.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Aabb {
    pub(super) low: Vec3A,
    pub(super) high: Vec3A,
}

impl Aabb {
    pub(super) fn union(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    /// Half of the surface area.
    pub(super) fn half_area(self) -> f32 {
        let size = self.high - self.low;
        (size.x + size.y) * size.z + size.x * size.y
    }

    pub(super) fn center(self) -> Vec3A {
        (self.high + self.low) * 0.5
    }
}

impl From<&Bounds> for Aabb {
    fn from(bounds: &Bounds) -> Self {
        Self { low: bounds.low.into(), high: bounds.high.into() }
    }
}

/// A leaf of one primitive, or an inner node of two children. The children are neighbours in memory, and the first has
/// an odd index: the root is at 0.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C, align(16))]
pub(super) struct BinaryNode {
    /// The low corner, and the bits of the index of the first child or of the primitive.
    low: Vec4,
    /// The high corner, and the bits of the number of primitives.
    high: Vec4,
}

impl BinaryNode {
    pub(super) fn leaf(bounds: &Bounds, primitive: u32) -> Self {
        Self::new(bounds.low, bounds.high, primitive, 1)
    }

    /// Returns the parent of two nodes, the first of which is at `first_child`.
    pub(super) fn parent_of(one: &Self, other: &Self, first_child: u32) -> Self {
        let Aabb { low, high } = one.aabb().union(other.aabb());
        Self::new(low.into(), high.into(), first_child, one.count().saturating_add(other.count()))
    }

    fn new(low: Vec3, high: Vec3, index: u32, count: u32) -> Self {
        Self { low: low.extend(f32::from_bits(index)), high: high.extend(f32::from_bits(count)) }
    }

    pub(super) fn aabb(&self) -> Aabb {
        Aabb { low: Vec3A::from_vec4(self.low), high: Vec3A::from_vec4(self.high) }
    }

    pub(super) fn set_aabb(&mut self, aabb: Aabb) {
        *self = Self::new(aabb.low.into(), aabb.high.into(), self.index(), self.count());
    }

    /// The index of the first child, or of the primitive of a leaf.
    pub(super) fn index(&self) -> u32 {
        self.low.w.to_bits()
    }

    /// Sets the number of primitives of an inner node, at least 2.
    pub(super) fn set_count(&mut self, count: u32) {
        self.high.w = f32::from_bits(count);
    }

    /// The number of primitives: 1 for a leaf, and at least 2 for an inner node.
    pub(super) fn count(&self) -> u32 {
        self.high.w.to_bits()
    }

    pub(super) fn is_leaf(&self) -> bool {
        self.count() == 1
    }

    /// The indices of the two children of an inner node.
    pub(super) fn children(&self) -> [usize; 2] {
        let first = self.index() as usize;
        [first, first + 1]
    }
}

/// Returns the index of the other child of a node's parent. The root has none.
pub(super) fn sibling(node: usize) -> usize {
    ((node - 1) ^ 1) + 1
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn a_node_keeps_its_numbers_beside_any_aabb(
            low in prop::array::uniform3(-1e15_f32..1e15), index in 0..1_u32 << 31, moved in any::<f32>()
        ) {
            let bounds = Bounds { low: Vec3::from(low), high: Vec3::from(low) + 1.0 };
            let mut node = BinaryNode::leaf(&bounds, index);
            prop_assert_eq!((node.index(), node.count(), node.is_leaf()), (index, 1, true));
            prop_assert_eq!(node.aabb(), Aabb::from(&bounds));
            node.set_aabb(Aabb { low: Vec3A::splat(moved), high: Vec3A::splat(moved) });
            prop_assert_eq!((node.index(), node.count()), (index, 1));
            let parent = BinaryNode::parent_of(&node, &node, 5);
            prop_assert_eq!((parent.children(), parent.count(), parent.is_leaf()), ([5, 6], 2, false));
        }
    }

    #[test]
    fn siblings_are_each_others() {
        assert_eq!([1, 2, 3, 4, 9].map(sibling), [2, 1, 4, 3, 10]);
    }
}
