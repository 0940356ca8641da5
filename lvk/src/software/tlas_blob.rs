//! The bytes of a top-level structure.

use super::binary_tree;
use super::instances::PlacedInstance;
use super::layout::{BINARY, BLOCK_BYTES, BinaryNode, Header, Instance, LeafKind};
use super::tree::Nodes;
use crate::accel::bounds::Bounds;

/// Bytes that any structure of at most `capacity` instances fits into.
pub(crate) fn most_bytes(capacity: u32) -> u64 {
    let each = (size_of::<BinaryNode>() + size_of::<Instance>()) as u64;
    size_of::<Header>() as u64 + u64::from(capacity) * each
}

/// Builds a tree over the instances and packs it.
pub(crate) fn build(instances: &[PlacedInstance]) -> Vec<u8> {
    if instances.is_empty() {
        return bytemuck::bytes_of(&Header::empty(LeafKind::Instances)).to_vec();
    }
    let bounds: Vec<Bounds> = instances.iter().map(|placed| placed.bounds).collect();
    let tree = binary_tree::build(&bounds, 1);
    let whole = bounds.into_iter().fold(Bounds::EMPTY, Bounds::union);
    let nodes: &[BinaryNode] = match &tree.nodes {
        Nodes::Binary(nodes) => nodes,
        Nodes::Wide(_) => &[],
    };
    let ordered: Vec<Instance> =
        tree.order.iter().map(|number| instances[*number as usize].instance).collect();
    let places = size_of::<Header>() / BLOCK_BYTES;
    let header = Header {
        format: BINARY,
        leaf_kind: LeafKind::Instances as u32,
        root: tree.root,
        primitive_count: ordered.len() as u32,
        nodes: places as u32,
        primitives: (places + size_of_val(nodes) / BLOCK_BYTES) as u32,
        node_count: nodes.len() as u32,
        low: whole.low.to_array(),
        high: whole.high.to_array(),
        ..bytemuck::Zeroable::zeroed()
    };
    let mut bytes = bytemuck::bytes_of(&header).to_vec();
    bytes.extend_from_slice(bytemuck::cast_slice(nodes));
    bytes.extend_from_slice(bytemuck::cast_slice(&ordered));
    bytes
}
