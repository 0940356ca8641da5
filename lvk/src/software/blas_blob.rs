//! The bytes of a bottom-level structure.

use glam::Vec3;

use super::mesh::{Mesh, Primitives};
use super::quality::Quality;
use super::tree::{Nodes, Tree};
use super::vertices::{Indexed, indexed};
use crate::accel::bounds::Bounds;
use crate::accel::geometry::GeometryFlags;
use crate::accel::software::layout::LeafKind;
use crate::accel::software::layout::{
    BINARY, BLOCK_BYTES, GeometryRow, Header, LeafBox, LeafPacked, LeafTriangle, WIDE,
};

/// A structure, ready to be copied to the GPU.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct BlasBlob {
    pub(crate) bytes: Vec<u8>,
    /// Of all primitives.
    pub(crate) bounds: Bounds,
}

impl BlasBlob {
    /// Its header.
    pub(crate) fn header(&self) -> Header {
        let bytes = self.bytes.get(..size_of::<Header>());
        bytes.map_or_else(bytemuck::Zeroable::zeroed, bytemuck::pod_read_unaligned)
    }
}

/// The leaves of a structure.
struct Leaves {
    kind: LeafKind,
    bytes: Vec<u8>,
    vertices: Vec<Vec3>,
}

/// Builds a tree over the mesh and packs it.
pub(crate) fn build(mesh: &Mesh, quality: Quality) -> BlasBlob {
    let bounds = mesh.bounds();
    let tree = Tree::of_mesh(&bounds);
    let whole = bounds.into_iter().fold(Bounds::EMPTY, Bounds::union);
    BlasBlob { bytes: pack(mesh, &tree, quality, whole), bounds: whole }
}

pub(super) fn pack(mesh: &Mesh, tree: &Tree, quality: Quality, bounds: Bounds) -> Vec<u8> {
    let (format, nodes, node_count): (_, &[u8], _) = match &tree.nodes {
        Nodes::Wide(nodes) => (WIDE, bytemuck::cast_slice(nodes), nodes.len()),
        Nodes::Binary(nodes) => (BINARY, bytemuck::cast_slice(nodes), nodes.len()),
    };
    let leaves = leaves(mesh, &tree.order, quality);
    let row = |flags: &GeometryFlags| GeometryRow { flags: flags.bits(), reserved: [0; 3] };
    let geometries: Vec<_> = mesh.flags.iter().map(row).collect();
    let parents = if quality.refit { tree.parents() } else { Vec::new() };
    let mut bytes = vec![0; size_of::<Header>()];
    let header = Header {
        format,
        leaf_kind: leaves.kind as u32,
        root: tree.root,
        primitive_count: tree.order.len() as u32,
        nodes: append(&mut bytes, nodes),
        primitives: append(&mut bytes, &leaves.bytes),
        vertices: append(&mut bytes, bytemuck::cast_slice(&leaves.vertices)),
        geometries: append(&mut bytes, bytemuck::cast_slice(&geometries)),
        node_count: node_count as u32,
        geometry_count: geometries.len() as u32,
        parents: if parents.is_empty() { 0 } else { append(&mut bytes, bytemuck::cast_slice(&parents)) },
        marks: marks(&mesh.flags),
        low: bounds.low.to_array(),
        high: bounds.high.to_array(),
        ..bytemuck::Zeroable::zeroed()
    };
    bytes[..size_of::<Header>()].copy_from_slice(bytemuck::bytes_of(&header));
    bytes
}

/// Appends a part; answers its place in blocks.
fn append(bytes: &mut Vec<u8>, part: &[u8]) -> u32 {
    let place = bytes.len() / BLOCK_BYTES;
    bytes.extend_from_slice(part);
    bytes.resize(bytes.len().next_multiple_of(BLOCK_BYTES), 0);
    place as u32
}

fn leaves(mesh: &Mesh, order: &[u32], quality: Quality) -> Leaves {
    match &mesh.primitives {
        Primitives::Boxes(boxes) => {
            let ordered: Vec<LeafBox> = order.iter().map(|number| boxes[*number as usize]).collect();
            Leaves {
                kind: LeafKind::Boxes,
                bytes: bytemuck::cast_slice(&ordered).to_vec(),
                vertices: Vec::new(),
            }
        }
        Primitives::Triangles(triangles) => {
            let small = if quality.low_memory && !quality.refit {
                indexed(triangles, order, mesh.flags.len())
            } else {
                None
            };
            match small {
                Some(indexed) => naming(indexed),
                None => {
                    let ordered: Vec<LeafTriangle> =
                        order.iter().map(|number| triangles[*number as usize]).collect();
                    let bytes = bytemuck::cast_slice(&ordered).to_vec();
                    Leaves { kind: LeafKind::Triangles, bytes, vertices: Vec::new() }
                }
            }
        }
    }
}

/// Leaves that name vertices, as small as their numbers allow.
fn naming(Indexed { triangles, vertices }: Indexed) -> Leaves {
    let kind = LeafKind::naming(vertices.len());
    let bytes = if kind == LeafKind::PackedTriangles {
        let packed: Vec<_> = triangles.iter().map(LeafPacked::of).collect();
        bytemuck::cast_slice(&packed).to_vec()
    } else {
        bytemuck::cast_slice(&triangles).to_vec()
    };
    Leaves { kind, bytes, vertices }
}

fn marks(flags: &[GeometryFlags]) -> u32 {
    let opaque = flags.iter().filter(|flags| flags.contains(GeometryFlags::OPAQUE)).count();
    match opaque {
        0 => Header::NONE_OPAQUE,
        count if count == flags.len() => Header::ALL_OPAQUE,
        _ => 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::software::layout::LeafIndexed;

    /// The leaves of one triangle that names the last of so many vertices.
    fn last_of(count: usize) -> (LeafIndexed, Leaves) {
        let vertices = [0, 1, count as u32 - 1];
        let triangle = LeafIndexed { vertices, primitive: 7 };
        (triangle, naming(Indexed { triangles: vec![triangle], vertices: vec![Vec3::ZERO; count] }))
    }

    #[test]
    fn leaves_are_packed_where_all_vertices_have_names() {
        let (triangle, leaves) = last_of(LeafPacked::MOST_VERTICES);
        assert_eq!(leaves.kind, LeafKind::PackedTriangles);
        assert_eq!(leaves.bytes, bytemuck::bytes_of(&LeafPacked::of(&triangle)));
        let (triangle, leaves) = last_of(LeafPacked::MOST_VERTICES + 1);
        assert_eq!(leaves.kind, LeafKind::IndexedTriangles);
        assert_eq!(leaves.bytes, bytemuck::bytes_of(&triangle));
    }
}
