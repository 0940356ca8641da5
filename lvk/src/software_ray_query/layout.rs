//! Memory layout of software acceleration structures; the same numbers as in
//! `software_ray_query/glsl/software_layout.glsl`.
//!
//! A BLAS or TLAS is one range of a buffer. Its header has the offsets of its parts in 16-byte blocks from its own
//! start, so that it can be copied unchanged.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Bytes of a block.
pub(crate) const BLOCK_BYTES: usize = 16;
/// Reference to no node; as the root, the acceleration structure is empty.
pub(crate) const NONE: u32 = u32::MAX;
/// Marks a reference to a leaf.
pub(crate) const LEAF: u32 = 1 << 31;
/// Maximum primitives of a leaf reference.
pub(crate) const MAX_LEAF_PRIMITIVES: usize = 16;
/// Maximum nodes on a path of a BVH2: the traversal pushes an entry for each.
pub(crate) const MAX_BVH2_DEPTH: usize = 64;
/// Maximum nodes on a path of a BVH8: the traversal pushes an entry for each.
pub(crate) const MAX_BVH8_DEPTH: usize = 32;

/// [`BlobHeader::format`]: nodes of eight compressed children.
pub(crate) const FORMAT_BVH8: u32 = 0;
/// [`BlobHeader::format`]: nodes of two children.
pub(crate) const FORMAT_BVH2: u32 = 1;
/// [`MovedHeader::format`].
pub(crate) const FORMAT_MOVED: u32 = 2;

/// Content of leaves, by the number in the header.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub(crate) enum LeafKind {
    /// Triangles with vertex positions, 48 bytes.
    Triangles = 0,
    /// Triangles with indices into a copy of the vertices, 16 bytes.
    IndexedTriangles = 1,
    /// AABBs, 32 bytes.
    Boxes = 2,
    /// Instances, 128 bytes.
    Instances = 3,
    /// Triangles with indices of 21 bits into a copy of the vertices, 12 bytes.
    PackedTriangles = 4,
}

impl LeafKind {
    /// Returns the smallest kind of triangles with indices into a copy of `vertices` vertices.
    pub(crate) fn with_vertex_indices(vertices: usize) -> Self {
        if vertices <= LeafPacked::MAX_VERTICES { Self::PackedTriangles } else { Self::IndexedTriangles }
    }

    /// True if leaves have indices into a copy of the vertices.
    pub(crate) fn has_vertex_indices(self) -> bool {
        matches!(self, Self::IndexedTriangles | Self::PackedTriangles)
    }

    /// Returns the bytes of a primitive in the leaves.
    pub(crate) fn primitive_bytes(self) -> u64 {
        match self {
            Self::Triangles => 48,
            Self::IndexedTriangles => 16,
            Self::PackedTriangles => 12,
            Self::Boxes => 32,
            Self::Instances => 128,
        }
    }
}

/// The first 128 bytes of an acceleration structure.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct BlobHeader {
    pub(crate) format: u32,
    /// A number of [`LeafKind`].
    pub(crate) leaf_kind: u32,
    /// Reference to a node or a leaf, or [`NONE`].
    pub(crate) root: u32,
    pub(crate) primitive_count: u32,
    /// Offset of the nodes; this offset and the next three count blocks.
    pub(crate) nodes: u32,
    pub(crate) primitives: u32,
    pub(crate) vertices: u32,
    pub(crate) geometries: u32,
    pub(crate) node_count: u32,
    pub(crate) geometry_count: u32,
    pub(crate) reserved0: u32,
    /// [`BlobHeader::ALL_OPAQUE`], [`BlobHeader::NONE_OPAQUE`].
    pub(crate) marks: u32,
    pub(crate) low: [f32; 3],
    pub(crate) high: [f32; 3],
    pub(crate) reserved: [u32; 14],
}

impl BlobHeader {
    /// Every geometry is opaque.
    pub(crate) const ALL_OPAQUE: u32 = 1;
    /// No geometry is opaque.
    pub(crate) const NONE_OPAQUE: u32 = 2;
}

/// A triangle with vertex positions.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct LeafTriangle {
    pub(crate) a: Vec3,
    pub(crate) primitive: u32,
    pub(crate) b: Vec3,
    pub(crate) geometry: u32,
    pub(crate) c: Vec3,
    /// 1 if it is opaque.
    pub(crate) opaque: u32,
}

/// A triangle with vertex indices.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
pub(crate) struct LeafIndexed {
    pub(crate) vertices: [u32; 3],
    /// Index of the primitive, with the geometry in the highest 8 bits if there are several.
    pub(crate) primitive: u32,
}

/// Like [`LeafIndexed`], with 21 bits for each vertex. The first and the second vertex are in the lowest bits of a word
/// each. The third has 11 bits above the first and 10 bits above the second.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
pub(crate) struct LeafPacked {
    names: [u32; 2],
    primitive: u32,
}

impl LeafPacked {
    const VERTEX_BITS: u32 = 21;
    const ID_BITS: u32 = u32::BITS - Self::VERTEX_BITS;
    /// Maximum vertices that 21 bits can index.
    pub(crate) const MAX_VERTICES: usize = 1 << Self::VERTEX_BITS;

    /// Encodes a leaf whose indices are below [`MAX_VERTICES`](Self::MAX_VERTICES).
    pub(crate) fn encode(leaf: &LeafIndexed) -> Self {
        let [a, b, c] = leaf.vertices;
        let names = [a | c << Self::VERTEX_BITS, b | c >> Self::ID_BITS << Self::VERTEX_BITS];
        Self { names, primitive: leaf.primitive }
    }

    /// Returns the vertex indices. The highest bit of the third index is part of it, as in shaders.
    pub(crate) fn vertices(&self) -> [u32; 3] {
        let [a, b] = self.names;
        let name = |word| word & (Self::MAX_VERTICES as u32 - 1);
        [name(a), name(b), a >> Self::VERTEX_BITS | b >> Self::VERTEX_BITS << Self::ID_BITS]
    }
}

/// An AABB.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct LeafBox {
    pub(crate) low: Vec3,
    pub(crate) primitive: u32,
    pub(crate) high: Vec3,
    /// Index of the geometry, with [`LeafBox::OPAQUE`] if it is opaque.
    pub(crate) geometry: u32,
}

impl LeafBox {
    /// Marks the geometry index of an opaque AABB.
    pub(crate) const OPAQUE: u32 = 1 << 31;
}

/// A node of two children.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct Bvh2NodeRecord {
    pub(crate) low0: Vec3,
    pub(crate) child0: u32,
    pub(crate) high0: Vec3,
    pub(crate) child1: u32,
    pub(crate) low1: Vec3,
    pub(crate) reserved0: u32,
    pub(crate) high1: Vec3,
    pub(crate) reserved1: u32,
}

/// An entry of the table of geometries.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
pub(crate) struct GeometryRecord {
    /// [`GeometryFlags`](crate::GeometryFlags).
    pub(crate) flags: u32,
    pub(crate) reserved: [u32; 3],
}

/// The start of a BLAS that has moved.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
pub(crate) struct MovedHeader {
    /// [`FORMAT_MOVED`].
    pub(crate) format: u32,
    pub(crate) leaf_kind: u32,
    /// Address of the target BLAS, which has not moved itself.
    pub(crate) address: u64,
}

/// An instance of a BLAS.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct InstanceRecord {
    /// Matrix of 3 rows of 4 columns.
    pub(crate) world_to_object: [f32; 12],
    /// Matrix of 3 rows of 4 columns.
    pub(crate) object_to_world: [f32; 12],
    pub(crate) structure: u64,
    /// 24 bits custom index, 8 bits mask.
    pub(crate) custom_index_and_mask: u32,
    /// 24 bits hit-group offset, 8 bits flags.
    pub(crate) hit_group_offset_and_flags: u32,
    /// Index of the instance in the caller's list.
    pub(crate) number: u32,
    /// Entry point of rays: a node except the first, or a leaf; 0 for the root.
    pub(crate) entry: u32,
    pub(crate) reserved: [u32; 2],
}

/// Returns the reference to `count` primitives of leaves, 1 to [`MAX_LEAF_PRIMITIVES`].
pub(crate) fn leaf(first: u32, count: usize) -> u32 {
    LEAF | (count as u32 - 1) << 27 | first
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packed_leaves_name_what_they_were_made_of() {
        const LAST: u32 = (1 << 21) - 1;
        let some = [0, 1, (1 << 11) - 1, 1 << 11, 1_234_567, LAST - 1, LAST];
        for number in 0..some.len().pow(3) {
            let vertices = [0, 1, 2].map(|corner| some[number / some.len().pow(corner) % some.len()]);
            for primitive in [0, 0x0100_0002, u32::MAX] {
                let packed = LeafPacked::encode(&LeafIndexed { vertices, primitive });
                assert_eq!((packed.vertices(), packed.primitive), (vertices, primitive));
            }
        }
    }

    #[test]
    fn leaves_are_packed_up_to_two_to_the_21_vertices() {
        assert_eq!(LeafKind::with_vertex_indices(0), LeafKind::PackedTriangles);
        assert_eq!(LeafKind::with_vertex_indices(1 << 21), LeafKind::PackedTriangles);
        assert_eq!(LeafKind::with_vertex_indices((1 << 21) + 1), LeafKind::IndexedTriangles);
    }

    #[test]
    fn everything_has_the_bytes_that_shaders_read() {
        assert_eq!(size_of::<BlobHeader>(), 128);
        assert_eq!(size_of::<LeafTriangle>(), 48);
        assert_eq!(size_of::<LeafIndexed>(), 16);
        assert_eq!(size_of::<LeafPacked>(), 12);
        assert_eq!(size_of::<LeafBox>(), 32);
        assert_eq!(size_of::<Bvh2NodeRecord>(), 64);
        assert_eq!(size_of::<GeometryRecord>(), 16);
        assert_eq!(size_of::<MovedHeader>(), 16);
        assert_eq!(size_of::<InstanceRecord>(), 128);
        assert_eq!(leaf(5, 3), 0x9000_0005);
    }
}
