//! Encodes a TLAS that the CPU builds. Its size is at most that of a build on the GPU with as many records.

use super::bvh2;
use super::encode_instances::PlacedInstance;
use super::nodes::BvhNodes;
use super::rebraid::rebraid;
use crate::accel::primitive_bounds::Bounds;
use crate::software_ray_query::layout::LeafKind;
use crate::software_ray_query::layout::{
    BLOCK_BYTES, BlobHeader, Bvh2NodeRecord, FORMAT_BVH2, InstanceRecord, NONE,
};

/// Builds a BVH over the instances and encodes it. Overlapping instances are split into parts, up to `max_records`
/// records.
pub(crate) fn encode_tlas(instances: &[PlacedInstance], max_records: u32) -> Vec<u8> {
    if instances.is_empty() {
        let nothing = BlobHeader {
            format: FORMAT_BVH2,
            leaf_kind: LeafKind::Instances as u32,
            root: NONE,
            low: [f32::MAX; 3],
            high: [-f32::MAX; 3],
            ..bytemuck::Zeroable::zeroed()
        };
        return bytemuck::bytes_of(&nothing).to_vec();
    }
    let records = rebraid(instances, max_records as usize);
    let bounds: Vec<Bounds> = records.iter().map(|placed| placed.bounds).collect();
    let tree = bvh2::build_bvh2(&bounds, 1);
    let whole = bounds.into_iter().fold(Bounds::EMPTY, Bounds::union);
    let nodes: &[Bvh2NodeRecord] = match &tree.nodes {
        BvhNodes::Binary(nodes) => nodes,
        BvhNodes::Wide(_) => &[],
    };
    let places = size_of::<BlobHeader>() / BLOCK_BYTES;
    let header = BlobHeader {
        format: FORMAT_BVH2,
        leaf_kind: LeafKind::Instances as u32,
        root: tree.root,
        primitive_count: records.len() as u32,
        nodes: places as u32,
        primitives: (places + size_of_val(nodes) / BLOCK_BYTES) as u32,
        node_count: nodes.len() as u32,
        low: whole.low.to_array(),
        high: whole.high.to_array(),
        ..bytemuck::Zeroable::zeroed()
    };
    let size = size_of::<BlobHeader>() + size_of_val(nodes) + records.len() * size_of::<InstanceRecord>();
    let mut bytes = Vec::with_capacity(size);
    bytes.extend_from_slice(bytemuck::bytes_of(&header));
    bytes.extend_from_slice(bytemuck::cast_slice(nodes));
    for number in &tree.order {
        bytes.extend_from_slice(bytemuck::bytes_of(&records[*number as usize].instance));
    }
    bytes
}
