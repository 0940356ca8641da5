//! Whether bytes from a file are a structure that shaders can walk: damage must not send the GPU anywhere.

use super::binary_tree;
use super::wide_tree;
use crate::accel::bounds::Bounds;
use crate::accel::software::layout::LeafKind;
use crate::accel::software::layout::{BINARY, BLOCK_BYTES, Header, LEAF, NONE, WIDE};

/// What a sound structure says of itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Sound {
    pub(crate) header: Header,
    pub(crate) bounds: Bounds,
}

/// Checks a bottom-level structure; answers what is wrong with it.
pub(crate) fn check(bytes: &[u8]) -> Result<Sound, &'static str> {
    let head = bytes.get(..size_of::<Header>()).ok_or("its header is cut off")?;
    let header: Header = bytemuck::pod_read_unaligned(head);
    let primitives = header.primitive_count as usize;
    let leaf_bytes = match header.leaf_kind {
        kind if kind == LeafKind::Triangles as u32 => LeafKind::Triangles.primitive_bytes(),
        kind if kind == LeafKind::IndexedTriangles as u32 => LeafKind::IndexedTriangles.primitive_bytes(),
        kind if kind == LeafKind::Boxes as u32 => LeafKind::Boxes.primitive_bytes(),
        _ => return Err("its leaves are of no known kind"),
    };
    part(bytes, header.primitives, primitives, leaf_bytes as usize).ok_or("its leaves are cut off")?;
    part(bytes, header.geometries, header.geometry_count as usize, BLOCK_BYTES)
        .ok_or("its geometries are cut off")?;
    let tree = match header.root {
        NONE => primitives == 0,
        root if root & LEAF != 0 => binary_tree::names_primitives(root, primitives),
        0 => nodes_are_sound(bytes, &header, primitives),
        _ => false,
    };
    if !tree {
        return Err("its tree is damaged");
    }
    if header.leaf_kind == LeafKind::IndexedTriangles as u32 && !vertices_exist(bytes, &header) {
        return Err("its leaves name vertices that are not there");
    }
    Ok(Sound { header, bounds: Bounds { low: header.low.into(), high: header.high.into() } })
}

fn nodes_are_sound(bytes: &[u8], header: &Header, primitives: usize) -> bool {
    const WIDE_BYTES: usize = 80;
    const BINARY_BYTES: usize = 64;
    let count = header.node_count as usize;
    let nodes = |size| part(bytes, header.nodes, count, size);
    match header.format {
        WIDE => nodes(WIDE_BYTES).is_some_and(|nodes| {
            let nodes: Vec<_> = nodes.chunks_exact(WIDE_BYTES).map(bytemuck::pod_read_unaligned).collect();
            wide_tree::is_sound(&nodes, primitives)
        }),
        BINARY => nodes(BINARY_BYTES).is_some_and(|nodes| {
            let nodes: Vec<_> = nodes.chunks_exact(BINARY_BYTES).map(bytemuck::pod_read_unaligned).collect();
            binary_tree::is_sound(&nodes, primitives)
        }),
        _ => false,
    }
}

fn vertices_exist(bytes: &[u8], header: &Header) -> bool {
    const VERTEX_BYTES: usize = 12;
    let start = header.vertices as usize * BLOCK_BYTES;
    let room = bytes.len().saturating_sub(start) / VERTEX_BYTES;
    let Some(leaves) = part(bytes, header.primitives, header.primitive_count as usize, BLOCK_BYTES) else {
        return false;
    };
    leaves.chunks_exact(BLOCK_BYTES).all(|leaf| {
        let [a, b, c, _]: [u32; 4] = bytemuck::pod_read_unaligned(leaf);
        (a.max(b).max(c) as usize) < room
    })
}

/// `count` elements of `size` bytes at a place in blocks.
fn part(bytes: &[u8], place: u32, count: usize, size: usize) -> Option<&[u8]> {
    let start = (place as usize).checked_mul(BLOCK_BYTES)?;
    bytes.get(start..start.checked_add(count.checked_mul(size)?)?)
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use proptest::prelude::*;

    use super::super::blas_blob;
    use super::super::mesh::{Mesh, Primitives};
    use super::super::quality::Quality;
    use super::*;
    use crate::accel::geometry::GeometryFlags;
    use crate::accel::software::layout::LeafTriangle;

    fn mesh(corners: &[[f32; 3]]) -> Mesh {
        let leaf = |(primitive, at): (u32, &[f32; 3])| {
            let a = Vec3::from(*at);
            LeafTriangle { a, primitive, b: a + Vec3::X, geometry: 0, c: a + Vec3::Y, opaque: 1 }
        };
        let triangles = (0..).zip(corners).map(leaf).collect();
        Mesh { primitives: Primitives::Triangles(triangles), flags: vec![GeometryFlags::OPAQUE] }
    }

    fn quality() -> impl Strategy<Value = Quality> {
        any::<[bool; 3]>().prop_map(|[fast_build, low_memory, refit]| Quality {
            fast_build,
            low_memory,
            refit,
        })
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

        #[test]
        fn what_the_cpu_builds_is_sound_and_has_every_primitive_once(
            corners in prop::collection::vec(prop::array::uniform3(-9.0_f32..9.0), 0..300), quality in quality()
        ) {
            let blob = blas_blob::build(&mesh(&corners), quality);
            let sound = check(&blob.bytes).unwrap();
            prop_assert_eq!(sound.header.primitive_count as usize, corners.len());
            let size = if sound.header.leaf_kind == 0 { 48 } else { 16 };
            let leaves = part(&blob.bytes, sound.header.primitives, corners.len(), size).unwrap();
            let mut numbers: Vec<u32> = leaves
                .chunks_exact(size)
                .map(|leaf| bytemuck::pod_read_unaligned(&leaf[12..16]))
                .collect();
            numbers.sort_unstable();
            prop_assert!(numbers.into_iter().eq(0..corners.len() as u32));
        }

        #[test]
        fn damage_is_refused_or_harmless(
            place in any::<prop::sample::Index>(), value in any::<u8>(), cut in any::<prop::sample::Index>()
        ) {
            let corners: Vec<_> = (0..200_u8).map(|index| [f32::from(index), f32::from(index % 7), 0.5]).collect();
            let blob = blas_blob::build(&mesh(&corners), Quality { fast_build: false, low_memory: true, refit: false });
            let mut bytes = blob.bytes;
            let at = place.index(bytes.len());
            bytes[at] = value;
            let _ = check(&bytes);
            bytes.truncate(cut.index(bytes.len()));
            let _ = check(&bytes);
        }
    }

    #[test]
    fn many_primitives_at_one_place_are_built() {
        let blob = blas_blob::build(
            &mesh(&[[1.0, 2.0, 3.0]; 20_000]),
            Quality { fast_build: false, low_memory: false, refit: true },
        );
        assert_eq!(check(&blob.bytes).unwrap().header.primitive_count, 20_000);
    }
}
