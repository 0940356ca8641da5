//! Encodes a BLAS to bytes.

use glam::Vec3;
use rayon::prelude::*;

use super::indexed_triangles::{IndexedMesh, index_mesh};
use super::morton::union_of_all;
use super::nodes::{Bvh, BvhNodes};
use super::phase_times::PhaseTimes;
use super::primitives::{Mesh, MeshPrimitives};
use super::settings::BvhSettings;
use crate::accel::geometry::GeometryFlags;
use crate::accel::primitive_bounds::Bounds;
use crate::software_ray_query::layout::LeafKind;
use crate::software_ray_query::layout::{
    BLOCK_BYTES, BlobHeader, FORMAT_BVH2, FORMAT_BVH8, GeometryRecord, LeafBox, LeafIndexed, LeafPacked,
    LeafTriangle,
};

/// The bytes of a BLAS, ready for upload.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct BlasBlob {
    pub(crate) bytes: Vec<u8>,
    /// Bounds of all primitives.
    pub(crate) bounds: Bounds,
}

impl BlasBlob {
    /// Returns the header.
    pub(crate) fn header(&self) -> BlobHeader {
        let bytes = self.bytes.get(..size_of::<BlobHeader>());
        bytes.map_or_else(bytemuck::Zeroable::zeroed, bytemuck::pod_read_unaligned)
    }
}

/// The leaves of a BLAS: complete primitives in the order of the mesh, or vertex indices in the order of the tree.
enum EncodedLeaves<'a> {
    Boxes(&'a [LeafBox]),
    Triangles(&'a [LeafTriangle]),
    Indexed(Vec<LeafIndexed>),
    Packed(Vec<LeafPacked>),
}

impl EncodedLeaves<'_> {
    fn kind(&self) -> LeafKind {
        match self {
            Self::Boxes(_) => LeafKind::Boxes,
            Self::Triangles(_) => LeafKind::Triangles,
            Self::Indexed(_) => LeafKind::IndexedTriangles,
            Self::Packed(_) => LeafKind::PackedTriangles,
        }
    }

    fn size(&self) -> usize {
        match self {
            Self::Boxes(leaves) => size_of_val(*leaves),
            Self::Triangles(leaves) => size_of_val(*leaves),
            Self::Indexed(leaves) => size_of_val(&leaves[..]),
            Self::Packed(leaves) => size_of_val(&leaves[..]),
        }
    }

    /// Appends the leaves in the order of the tree. Returns their offset in blocks.
    ///
    /// Leaves with vertex indices already have this order.
    fn append(&self, bytes: &mut BlobBytes, order: &[u32]) -> u32 {
        match self {
            Self::Boxes(leaves) => bytes.append_in_order(leaves, order),
            Self::Triangles(leaves) => bytes.append_in_order(leaves, order),
            Self::Indexed(leaves) => bytes.append(bytemuck::cast_slice(leaves)),
            Self::Packed(leaves) => bytes.append(bytemuck::cast_slice(leaves)),
        }
    }
}

/// Leaves, and the vertices that their indices refer to.
struct LeavesAndVertices<'a> {
    leaves: EncodedLeaves<'a>,
    vertices: Vec<Vec3>,
}

impl LeavesAndVertices<'_> {
    /// Returns the bytes of all parts.
    fn size(&self) -> usize {
        self.leaves.size() + size_of_val(&self.vertices[..])
    }
}

/// Builds a tree over the mesh and encodes it. The bytes are the same for any number of threads.
pub(crate) fn encode_blas(mesh: &Mesh, quality: BvhSettings) -> BlasBlob {
    encode_blas_timed(mesh, quality, &mut PhaseTimes::off())
}

/// As [`encode_blas`], and measures the phases.
pub(crate) fn encode_blas_timed(mesh: &Mesh, quality: BvhSettings, times: &mut PhaseTimes) -> BlasBlob {
    let (bounds, whole) = times.run("bounds", || {
        let bounds = mesh.bounds();
        let whole = union_of_all(&bounds);
        (bounds, whole)
    });
    let tree = Bvh::build(bounds, || mesh.bounds(), times);
    BlasBlob { bytes: times.run("encoding", || encode_bvh(mesh, &tree, quality, whole)), bounds: whole }
}

pub(crate) fn encode_bvh(mesh: &Mesh, tree: &Bvh, quality: BvhSettings, bounds: Bounds) -> Vec<u8> {
    let (format, nodes, node_count): (_, &[u8], _) = match &tree.nodes {
        BvhNodes::Wide(nodes) => (FORMAT_BVH8, bytemuck::cast_slice(nodes), nodes.len()),
        BvhNodes::Binary(nodes) => (FORMAT_BVH2, bytemuck::cast_slice(nodes), nodes.len()),
    };
    let leaves = encode_leaves(mesh, &tree.order, quality);
    let row = |flags: &GeometryFlags| GeometryRecord { flags: flags.bits(), reserved: [0; 3] };
    let geometries: Vec<_> = mesh.flags.iter().map(row).collect();
    let parts =
        [nodes.len(), leaves.leaves.size(), size_of_val(&leaves.vertices[..]), size_of_val(&geometries[..])];
    let blocks = parts.map(|part| part.next_multiple_of(BLOCK_BYTES)).iter().sum::<usize>();
    let mut bytes = BlobBytes {
        bytes: bytemuck::zeroed_vec(size_of::<BlobHeader>() + blocks),
        end: size_of::<BlobHeader>(),
    };
    let header = BlobHeader {
        format,
        leaf_kind: leaves.leaves.kind() as u32,
        root: tree.root,
        primitive_count: tree.order.len() as u32,
        nodes: bytes.append(nodes),
        primitives: leaves.leaves.append(&mut bytes, &tree.order),
        vertices: bytes.append(bytemuck::cast_slice(&leaves.vertices)),
        geometries: bytes.append(bytemuck::cast_slice(&geometries)),
        node_count: node_count as u32,
        geometry_count: geometries.len() as u32,
        marks: opacity_flags(&mesh.flags),
        low: bounds.low.to_array(),
        high: bounds.high.to_array(),
        ..bytemuck::Zeroable::zeroed()
    };
    let mut bytes = bytes.bytes;
    bytes[..size_of::<BlobHeader>()].copy_from_slice(bytemuck::bytes_of(&header));
    bytes
}

/// The bytes of a BLAS while its parts are written. All are 0 before.
struct BlobBytes {
    bytes: Vec<u8>,
    /// The end of the parts that are written: whole blocks.
    end: usize,
}

impl BlobBytes {
    /// Bytes that one task copies.
    const TASK_BYTES: usize = 1 << 18;

    /// Appends a part. Returns its offset in blocks.
    fn append(&mut self, part: &[u8]) -> u32 {
        let (place, target) = self.next_part(part.len());
        let chunks = target.par_chunks_mut(Self::TASK_BYTES).zip(part.par_chunks(Self::TASK_BYTES));
        chunks.for_each(|(target, part)| target.copy_from_slice(part));
        place
    }

    /// Appends primitives in the order of a tree. Returns their offset in blocks. A primitive must be whole blocks.
    fn append_in_order<T: bytemuck::NoUninit + Sync>(&mut self, primitives: &[T], order: &[u32]) -> u32 {
        const { assert!(size_of::<T>().is_multiple_of(BLOCK_BYTES)) };
        let (place, target) = self.next_part(size_of::<T>() * order.len());
        let numbers = Self::TASK_BYTES / size_of::<T>();
        let chunks = target.par_chunks_mut(numbers * size_of::<T>()).zip(order.par_chunks(numbers));
        chunks.for_each(|(target, order)| {
            for (target, number) in target.chunks_exact_mut(size_of::<T>()).zip(order) {
                target.copy_from_slice(bytemuck::bytes_of(&primitives[*number as usize]));
            }
        });
        place
    }

    /// Returns the offset of the next part in blocks, and its bytes.
    fn next_part(&mut self, length: usize) -> (u32, &mut [u8]) {
        let start = self.end;
        self.end = (start + length).next_multiple_of(BLOCK_BYTES);
        ((start / BLOCK_BYTES) as u32, &mut self.bytes[start..start + length])
    }
}

fn encode_leaves<'a>(mesh: &'a Mesh, order: &[u32], quality: BvhSettings) -> LeavesAndVertices<'a> {
    let copies = |list| LeavesAndVertices { leaves: list, vertices: Vec::new() };
    match &mesh.primitives {
        MeshPrimitives::Boxes(boxes) => copies(EncodedLeaves::Boxes(boxes)),
        MeshPrimitives::Triangles(triangles) => {
            let copies = copies(EncodedLeaves::Triangles(triangles));
            let small = quality
                .low_memory
                .then(|| index_mesh(mesh, triangles, order))
                .flatten()
                .map(encode_indexed_leaves);
            small.filter(|small| small.size() < copies.size()).unwrap_or(copies)
        }
    }
}

/// Encodes leaves with vertex indices, in the smallest format that fits.
fn encode_indexed_leaves(IndexedMesh { triangles, vertices }: IndexedMesh) -> LeavesAndVertices<'static> {
    let list = if LeafKind::with_vertex_indices(vertices.len()) == LeafKind::PackedTriangles {
        EncodedLeaves::Packed(triangles.par_iter().map(LeafPacked::encode).collect())
    } else {
        EncodedLeaves::Indexed(triangles)
    };
    LeavesAndVertices { leaves: list, vertices }
}

fn opacity_flags(flags: &[GeometryFlags]) -> u32 {
    let opaque = flags.iter().filter(|flags| flags.contains(GeometryFlags::OPAQUE)).count();
    match opaque {
        0 => BlobHeader::NONE_OPAQUE,
        count if count == flags.len() => BlobHeader::ALL_OPAQUE,
        _ => 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SMALL: BvhSettings = BvhSettings { low_memory: true, refit: false };
    const SMALL_MOVING: BvhSettings = BvhSettings { low_memory: true, refit: true };

    /// A grid of cells of two triangles with shared vertices. Each position has `numbers` vertices.
    fn grid(side: u32, numbers: u32) -> Mesh {
        let corner = |x: u32, y: u32, cell: u32| (y * (side + 1) + x) * numbers + cell % numbers;
        let cell = |cell: u32| {
            let (x, y) = (cell % side, cell / side);
            let [a, b, c, d] = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(i, j)| corner(x + i, y + j, cell));
            [[a, b, c], [b, d, c]]
        };
        let vertices: Vec<_> = (0..side * side).flat_map(cell).collect();
        let position = |vertex: u32| {
            let (x, y) = (vertex / numbers % (side + 1), vertex / numbers / (side + 1));
            Vec3::new(x as f32, y as f32, (x * y % 5) as f32)
        };
        let triangle = |(primitive, named): (u32, &[u32; 3])| {
            let [a, b, c] = named.map(position);
            LeafTriangle { a, primitive, b, geometry: 0, c, opaque: 1 }
        };
        let primitives = MeshPrimitives::Triangles((0..).zip(&vertices).map(triangle).collect());
        Mesh { primitives, vertices, flags: vec![GeometryFlags::OPAQUE] }
    }

    fn bytes_each(mesh: &Mesh, quality: BvhSettings) -> (u32, f64) {
        let blob = encode_blas(mesh, quality);
        (blob.header().leaf_kind, blob.bytes.len() as f64 / f64::from(blob.header().primitive_count))
    }

    /// Nodes take about 8 of the 28 bytes, the leaf 12, and the vertices, half as many as triangles, 6.
    #[test]
    fn a_triangle_takes_less_than_28_bytes_with_low_memory() {
        let shared = grid(80, 1);
        let (kind, bytes) = bytes_each(&shared, SMALL_MOVING);
        assert!(kind == LeafKind::PackedTriangles as u32 && bytes < 28.0, "{bytes} with updates");
        assert_eq!(bytes_each(&Mesh { vertices: Vec::new(), ..shared }, SMALL), (kind, bytes), "without");
    }

    /// Only leaves that never move share a position that has a vertex for each of its cells.
    #[test]
    fn leaves_name_vertices_where_copies_take_more() {
        let apart = grid(30, 900);
        let (kind, with_updates) = bytes_each(&apart, SMALL_MOVING);
        assert!(kind == LeafKind::PackedTriangles as u32, "four vertices for two triangles");
        let MeshPrimitives::Triangles(all) = &apart.primitives else { unreachable!("triangles") };
        let unshared = (0..all.len() as u32).map(|number| [0, 1, 2].map(|step| number * 3 + step)).collect();
        let (kind, copies) = bytes_each(&Mesh { vertices: unshared, ..apart.clone() }, SMALL_MOVING);
        assert!(kind == LeafKind::Triangles as u32 && copies > with_updates, "three for each");
        let (kind, shared) = bytes_each(&Mesh { vertices: Vec::new(), ..apart }, SMALL);
        assert!(kind == LeafKind::PackedTriangles as u32 && shared < with_updates, "one for both");
    }

    /// The leaf of one triangle that refers to the last of `count` vertices.
    fn last_of(count: usize) -> (LeafIndexed, LeavesAndVertices<'static>) {
        let vertices = [0, 1, count as u32 - 1];
        let triangle = LeafIndexed { vertices, primitive: 7 };
        (
            triangle,
            encode_indexed_leaves(IndexedMesh {
                triangles: vec![triangle],
                vertices: vec![Vec3::ZERO; count],
            }),
        )
    }

    fn bytes_of(leaves: &LeavesAndVertices<'_>) -> Vec<u8> {
        let size = leaves.leaves.size().next_multiple_of(BLOCK_BYTES);
        let mut bytes = BlobBytes { bytes: vec![0; size], end: 0 };
        leaves.leaves.append(&mut bytes, &[]);
        bytes.bytes
    }

    #[test]
    fn leaves_are_packed_where_all_vertices_have_names() {
        let (triangle, leaves) = last_of(LeafPacked::MAX_VERTICES);
        assert_eq!(leaves.leaves.kind(), LeafKind::PackedTriangles);
        assert!(bytes_of(&leaves).starts_with(bytemuck::bytes_of(&LeafPacked::encode(&triangle))));
        let (triangle, leaves) = last_of(LeafPacked::MAX_VERTICES + 1);
        assert_eq!(leaves.leaves.kind(), LeafKind::IndexedTriangles);
        assert_eq!(bytes_of(&leaves), bytemuck::bytes_of(&triangle));
    }
}
