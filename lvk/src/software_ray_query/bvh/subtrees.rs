//! Splits a BLAS into subtrees.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use glam::{UVec3, Vec3};
use obvhs::cwbvh::node::CwBvhNode;

use super::bvh8::children;
use super::encode_blas::BlasBlob;
use crate::accel::primitive_bounds::Bounds;
use crate::software_ray_query::layout::{BLOCK_BYTES, FORMAT_BVH8, leaf};
use crate::software_ray_query::rebraid_parts::{RebraidPart, RebraidParts};

/// Maximum parts that are kept for a BLAS, 36 bytes each.
const MAX_PARTS: usize = 64;
const NODE_BYTES: usize = size_of::<CwBvhNode>();

/// Returns the parts of a valid BLAS. A BVH2 and a single leaf are not split.
pub(crate) fn subtree_parts(blob: &BlasBlob) -> RebraidParts {
    let mut all = RebraidParts::single(blob.bounds);
    let header = blob.header();
    if header.format != FORMAT_BVH8 || header.root != 0 {
        return all;
    }
    let start = header.nodes as usize * BLOCK_BYTES;
    let node = |number: u32| -> Option<CwBvhNode> {
        let first = start + number as usize * NODE_BYTES;
        blob.bytes.get(first..first + NODE_BYTES).map(bytemuck::pod_read_unaligned)
    };
    // The largest first: areas are never negative, so their bits have the same order. `None` is the whole.
    let area = |bounds: &Bounds| bounds.half_area().to_bits();
    let mut open = BinaryHeap::from([(area(&blob.bounds), Reverse(None))]);
    while let Some((_, Reverse(number))) = open.pop() {
        let reference = number.map_or(0, |number: usize| all.parts[number].reference);
        let Some(below) = node(reference).and_then(|node| child_parts(&node)) else { continue };
        let (first, end) = (all.parts.len(), all.parts.len() + below.len());
        if end > MAX_PARTS {
            break;
        }
        let nodes = (first..).zip(&below).filter(|(_, (_, is_node))| *is_node);
        open.extend(nodes.map(|(number, (part, _))| (area(&part.bounds), Reverse(Some(number)))));
        all.parts.extend(below.into_iter().map(|(part, _)| part));
        let part = number.map_or(&mut all.whole, |number| &mut all.parts[number]);
        part.below = first as u32..end as u32;
    }
    all
}

/// Returns the children of a node, with true for inner nodes; `None` if a child has invalid bounds.
fn child_parts(node: &CwBvhNode) -> Option<Vec<(RebraidPart, bool)>> {
    let mut inner = children(node);
    let used = (0..8).filter(|child| node.child_meta[*child] != 0);
    let part = |child: usize| {
        let meta = node.child_meta[child];
        let is_node = node.imask >> child & 1 == 1;
        let reference = if is_node {
            inner.next()?
        } else {
            leaf(node.primitive_base_idx + u32::from(meta & 31), (meta >> 5).count_ones() as usize)
        };
        let bounds = child_bounds(node, child);
        let is_box = bounds.low.is_finite() && bounds.high.is_finite() && bounds.low.cmple(bounds.high).all();
        is_box.then_some((RebraidPart { reference, bounds, below: 0..0 }, is_node))
    };
    used.map(part).collect()
}

/// Returns the bounds of a child, with the rounding margin of the traversal.
fn child_bounds(node: &CwBvhNode, child: usize) -> Bounds {
    const ROUNDING: f32 = 1e-6;
    let scale = Vec3::from_array(node.e.map(|exponent| f32::from_bits(u32::from(exponent) << 23)));
    let place = |x: u8, y: u8, z: u8| node.p + scale * UVec3::new(x.into(), y.into(), z.into()).as_vec3();
    let low = place(node.child_min_x[child], node.child_min_y[child], node.child_min_z[child]);
    let high = place(node.child_max_x[child], node.child_max_y[child], node.child_max_z[child]);
    let error = (node.p.abs() + 256.0 * scale) * ROUNDING;
    Bounds { low: low - error, high: high + error }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::accel::geometry::GeometryFlags;
    use crate::software_ray_query::bvh::encode_blas;
    use crate::software_ray_query::bvh::primitives::{Mesh, MeshPrimitives};
    use crate::software_ray_query::bvh::settings::BvhSettings;
    use crate::software_ray_query::layout::{BlobHeader, LEAF, LeafBox};

    const QUALITY: BvhSettings = BvhSettings { low_memory: false, refit: false };

    /// Builds a BLAS of these AABBs.
    pub(crate) fn structure(boxes: &[Bounds]) -> (Vec<u8>, RebraidParts) {
        let place =
            |(primitive, of): (u32, &Bounds)| LeafBox { low: of.low, primitive, high: of.high, geometry: 0 };
        let primitives = MeshPrimitives::Boxes((0..).zip(boxes).map(place).collect());
        let mesh = Mesh { primitives, vertices: Vec::new(), flags: vec![GeometryFlags::empty()] };
        let blob = encode_blas::encode_blas(&mesh, QUALITY);
        let parts = subtree_parts(&blob);
        (blob.bytes, parts)
    }

    /// Returns AABBs along a curve.
    pub(crate) fn row(count: u32, away: Vec3) -> Vec<Bounds> {
        let place = |number: u32| {
            away + Vec3::new(number as f32, (number * number) as f32 * 0.01, (number % 3) as f32)
        };
        (0..count).map(|number| Bounds { low: place(number), high: place(number) + 0.7 }).collect()
    }

    /// Returns the primitives below a reference.
    pub(crate) fn primitives(bytes: &[u8], reference: u32) -> Vec<LeafBox> {
        let header: BlobHeader = bytemuck::pod_read_unaligned(&bytes[..size_of::<BlobHeader>()]);
        let at = |block: u32, index: u32, size: u32| (block * BLOCK_BYTES as u32 + index * size) as usize;
        if reference & LEAF != 0 {
            let count = (reference >> 27 & 15) + 1;
            let leaf = |index: u32| {
                let first = at(header.primitives, (reference & 0x07ff_ffff) + index, 32);
                bytemuck::pod_read_unaligned(&bytes[first..first + 32])
            };
            return (0..count).map(leaf).collect();
        }
        let first = at(header.nodes, reference, NODE_BYTES as u32);
        let node: CwBvhNode = bytemuck::pod_read_unaligned(&bytes[first..first + NODE_BYTES]);
        let below = child_parts(&node).unwrap();
        below.into_iter().flat_map(|(part, _)| primitives(bytes, part.reference)).collect()
    }

    #[test]
    fn each_primitive_is_in_one_part_and_its_box_in_that_of_the_part() {
        for (count, away) in [(4, Vec3::ZERO), (30, Vec3::splat(-1e4)), (3_000, Vec3::new(1e6, -5.0, 0.1))] {
            let (bytes, parts) = structure(&row(count, away));
            assert!(!parts.parts.is_empty() && parts.parts.len() <= MAX_PARTS);
            assert!(parts.parts.iter().all(|part| part.reference != 0), "0 stands for the whole");
            for part in parts.parts.iter().chain([&parts.whole]) {
                let mut apart = Vec::new();
                for below in parts.children_of(part) {
                    for held in primitives(&bytes, below.reference) {
                        assert!(
                            held.low.cmpge(below.bounds.low).all()
                                && held.high.cmple(below.bounds.high).all()
                        );
                        apart.push(held.primitive);
                    }
                }
                let mut all: Vec<_> =
                    primitives(&bytes, part.reference).iter().map(|of| of.primitive).collect();
                all.sort_unstable();
                apart.sort_unstable();
                assert!(apart.is_empty() || apart == all);
            }
        }
    }

    #[test]
    fn a_tree_without_wide_nodes_stays_whole() {
        for count in [0, 1, 3] {
            assert!(structure(&row(count, Vec3::ZERO)).1.parts.is_empty());
        }
    }
}
