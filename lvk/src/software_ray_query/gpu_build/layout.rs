//! Memory sizes of a build on the GPU, and the offsets of its parts.

use super::geometry::GpuGeometry;
use super::params::GpuBuildParams;
use crate::accel::geometry::GeometryFlags;
use crate::error::limit_origin::LimitOrigin;
use crate::error::{Result, check_limit_of};
use crate::software_ray_query::layout::{BLOCK_BYTES, LeafKind};

/// Bytes of the header of an acceleration structure.
pub(crate) const HEADER_BYTES: u64 = 128;
/// Bytes of a binary node.
const BINARY_NODE_BYTES: u64 = 64;
/// Bytes of the costs of a binary node and of the decisions about it.
pub(crate) const DECISION_BYTES: u64 = 32;
/// Bytes of a wide node.
const WIDE_NODE_BYTES: u64 = 80;
/// Maximum primitives of a BLAS that is a single leaf, without nodes.
const MAX_SINGLE_LEAF: u32 = 3;
/// Capacity in wide nodes for a thousand primitives, in addition to the first nodes. With it, a triangle takes 56 bytes
/// including the header.
const BVH8_NODES_PER_THOUSAND: u64 = 99;
const GEOMETRY_BYTES: u64 = 16;
/// Bytes of a vertex that leaves refer to.
pub(crate) const VERTEX_BYTES: u64 = 12;
const BLOB_ALIGNMENT: u64 = 256;
/// Maximum primitives: the first primitive of a leaf has 27 bits.
const MAX_PRIMITIVES: u64 = 1 << 27;
/// Maximum primitives of a build by one workgroup.
const MAX_SMALL_BUILD: u32 = 2048;
/// Keys that a workgroup sorts, `kBlock` of `software_ray_query/kernels/build_params.glsl`.
pub(crate) const SORT_BLOCK: u32 = 1024;
/// Values of a digit in large builds.
pub(crate) const DIGITS: u32 = 256;
/// Words of the counts of digits in all, `kDigitTotals` of `software_ray_query/kernels/build_params.glsl`.
pub(crate) const DIGIT_TOTAL_WORDS: u32 = 8 * DIGITS;
/// Maximum nodes on a path that traversal supports.
pub(crate) const MAX_HEIGHT: u32 = 64;
/// Bits of the first word of a code.
const CODE_BITS: u32 = 30;
/// Maximum bits of the second word: one pass of the sort.
const MAX_LOW_BITS: u32 = 8;
/// Words of the build state, `kStateWords` of `software_ray_query/kernels/build_params.glsl`.
pub(crate) const STATE_WORDS: u64 = 48;
const BOX_WORDS: u64 = 6;

/// Content of a BLAS to build.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct BlasShape {
    pub(crate) leaf_kind: LeafKind,
    /// Primitives of all geometries, inactive ones included.
    pub(crate) primitive_count: u32,
    /// Vertices of all geometries; used only if leaves have vertex indices.
    pub(crate) vertex_count: u32,
    pub(crate) geometry_count: u32,
}

/// Offsets of the parts of an acceleration structure, in units of 16 bytes from its start; 0 for a missing part.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct BlobOffsets {
    pub(crate) nodes: u32,
    pub(crate) primitives: u32,
    pub(crate) vertices: u32,
    pub(crate) geometries: u32,
}

/// Offsets of the parts of the scratch memory of a build, in words from its start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct ScratchOffsets {
    pub(crate) boxes: u32,
    pub(crate) keys: u32,
    pub(crate) spare_keys: u32,
    pub(crate) digits: u32,
    pub(crate) arrivals: u32,
    pub(crate) parents: u32,
    /// Binary nodes and the decisions about them, if the acceleration structure has wide ones.
    pub(crate) binary: u32,
}

/// Sizes and offsets of a build on the GPU, as far as counts determine them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct GpuBuildPlan {
    pub(crate) leaf_kind: LeafKind,
    /// Maximum primitives or instances.
    pub(crate) capacity: u32,
    pub(crate) vertex_count: u32,
    pub(crate) geometry_count: u32,
    /// Maximum nodes of a BLAS; 0 for a TLAS, whose nodes stay binary.
    pub(crate) wide_capacity: u32,
    /// Offsets of the parts of the acceleration structure.
    pub(crate) offsets: BlobOffsets,
    /// Bytes of the acceleration structure, a multiple of 256.
    pub(crate) blob_bytes: u64,
    /// Bytes of scratch memory of a build, at an address that is a multiple of 16.
    pub(crate) scratch_bytes: u64,
    pub(crate) scratch: ScratchOffsets,
    /// Bits of the second word of a code; 0 for codes of one word.
    pub(crate) low_bits: u32,
}

/// The inputs of a build.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum BuildSource {
    /// Geometries, as many as the plan has.
    Geometries(Vec<GpuGeometry>),
    /// Records of 64 bytes each (`VkAccelerationStructureInstanceKHR`).
    Instances {
        /// Address of the first record, a multiple of 16.
        records: u64,
        /// Number of records, at most the plan's capacity.
        count: u32,
        /// Address and length of a table of BLAS addresses, if records name their BLAS by index; `None` if they contain
        /// addresses. Address 0 and an index outside the table are an instance that no ray hits.
        table: Option<(u64, u32)>,
    },
}

impl GpuBuildPlan {
    /// Returns the plan of a BLAS.
    ///
    /// # Errors
    /// [`LimitExceeded`](Error::LimitExceeded) for more primitives than the format can index.
    pub(crate) fn blas(name: &str, shape: &BlasShape) -> Result<Self> {
        Self::new(name, shape)
    }

    /// Returns the plan of a TLAS with a capacity of `capacity` instances.
    ///
    /// # Errors
    /// [`LimitExceeded`](Error::LimitExceeded) for more instances than the format can index.
    pub(crate) fn tlas(name: &str, capacity: u32) -> Result<Self> {
        let shape = BlasShape {
            leaf_kind: LeafKind::Instances,
            primitive_count: capacity,
            vertex_count: 0,
            geometry_count: 0,
        };
        Self::new(name, &shape)
    }

    fn new(name: &str, shape: &BlasShape) -> Result<Self> {
        let what = if shape.leaf_kind == LeafKind::Instances { "instance count" } else { "primitive count" };
        check_limit_of(LimitOrigin::Library, name, what, shape.primitive_count.into(), MAX_PRIMITIVES)?;
        let vertex_count = if shape.leaf_kind.has_vertex_indices() { shape.vertex_count } else { 0 };
        let (places, blob_bytes) = blob_offsets(name, shape, vertex_count)?;
        let low_bits = low_bit_mask(shape);
        let (scratch, scratch_bytes) = scratch_offsets(shape, low_bits > 0);
        Ok(Self {
            leaf_kind: shape.leaf_kind,
            capacity: shape.primitive_count,
            vertex_count,
            geometry_count: shape.geometry_count,
            wide_capacity: bvh8_node_capacity(shape),
            offsets: places,
            blob_bytes,
            scratch_bytes,
            scratch,
            low_bits,
        })
    }

    /// Returns the maximum binary nodes of the build.
    pub(crate) fn node_capacity(&self) -> u32 {
        self.capacity.saturating_sub(1)
    }

    /// Returns the bytes that a BLAS needs in addition to [`blob_bytes`](Self::blob_bytes) if all its nodes are binary.
    /// Some trees of the CPU are.
    pub(crate) fn bvh2_excess_bytes(&self) -> u64 {
        let wide = u64::from(self.wide_capacity) * WIDE_NODE_BYTES;
        (u64::from(self.node_capacity()) * BINARY_NODE_BYTES).saturating_sub(wide)
    }

    /// Returns the maximum binary nodes on a path from the root to a leaf, at most [`MAX_HEIGHT`]. The header of a TLAS
    /// has the actual height.
    #[cfg(any(test, feature = "test-hooks"))]
    pub(crate) fn max_height(&self) -> u32 {
        self.node_capacity().min(MAX_HEIGHT)
    }

    /// True if one workgroup makes the whole build of `count` primitives or instances.
    pub(crate) fn is_small(&self, count: u32) -> bool {
        count.max(self.geometry_count) <= MAX_SMALL_BUILD && self.vertex_count <= 3 * MAX_SMALL_BUILD
    }

    /// Returns the parameters of the kernels for one build. `inputs` is the address of the geometries; instances have
    /// their own address.
    pub(crate) fn build_params(
        &self,
        source: &BuildSource,
        inputs: u64,
        blob: u64,
        scratch: u64,
    ) -> GpuBuildParams {
        let (inputs, table, count, input_count) = match source {
            BuildSource::Geometries(list) => (inputs, 0, self.capacity, list.len() as u32),
            BuildSource::Instances { records, count, table } => {
                let (table, entries) = table.unwrap_or((0, 0));
                (*records, table, *count, entries)
            }
        };
        GpuBuildParams {
            inputs,
            table,
            blob,
            scratch,
            parents: scratch + u64::from(self.scratch.parents) * 4,
            binary: match self.leaf_kind {
                LeafKind::Instances => blob + u64::from(self.offsets.nodes) * BLOCK_BYTES as u64,
                _ => scratch + u64::from(self.scratch.binary) * 4,
            },
            count,
            input_count,
            leaf_kind: self.leaf_kind as u32,
            low_bits: self.low_bits,
            nodes: self.offsets.nodes,
            primitives: self.offsets.primitives,
            vertices: self.offsets.vertices,
            geometries: self.offsets.geometries,
            vertex_count: self.vertex_count,
            boxes: self.scratch.boxes,
            keys: self.scratch.keys,
            spare_keys: self.scratch.spare_keys,
            digits: self.scratch.digits,
            arrivals: self.scratch.arrivals,
            node_capacity: count.saturating_sub(1),
            reserved: 0,
            wide_capacity: self.wide_capacity,
            header_flags: header_flags(source),
            unused: [0; 2],
        }
    }
}

impl BuildSource {
    /// Returns the number of primitives or instances that a build of `plan` reads.
    pub(crate) fn element_count(&self, plan: &GpuBuildPlan) -> u32 {
        match self {
            Self::Geometries(_) => plan.capacity,
            Self::Instances { count, .. } => *count,
        }
    }
}

/// Places parts one after the other.
struct OffsetAllocator {
    end: u64,
}

impl OffsetAllocator {
    /// Returns the offset of a part of `bytes`, in units of `unit` bytes. The part's alignment must be a multiple of
    /// `unit`.
    fn push(&mut self, bytes: u64, alignment: u64, unit: u64) -> u64 {
        let start = self.end.next_multiple_of(alignment);
        self.end = start + bytes;
        start / unit
    }
}

/// Returns the bits of the second word of a code.
///
/// Codes of one word have 1024 cells along an axis: fine enough for few primitives, and sorted in fewer passes. The
/// number of bits is limited so that no leaf has more than [`MAX_HEIGHT`] ranges above it, and the tree is no higher.
fn low_bit_mask(shape: &BlasShape) -> u32 {
    let few = if shape.leaf_kind == LeafKind::Instances { 1 << 15 } else { 1 << 12 };
    if shape.primitive_count <= few {
        return 0;
    }
    MAX_LOW_BITS.min(MAX_HEIGHT - CODE_BITS - number_bits(shape.primitive_count))
}

/// Returns the bits of a leaf's index.
fn number_bits(count: u32) -> u32 {
    u32::BITS - count.saturating_sub(1).leading_zeros()
}

/// Returns the header flags. Bit 0: every geometry is opaque; bit 1: no geometry is.
fn header_flags(source: &BuildSource) -> u32 {
    match source {
        BuildSource::Geometries(list) => {
            let opaque = |geometry: &GpuGeometry| geometry.flags & GeometryFlags::OPAQUE.bits() != 0;
            u32::from(list.iter().all(opaque)) | u32::from(!list.iter().any(opaque)) << 1
        }
        BuildSource::Instances { .. } => 0,
    }
}

/// Returns the capacity in wide nodes. It is more than most meshes need, and more than packed nodes need, which can
/// replace the nodes of any mesh.
fn bvh8_node_capacity(shape: &BlasShape) -> u32 {
    const FIRST: u32 = 2;
    match (shape.leaf_kind, shape.primitive_count) {
        (LeafKind::Instances, _) | (_, ..=MAX_SINGLE_LEAF) => 0,
        (_, count) => (u64::from(count) * BVH8_NODES_PER_THOUSAND / 1000) as u32 + FIRST,
    }
}

fn blob_offsets(name: &str, shape: &BlasShape, vertex_count: u32) -> Result<(BlobOffsets, u64)> {
    let nodes = match shape.leaf_kind {
        LeafKind::Instances => u64::from(shape.primitive_count.saturating_sub(1)) * BINARY_NODE_BYTES,
        _ => u64::from(bvh8_node_capacity(shape)) * WIDE_NODE_BYTES,
    };
    let primitives = u64::from(shape.primitive_count) * shape.leaf_kind.primitive_bytes();
    let mut layout = OffsetAllocator { end: HEADER_BYTES };
    let mut part = |bytes: u64, alignment| match bytes {
        0 => 0,
        bytes => layout.push(bytes, alignment, 16),
    };
    let places = [
        part(nodes, 64),
        part(primitives, 16),
        part(u64::from(vertex_count) * VERTEX_BYTES, 16),
        part(u64::from(shape.geometry_count) * GEOMETRY_BYTES, 16),
    ];
    let bytes = layout.end.next_multiple_of(BLOB_ALIGNMENT);
    check_limit_of(
        LimitOrigin::Library,
        name,
        "acceleration structure size in bytes",
        bytes,
        u64::from(u32::MAX) * 16,
    )?;
    let [nodes, primitives, vertices, geometries] = places.map(|place| place as u32);
    Ok((BlobOffsets { nodes, primitives, vertices, geometries }, bytes))
}

/// Returns the offsets. All are below 2^32 words, as kernels need: before the binary nodes, which kernels find by their
/// address, a primitive takes at most 14 1/4 words.
fn scratch_offsets(shape: &BlasShape, long_codes: bool) -> (ScratchOffsets, u64) {
    let count = u64::from(shape.primitive_count);
    let nodes = u64::from(shape.primitive_count.saturating_sub(1));
    let binary = match shape.leaf_kind {
        LeafKind::Instances => 0,
        _ => nodes * (BINARY_NODE_BYTES + DECISION_BYTES) / 4,
    };
    let keys = count * if long_codes { 3 } else { 2 };
    let blocks = u64::from(shape.primitive_count.div_ceil(SORT_BLOCK));
    let mut layout = OffsetAllocator { end: STATE_WORDS * 4 };
    let mut part = |words: u64| layout.push(words * 4, 16, 4) as u32;
    let places = ScratchOffsets {
        boxes: part(count * BOX_WORDS),
        keys: part(keys),
        spare_keys: part(keys),
        digits: part(u64::from(DIGIT_TOTAL_WORDS) + blocks * u64::from(DIGITS)),
        arrivals: part(nodes),
        parents: part(nodes),
        binary: part(binary),
    };
    (places, layout.end.next_multiple_of(16))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const MESH: BlasShape =
        BlasShape { leaf_kind: LeafKind::Triangles, primitive_count: 0, vertex_count: 0, geometry_count: 1 };

    fn kinds() -> impl Strategy<Value = LeafKind> {
        use LeafKind::{Boxes, IndexedTriangles, PackedTriangles, Triangles};
        prop::sample::select(vec![Triangles, IndexedTriangles, PackedTriangles, Boxes])
    }

    fn shapes() -> impl Strategy<Value = BlasShape> {
        let counts = prop_oneof![0..10_u32, 0..10_000_u32, 0..=(1_u32 << 27)];
        (kinds(), counts, 0..1_000_000_u32, 0..3000_u32).prop_map(
            |(leaf_kind, primitive_count, vertex_count, geometry_count)| BlasShape {
                leaf_kind,
                primitive_count,
                vertex_count,
                geometry_count,
            },
        )
    }

    /// Fails if parts overlap, are not aligned, or exceed the memory.
    fn check_parts(mut parts: Vec<(u64, u64)>, start: u64, end: u64) {
        parts.retain(|(_, bytes)| *bytes > 0);
        parts.sort_unstable();
        let mut free = start;
        for (place, bytes) in parts {
            assert!(place >= free && place % 16 == 0);
            free = place + bytes;
        }
        assert!(free <= end);
    }

    proptest! {
        #[test]
        fn parts_of_a_structure_lie_apart(shape in shapes()) {
            let plan = GpuBuildPlan::blas("s", &shape).unwrap();
            let nodes = u64::from(plan.wide_capacity);
            let at = |place: u32| u64::from(place) * 16;
            let count = u64::from(shape.primitive_count);
            check_parts(vec![
                (at(plan.offsets.nodes), nodes * 80),
                (at(plan.offsets.primitives), count * shape.leaf_kind.primitive_bytes()),
                (at(plan.offsets.vertices), u64::from(plan.vertex_count) * 12),
                (at(plan.offsets.geometries), u64::from(shape.geometry_count) * 16),
            ], HEADER_BYTES, plan.blob_bytes);
            prop_assert_eq!(plan.blob_bytes % 256, 0);
        }

        #[test]
        fn parts_of_the_scratch_memory_lie_apart(shape in shapes()) {
            let plan = GpuBuildPlan::blas("s", &shape).unwrap();
            let (count, nodes) = (u64::from(shape.primitive_count), u64::from(plan.node_capacity()));
            let at = |place: u32| u64::from(place) * 4;
            let keys = count * if plan.low_bits > 0 { 12 } else { 8 };
            prop_assert!(CODE_BITS + plan.low_bits + number_bits(plan.capacity) <= MAX_HEIGHT && plan.low_bits <= 30);
            check_parts(vec![
                (at(plan.scratch.boxes), count * 24),
                (at(plan.scratch.keys), keys),
                (at(plan.scratch.spare_keys), keys),
                (at(plan.scratch.digits), (8 + count.div_ceil(1024)) * 1024),
                (at(plan.scratch.arrivals), nodes * 4),
                (at(plan.scratch.parents), nodes * 4),
                (at(plan.scratch.binary), nodes * 96),
            ], STATE_WORDS * 4, plan.scratch_bytes);
            prop_assert!(plan.scratch_bytes < 1 << 35);
        }
    }

    #[test]
    fn counts_that_overflow_offsets_are_refused() {
        let shape = BlasShape { primitive_count: (1 << 27) + 1, ..MESH };
        assert!(GpuBuildPlan::blas("s", &shape).is_err());
        assert!(GpuBuildPlan::blas("s", &BlasShape { primitive_count: 1 << 27, ..shape }).is_ok());
        assert!(GpuBuildPlan::tlas("s", u32::MAX).is_err());
        assert!(GpuBuildPlan::tlas("s", 0).is_ok());
    }

    /// The capacity suffices for any count if wide nodes are built again because they did not fit.
    #[test]
    fn the_capacity_suffices_for_full_nodes_of_any_count() {
        let full = |count: u32| {
            let mut level = count.div_ceil(24);
            let mut all = level;
            while level > 1 {
                level = level.div_ceil(8);
                all += level;
            }
            all
        };
        for primitive_count in (4..100_000).chain([1 << 20, 12_345_678, 1 << 27]) {
            let room = bvh8_node_capacity(&BlasShape { primitive_count, ..MESH });
            assert!(room >= full(primitive_count) && room < primitive_count, "{primitive_count}: {room}");
        }
    }

    /// Shapes that flags lead to, with half as many vertices as triangles.
    #[test]
    fn a_triangle_takes_56_bytes_or_26_with_low_memory() {
        let count = 1_000_000;
        for (leaf_kind, each) in [(LeafKind::Triangles, 56.0), (LeafKind::PackedTriangles, 26.0)] {
            let shape = BlasShape { leaf_kind, primitive_count: count, vertex_count: count / 2, ..MESH };
            let bytes = GpuBuildPlan::blas("s", &shape).unwrap().blob_bytes;
            let bytes = bytes as f64 / f64::from(count);
            assert!((each - 0.1..=each).contains(&bytes), "{leaf_kind:?}: {bytes}");
        }
    }
}
