//! Triangles with vertex indices instead of positions, for BLASes that use little memory.

use std::collections::HashMap;
use std::hash::BuildHasherDefault;

use glam::Vec3;

use super::primitives::Mesh;
use crate::barrier::IdHasher;
use crate::software_ray_query::layout::{LeafIndexed, LeafTriangle};

/// Triangles and the vertices that their indices refer to.
pub(crate) struct IndexedMesh {
    pub(crate) triangles: Vec<LeafIndexed>,
    pub(crate) vertices: Vec<Vec3>,
}

/// Maximum geometries whose index fits beside that of a primitive.
const MAX_GEOMETRIES: usize = 1 << 8;
/// Maximum primitives of a geometry whose index fits beside that of the geometry.
const MAX_PRIMITIVES: u32 = 1 << 24;

/// Returns the triangles in this order; `None` if their indices do not fit.
///
/// Each used position is stored once. If the mesh has vertex indices, each used vertex is stored once.
pub(crate) fn index_mesh(mesh: &Mesh, triangles: &[LeafTriangle], order: &[u32]) -> Option<IndexedMesh> {
    let several = mesh.flags.len() > 1;
    if several
        && (mesh.flags.len() > MAX_GEOMETRIES || triangles.iter().any(|of| of.primitive >= MAX_PRIMITIVES))
    {
        return None;
    }
    let mut places: HashMap<[u32; 3], u32, BuildHasherDefault<IdHasher>> = HashMap::default();
    let mut vertices = Vec::new();
    let mut place = |key: [u32; 3], position: Vec3| {
        *places.entry(key).or_insert_with(|| {
            vertices.push(position);
            vertices.len() as u32 - 1
        })
    };
    let leaf = |number: &u32| {
        let of = &triangles[*number as usize];
        let named = mesh.vertices.get(*number as usize);
        let positions = [of.a, of.b, of.c];
        let corner = |corner: usize| match named {
            Some(named) => place([of.geometry, named[corner], 0], positions[corner]),
            None => place(positions[corner].to_array().map(f32::to_bits), positions[corner]),
        };
        let geometry = if several { of.geometry << 24 } else { 0 };
        LeafIndexed { vertices: [0, 1, 2].map(corner), primitive: of.primitive | geometry }
    };
    let triangles = order.iter().map(leaf).collect();
    Some(IndexedMesh { triangles, vertices })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::accel::geometry::GeometryFlags;
    use crate::software_ray_query::bvh::primitives::MeshPrimitives;

    /// Triangles of two geometries in turn, each with vertices of its own, some of them at the same position.
    fn mesh(named: &[[u8; 3]]) -> Mesh {
        let position = |vertex: u8| Vec3::new(f32::from(vertex / 2), f32::from(vertex % 3), 0.5);
        let triangle = |(number, named): (u32, &[u8; 3])| {
            let [a, b, c] = named.map(position);
            LeafTriangle { a, primitive: number / 2, b, geometry: number % 2, c, opaque: 0 }
        };
        let primitives = MeshPrimitives::Triangles((0..).zip(named).map(triangle).collect());
        let vertices = named.iter().map(|named| named.map(u32::from)).collect();
        Mesh { primitives, vertices, flags: vec![GeometryFlags::empty(); 2] }
    }

    fn distinct<T: Eq + std::hash::Hash>(all: impl Iterator<Item = T>) -> usize {
        all.collect::<std::collections::HashSet<_>>().len()
    }

    proptest! {
        #[test]
        fn corners_stay_and_only_what_is_named_counts(
            named in prop::collection::vec(prop::array::uniform3(0..60_u8), 0..40), moves in any::<bool>()
        ) {
            let mut mesh = mesh(&named);
            let MeshPrimitives::Triangles(triangles) = mesh.primitives.clone() else { unreachable!("triangles") };
            let corners = |of: &LeafTriangle| [of.a, of.b, of.c];
            let of_both = mesh.vertices.iter().zip(&triangles);
            let given = distinct(of_both.flat_map(|(named, of)| named.map(|vertex| (of.geometry, vertex))));
            let bits = |at: Vec3| at.to_array().map(f32::to_bits);
            let places = distinct(triangles.iter().flat_map(|of| corners(of).map(bits)));
            if !moves {
                mesh.vertices.clear();
            }
            let order: Vec<u32> = (0..triangles.len() as u32).rev().collect();
            let IndexedMesh { triangles: leaves, vertices } = index_mesh(&mesh, &triangles, &order).unwrap();
            prop_assert_eq!(vertices.len(), if moves { given } else { places });
            for (leaf, of) in leaves.iter().zip(triangles.iter().rev()) {
                prop_assert_eq!(leaf.vertices.map(|vertex| vertices[vertex as usize]), corners(of));
                prop_assert_eq!(leaf.primitive, of.geometry << 24 | of.primitive);
            }
        }
    }

    #[test]
    fn numbers_that_do_not_fit_are_refused() {
        let mut mesh = mesh(&[[0, 1, 2]; 2]);
        let MeshPrimitives::Triangles(mut triangles) = mesh.primitives.clone() else {
            unreachable!("triangles")
        };
        triangles[1].primitive = MAX_PRIMITIVES;
        assert!(index_mesh(&mesh, &triangles, &[0, 1]).is_none());
        triangles[1].primitive -= 1;
        assert!(index_mesh(&mesh, &triangles, &[0, 1]).is_some());
        mesh.flags = vec![GeometryFlags::empty(); MAX_GEOMETRIES + 1];
        assert!(index_mesh(&mesh, &triangles, &[0, 1]).is_none());
    }
}
