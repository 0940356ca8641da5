//! Validates a BLAS blob from a file: shaders must be able to traverse it, and kernels to refit it. Neither damage nor
//! forged numbers may make the GPU read or write elsewhere.

use std::ops::Range;

use super::bvh::bvh2;
use super::bvh::bvh8;
use super::expected_mesh::ExpectedMesh;
use crate::accel::primitive_bounds::Bounds;
use crate::software_ray_query::layout::LeafKind;
use crate::software_ray_query::layout::{
    BLOCK_BYTES, BlobHeader, Bvh2NodeRecord, FORMAT_BVH2, FORMAT_BVH8, LeafBox, LeafIndexed, LeafPacked, NONE,
};

/// Facts of a valid blob.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ValidatedBlob {
    pub(crate) header: BlobHeader,
    pub(crate) bounds: Bounds,
}

/// Checks a BLAS blob. Returns the first defect as the error.
pub(crate) fn validate_blob(bytes: &[u8], expected: &ExpectedMesh) -> Result<ValidatedBlob, &'static str> {
    let head = bytes.get(..size_of::<BlobHeader>()).ok_or("its header is cut off")?;
    let header: BlobHeader = bytemuck::pod_read_unaligned(head);
    let kind = leaf_kind(&header).ok_or("its leaves are of no known kind")?;
    if (kind == LeafKind::Boxes) != expected.is_aabbs
        || header.geometry_count as usize != expected.counts.len()
    {
        return Err("it is of other geometries");
    }
    let parts = BlobSections::new(bytes, &header, kind).ok_or("parts of it are cut off")?;
    if !parts.ranges_disjoint() {
        return Err("parts of it lie over each other");
    }
    if !is_tree_valid(&parts, &header) {
        return Err("its tree is damaged");
    }
    if !parts.leaves().all(|leaf| is_leaf_primitive_valid(leaf, kind, &expected.counts)) {
        return Err("its leaves name primitives that are not there");
    }
    let bounds = Bounds { low: header.low.into(), high: header.high.into() };
    let is_box = bounds.low.is_finite() && bounds.high.is_finite() && bounds.low.cmple(bounds.high).all();
    let is_empty = bounds.low.x > bounds.high.x;
    if !is_box && !is_empty {
        return Err("it has no bounds");
    }
    Ok(ValidatedBlob { header, bounds })
}

fn leaf_kind(header: &BlobHeader) -> Option<LeafKind> {
    use LeafKind::{Boxes, IndexedTriangles, PackedTriangles, Triangles};
    let kinds = [Triangles, IndexedTriangles, PackedTriangles, Boxes];
    kinds.into_iter().find(|kind| *kind as u32 == header.leaf_kind)
}

/// The parts of a blob, all of them within its bytes.
struct BlobSections<'a> {
    bytes: &'a [u8],
    leaf_bytes: usize,
    nodes: Range<usize>,
    leaves: Range<usize>,
    vertices: Range<usize>,
    geometries: Range<usize>,
}

impl<'a> BlobSections<'a> {
    fn new(bytes: &'a [u8], header: &BlobHeader, kind: LeafKind) -> Option<Self> {
        const VERTEX_BYTES: usize = 12;
        let leaf_bytes = kind.primitive_bytes() as usize;
        let leaves = section_range(bytes, header.primitives, header.primitive_count as usize, leaf_bytes)?;
        let vertices = named_vertex_count(&bytes[leaves.clone()], kind);
        let nodes = header.node_count as usize;
        Some(Self {
            bytes,
            leaf_bytes,
            nodes: section_range(bytes, header.nodes, nodes, node_bytes(header)?)?,
            leaves,
            vertices: section_range(bytes, header.vertices, vertices, VERTEX_BYTES)?,
            geometries: section_range(bytes, header.geometries, header.geometry_count as usize, BLOCK_BYTES)?,
        })
    }

    /// True if the parts do not overlap. A refit that writes to one part must not change another.
    fn ranges_disjoint(&self) -> bool {
        let mut parts = [&self.nodes, &self.leaves, &self.vertices, &self.geometries];
        parts.sort_by_key(|part| (part.start, part.end));
        let mut free = size_of::<BlobHeader>();
        parts.into_iter().filter(|part| !part.is_empty()).all(|part| {
            let apart = part.start >= free;
            free = part.end;
            apart
        })
    }

    fn nodes<Node: bytemuck::AnyBitPattern>(&self) -> Vec<Node> {
        let nodes = self.bytes[self.nodes.clone()].chunks_exact(size_of::<Node>());
        nodes.map(bytemuck::pod_read_unaligned).collect()
    }

    fn leaves(&self) -> impl Iterator<Item = &'a [u8]> {
        self.bytes[self.leaves.clone()].chunks_exact(self.leaf_bytes)
    }
}

/// True if every path from the root ends in leaves that exist, no path is too long, and no two paths meet.
fn is_tree_valid(parts: &BlobSections<'_>, header: &BlobHeader) -> bool {
    let primitives = header.primitive_count as usize;
    match (header.root, header.node_count) {
        (NONE, 0) => primitives == 0,
        (root, 0) => bvh2::is_valid_leaf(root, primitives),
        (0, _) if header.format == FORMAT_BVH8 => bvh8::is_valid_bvh8(&parts.nodes(), primitives),
        (0, _) => bvh2::is_valid_bvh2(&parts.nodes(), primitives),
        _ => false,
    }
}

/// Returns the bytes of a node; `None` for an unknown format, and for a BLAS that has moved to another address.
fn node_bytes(header: &BlobHeader) -> Option<usize> {
    const WIDE_BYTES: usize = 80;
    match header.format {
        FORMAT_BVH8 => Some(WIDE_BYTES),
        FORMAT_BVH2 => Some(size_of::<Bvh2NodeRecord>()),
        _ => None,
    }
}

/// Returns the number of vertices up to the last one that leaves refer to.
fn named_vertex_count(leaves: &[u8], kind: LeafKind) -> usize {
    let names = |leaf| leaf_vertices(leaf, kind).into_iter().flatten();
    let all = leaves.chunks_exact(kind.primitive_bytes() as usize).flat_map(names);
    all.max().map_or(0, |last| last as usize + 1)
}

/// Returns the vertex indices of a leaf, if it has them.
fn leaf_vertices(leaf: &[u8], kind: LeafKind) -> Option<[u32; 3]> {
    match kind {
        LeafKind::IndexedTriangles => Some(bytemuck::pod_read_unaligned::<LeafIndexed>(leaf).vertices),
        LeafKind::PackedTriangles => Some(bytemuck::pod_read_unaligned::<LeafPacked>(leaf).vertices()),
        _ => None,
    }
}

/// True if the geometries contain a leaf's primitive.
fn is_leaf_primitive_valid(leaf: &[u8], kind: LeafKind, counts: &[u32]) -> bool {
    let word = |at: usize| leaf.get(at..at + 4).map_or(NONE, bytemuck::pod_read_unaligned);
    let shared = |word: u32| if counts.len() > 1 { (word >> 24, word & 0x00ff_ffff) } else { (0, word) };
    let (geometry, primitive) = match kind {
        LeafKind::IndexedTriangles => shared(word(12)),
        LeafKind::PackedTriangles => shared(word(8)),
        LeafKind::Boxes => (word(28) & !LeafBox::OPAQUE, word(12)),
        _ => (word(28), word(12)),
    };
    counts.get(geometry as usize).is_some_and(|count| primitive < *count)
}

/// Returns the byte range of `count` elements of `size` bytes at offset `place` in blocks.
fn section_range(bytes: &[u8], place: u32, count: usize, size: usize) -> Option<Range<usize>> {
    if count == 0 {
        return Some(0..0);
    }
    let start = (place as usize).checked_mul(BLOCK_BYTES)?;
    let end = start.checked_add(count.checked_mul(size)?)?;
    (end <= bytes.len()).then_some(start..end)
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use proptest::prelude::*;

    use super::*;
    use crate::accel::geometry::GeometryFlags;
    use crate::software_ray_query::bvh::encode_blas;
    use crate::software_ray_query::bvh::primitives::{Mesh, MeshPrimitives};
    use crate::software_ray_query::bvh::settings::BvhSettings;
    use crate::software_ray_query::layout::{FORMAT_MOVED, LEAF, LeafTriangle, leaf};

    const SMALL: BvhSettings = BvhSettings { low_memory: true, refit: false };
    const MOVING: BvhSettings = BvhSettings { low_memory: false, refit: true };
    const SMALL_MOVING: BvhSettings = BvhSettings { low_memory: true, refit: true };

    /// Returns a closed strip through these vertices, as triangles of two geometries in turn.
    fn mesh(corners: &[[f32; 3]]) -> Mesh {
        let count = corners.len() as u32;
        let vertices: Vec<_> =
            (0..count).map(|number| [0, 1, 2].map(|step| (number + step) % count)).collect();
        let triangle = |(number, named): (u32, &[u32; 3])| {
            let [a, b, c] = named.map(|vertex| Vec3::from(corners[vertex as usize]));
            LeafTriangle { a, primitive: number / 2, b, geometry: number % 2, c, opaque: 1 }
        };
        let triangles = (0..).zip(&vertices).map(triangle).collect();
        Mesh {
            primitives: MeshPrimitives::Triangles(triangles),
            vertices,
            flags: vec![GeometryFlags::OPAQUE; 2],
        }
    }

    /// Returns the mesh with the vertices that a build with these settings gets.
    fn primitive_ids(mesh: &Mesh, quality: BvhSettings) -> Mesh {
        let vertices = if quality.keeps_given_vertices() { mesh.vertices.clone() } else { Vec::new() };
        Mesh { vertices, ..mesh.clone() }
    }

    fn boxes(count: u32) -> Mesh {
        let place = |primitive: u32| {
            let low = Vec3::splat(primitive as f32);
            LeafBox { low, primitive, high: low + Vec3::ONE, geometry: LeafBox::OPAQUE }
        };
        let primitives = MeshPrimitives::Boxes((0..count).map(place).collect());
        Mesh { primitives, vertices: Vec::new(), flags: vec![GeometryFlags::OPAQUE] }
    }

    fn row(count: u8) -> Mesh {
        let corner = |index| [f32::from(index), f32::from(index % 7), 0.5];
        mesh(&(0..count).map(corner).collect::<Vec<_>>())
    }

    fn heap(count: usize) -> Mesh {
        mesh(&vec![[1.0, 2.0, 3.0]; count])
    }

    /// Returns a valid BVH2 blob.
    fn built_binary(mesh: &Mesh, quality: BvhSettings) -> (Vec<u8>, ExpectedMesh) {
        let bounds = mesh.bounds();
        let whole = bounds.iter().fold(Bounds::EMPTY, |all, one| all.union(*one));
        let bytes = encode_blas::encode_bvh(
            &primitive_ids(mesh, quality),
            &bvh2::build_bvh2(&bounds, 3),
            quality,
            whole,
        );
        let expected = ExpectedMesh::from_mesh(mesh);
        validate_blob(&bytes, &expected).unwrap();
        (bytes, expected)
    }

    fn quality() -> impl Strategy<Value = BvhSettings> {
        any::<[bool; 2]>().prop_map(|[low_memory, refit]| BvhSettings { low_memory, refit })
    }

    /// Returns a valid blob and its expected mesh.
    fn built(mesh: &Mesh, quality: BvhSettings) -> (Vec<u8>, ExpectedMesh) {
        let blob = encode_blas::encode_blas(&primitive_ids(mesh, quality), quality);
        let expected = ExpectedMesh::from_mesh(mesh);
        validate_blob(&blob.bytes, &expected).unwrap();
        (blob.bytes, expected)
    }

    /// Returns the same blob with leaves that have a word for each vertex index.
    fn unpacked((mut bytes, expected): (Vec<u8>, ExpectedMesh)) -> (Vec<u8>, ExpectedMesh) {
        let mut changed = header(&bytes);
        let packed = section_range(&bytes, changed.primitives, changed.primitive_count as usize, 12).unwrap();
        let leaf = |leaf: &[u8]| {
            let [a, b, c] = leaf_vertices(leaf, LeafKind::PackedTriangles).unwrap();
            [a, b, c, bytemuck::pod_read_unaligned(&leaf[8..])]
        };
        let leaves: Vec<[u32; 4]> = bytes[packed].chunks_exact(12).map(leaf).collect();
        assert_eq!(changed.leaf_kind, LeafKind::PackedTriangles as u32);
        changed.leaf_kind = LeafKind::IndexedTriangles as u32;
        changed.primitives = (bytes.len() / BLOCK_BYTES) as u32;
        bytes.extend_from_slice(bytemuck::cast_slice(&leaves));
        bytes[..size_of::<BlobHeader>()].copy_from_slice(bytemuck::bytes_of(&changed));
        validate_blob(&bytes, &expected).unwrap();
        (bytes, expected)
    }

    fn header(bytes: &[u8]) -> BlobHeader {
        bytemuck::pod_read_unaligned(&bytes[..size_of::<BlobHeader>()])
    }

    fn refused(
        mut bytes: Vec<u8>,
        expected: &ExpectedMesh,
        change: impl FnOnce(&mut BlobHeader),
    ) -> &'static str {
        let mut changed = header(&bytes);
        change(&mut changed);
        bytes[..size_of::<BlobHeader>()].copy_from_slice(bytemuck::bytes_of(&changed));
        validate_blob(&bytes, expected).unwrap_err()
    }

    /// Like [`refused`], with a word of the part at an offset in blocks.
    fn refused_word(
        mut bytes: Vec<u8>,
        expected: &ExpectedMesh,
        place: u32,
        word: usize,
        value: u32,
    ) -> &'static str {
        let at = place as usize * BLOCK_BYTES + word * 4;
        bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
        validate_blob(&bytes, expected).unwrap_err()
    }

    /// Traverses every path like shaders do, from the root and from every part that an instance may reference. Fails if
    /// a shader would read anything else.
    fn traverse(bytes: &[u8]) -> usize {
        let bounds = Bounds { low: Vec3::splat(-9.0), high: Vec3::splat(9.0) };
        let blob = encode_blas::BlasBlob { bytes: bytes.to_vec(), bounds };
        for part in &crate::software_ray_query::bvh::subtrees::subtree_parts(&blob).parts {
            traverse_from(bytes, part.reference);
        }
        traverse_from(bytes, header(bytes).root)
    }

    fn traverse_from(bytes: &[u8], start: u32) -> usize {
        let header = header(bytes);
        let word = |place: u32, word: usize| -> u32 {
            let at = place as usize * BLOCK_BYTES + word * 4;
            bytemuck::pod_read_unaligned(&bytes[at..at + 4])
        };
        let visit = |first: u32, count: u32| {
            for number in first as usize..(first + count) as usize {
                let kind = leaf_kind(&header).unwrap();
                let size = kind.primitive_bytes() as usize;
                let at = header.primitives as usize * BLOCK_BYTES + number * size;
                for vertex in leaf_vertices(&bytes[at..at + size], kind).into_iter().flatten() {
                    word(header.vertices, vertex as usize * 3 + 2);
                }
            }
        };
        let (mut open, mut steps) = (vec![(start, 0)], 0);
        while let Some((reference, pushed)) = open.pop() {
            steps += 1;
            assert!(steps <= header.node_count as usize * 9 + 1 && pushed < 64, "it would not end");
            match reference {
                NONE => {}
                _ if reference & LEAF != 0 => visit(reference & 0x07ff_ffff, (reference >> 27 & 15) + 1),
                _ if header.format == FORMAT_BVH2 => {
                    let node = reference as usize * 16;
                    open.extend([3, 7].map(|child| (word(header.nodes, node + child), pushed + 1)));
                }
                _ => {
                    let node = reference as usize * 20;
                    let (inner, first) = (word(header.nodes, node + 3) >> 24, word(header.nodes, node + 4));
                    open.extend((0..inner.count_ones()).map(|child| (first + child, pushed + 2)));
                    for child in (0..8).filter(|child| inner >> child & 1 == 0) {
                        let meta = word(header.nodes, node + 6 + child / 4) >> (child % 4 * 8) & 255;
                        visit(word(header.nodes, node + 5) + (meta & 31), (meta >> 5).count_ones());
                    }
                }
            }
        }
        steps
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

        #[test]
        fn blobs_of_the_cpu_are_valid_and_have_every_primitive_once(
            corners in prop::collection::vec(prop::array::uniform3(-9.0_f32..9.0), 0..300), quality in quality()
        ) {
            let mesh = mesh(&corners);
            let (bytes, _) = built(&mesh, quality);
            let header = header(&bytes);
            prop_assert_eq!(header.primitive_count as usize, corners.len());
            let kind = leaf_kind(&header).unwrap();
            let parts = BlobSections::new(&bytes, &header, kind).unwrap();
            let mut numbers: Vec<(u32, u32)> = parts.leaves().map(|leaf| {
                let word = |at: usize| -> u32 { bytemuck::pod_read_unaligned(&leaf[at..at + 4]) };
                if kind == LeafKind::Triangles { (word(28), word(12)) } else { (word(8) >> 24, word(8) & 0xff_ffff) }
            }).collect();
            numbers.sort_unstable_by_key(|(geometry, primitive)| (*primitive, *geometry));
            prop_assert!(numbers.into_iter().eq((0..corners.len() as u32).map(|number| (number % 2, number / 2))));
            traverse(&bytes);
        }

        /// The largest and smallest numbers that builds accept, many of them at the same position.
        #[test]
        fn extreme_places_are_built(
            corners in prop::collection::vec(prop::array::uniform3(prop::sample::select(
                vec![0.0, -0.0, 1.0, -1.0, 1e18, -1e18, 9.9e17, 1e-38, -1e-42, 1e-7, 4e9, f32::MIN_POSITIVE]
            )), 0..60),
            quality in quality(),
        ) {
            let (bytes, _) = built(&mesh(&corners), quality);
            traverse(&bytes);
            let (bytes, _) = built_binary(&mesh(&corners), quality);
            traverse(&bytes);
        }

        /// Every truncated length, and words that are slightly wrong, very wrong, or those of other blobs.
        #[test]
        fn damage_is_refused_or_harmless(
            quality in prop::sample::select(vec![SMALL, MOVING, SMALL_MOVING]),
            wide in any::<bool>(),
            loose in any::<bool>(),
            changes in prop::collection::vec((any::<prop::sample::Index>(), prop_oneof![
                Just(None), any::<u32>().prop_map(Some), (0..300_u32).prop_map(Some), Just(Some(NONE))
            ], any::<prop::sample::Index>()), 1..4),
            in_header in any::<bool>(),
            cut in prop::option::of(any::<prop::sample::Index>()),
        ) {
            let (mut bytes, expected) =
                if wide { built(&row(120), quality) } else { built_binary(&row(120), quality) };
            if quality.low_memory && loose {
                (bytes, _) = unpacked((bytes, expected.clone()));
            }
            for (place, value, from) in changes {
                let words = if in_header { size_of::<BlobHeader>() / 4 } else { bytes.len() / 4 };
                let (at, from) = (place.index(words) * 4, from.index(bytes.len() / 4) * 4);
                let other: [u8; 4] = bytes[from..from + 4].try_into().unwrap();
                bytes[at..at + 4].copy_from_slice(&value.map_or(other, u32::to_le_bytes));
            }
            if let Some(cut) = cut {
                bytes.truncate(cut.index(bytes.len()));
            }
            if validate_blob(&bytes, &expected).is_ok() {
                traverse(&bytes);
            }
        }
    }

    #[test]
    fn a_wrong_bit_in_a_node_is_refused_or_harmless() {
        let (bytes, expected) = built(&row(40), SMALL);
        let header = header(&bytes);
        let nodes = header.nodes as usize * BLOCK_BYTES;
        for bit in nodes * 8..(nodes + header.node_count as usize * 80) * 8 {
            let mut damaged = bytes.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            if validate_blob(&damaged, &expected).is_ok() {
                traverse(&damaged);
            }
        }
    }

    #[test]
    fn many_primitives_at_one_place_are_built() {
        let (bytes, _) = built(&heap(20_000), MOVING);
        assert_eq!(header(&bytes).primitive_count, 20_000);
    }

    #[test]
    fn numbers_of_the_header_that_point_elsewhere_are_refused() {
        let structures = [
            (built(&row(200), MOVING), MOVING),
            (built(&row(200), SMALL), SMALL),
            (built(&row(200), SMALL_MOVING), SMALL_MOVING),
            (built_binary(&row(200), MOVING), MOVING),
            (built_binary(&row(200), SMALL), SMALL),
            (unpacked(built(&row(200), SMALL)), SMALL),
            (unpacked(built(&row(200), SMALL_MOVING)), SMALL_MOVING),
            (built(&boxes(50), MOVING), MOVING),
        ];
        for ((bytes, expected), quality) in structures {
            let refuses = |change: fn(&mut BlobHeader)| refused(bytes.clone(), &expected, change);
            refuses(|header| header.format = FORMAT_MOVED);
            refuses(|header| header.leaf_kind = LeafKind::Instances as u32);
            refuses(|header| header.leaf_kind = 77);
            refuses(|header| header.root = 1);
            refuses(|header| header.root = NONE);
            refuses(|header| header.nodes = header.geometries);
            refuses(|header| header.nodes = u32::MAX);
            refuses(|header| header.node_count += 1);
            refuses(|header| header.node_count = u32::MAX);
            refuses(|header| header.node_count = 0);
            refuses(|header| header.primitive_count = u32::MAX);
            refuses(|header| header.primitive_count -= 1);
            refuses(|header| header.primitives = 0);
            refuses(|header| header.primitives = header.nodes);
            refuses(|header| header.geometry_count += 1);
            refuses(|header| header.geometries = 0);
            refuses(|header| header.low[1] = f32::NAN);
            refuses(|header| header.high = [f32::INFINITY; 3]);
            if quality.low_memory {
                refuses(|header| header.vertices = u32::MAX);
                refuses(|header| header.vertices = header.geometries);
            }
        }
    }

    /// Cases in which only the leaf at the root suggests that the format is valid.
    #[test]
    fn a_leaf_that_says_it_has_moved_is_refused() {
        let (bytes, expected) = built(&row(2), MOVING);
        let refuses = |change: fn(&mut BlobHeader)| refused(bytes.clone(), &expected, change);
        refuses(|header| header.format = FORMAT_MOVED);
        refuses(|header| header.node_count = 1);
        refuses(|header| header.node_count = u32::MAX);
        refuses(|header| header.root = leaf(1, 2));
        refuses(|header| header.root = leaf(0, 16));
        refuses(|header| header.root = 0);
    }

    #[test]
    fn circles_and_paths_that_meet_are_refused() {
        let (wide, expected) = built(&row(200), MOVING);
        let at = header(&wide);
        assert_eq!(at.format, FORMAT_BVH8);
        let nodes = [0, 1, at.node_count - 1, at.node_count, u32::MAX];
        let first =
            |node: u32, value| refused_word(wide.clone(), &expected, at.nodes, node as usize * 20 + 4, value);
        for value in nodes {
            let inner = (0..at.node_count).find(|node| first_child(&wide, *node) > Some(1)).unwrap();
            assert_eq!(first(inner, value), "its tree is damaged", "{value}");
        }
        let (binary, expected) = built_binary(&row(200), MOVING);
        let at = header(&binary);
        for value in [0, 1, at.node_count, 0x7fff_ffff, LEAF | 200, LEAF | 15 << 27 | 190] {
            assert_eq!(
                refused_word(binary.clone(), &expected, at.nodes, 7, value),
                "its tree is damaged",
                "{value:#x}"
            );
        }
    }

    /// Returns the first inner child of a wide node that has one.
    fn first_child(bytes: &[u8], node: u32) -> Option<u32> {
        let at = header(bytes).nodes as usize * BLOCK_BYTES + node as usize * 80;
        (bytes[at + 15] != 0).then(|| bytemuck::pod_read_unaligned(&bytes[at + 16..at + 20]))
    }

    #[test]
    fn leaves_that_name_what_is_not_there_are_refused() {
        let (triangles, expected) = built(&row(200), MOVING);
        let at = header(&triangles);
        for (word, value) in [(3, 100), (3, NONE), (7, 2), (7, LEAF), (7, NONE)] {
            let reason = refused_word(triangles.clone(), &expected, at.primitives, word, value);
            assert_eq!(reason, "its leaves name primitives that are not there");
        }
        let [packed, moving] = [SMALL, SMALL_MOVING].map(|quality| built(&row(200), quality));
        let all = [(packed.clone(), 2), (moving.clone(), 2), (unpacked(packed), 3), (unpacked(moving), 3)];
        for ((bytes, expected), last) in all {
            let at = header(&bytes);
            for value in [2 << 24, 100, NONE] {
                let reason = refused_word(bytes.clone(), &expected, at.primitives, last, value);
                assert_eq!(reason, "its leaves name primitives that are not there");
            }
            for (word, value) in [(0, 1 << 20), (1, u32::MAX), (1, 1 << 20), (last - 1, 1 << 31)] {
                let reason = refused_word(bytes.clone(), &expected, at.primitives, word, value);
                assert_eq!(reason, "parts of it are cut off");
            }
        }
        let (boxes, expected) = built(&boxes(50), MOVING);
        let at = header(&boxes);
        refused_word(boxes, &expected, at.primitives, 7, 1);
    }

    #[test]
    fn other_meshes_are_refused() {
        let (bytes, expected) = built(&row(200), MOVING);
        let refuses = |expected: ExpectedMesh| validate_blob(&bytes, &expected).unwrap_err();
        refuses(ExpectedMesh { is_aabbs: true, ..expected.clone() });
        refuses(ExpectedMesh { counts: vec![200], ..expected.clone() });
        refuses(ExpectedMesh { counts: vec![100, 99], ..expected.clone() });
        refuses(ExpectedMesh { counts: vec![100, 100, 0], ..expected.clone() });
    }
}
