//! Triangles with vertex indices instead of positions, for BLASes that use little memory.

use std::collections::HashMap;
use std::hash::{BuildHasher, BuildHasherDefault, Hasher};
use std::sync::atomic::{AtomicU32, Ordering};

use glam::Vec3;
use rayon::prelude::*;

use super::build_threads::TASK_LENGTH;
use super::primitives::Mesh;
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
    let positions = |number: u32| {
        let of = &triangles[number as usize];
        [of.a, of.b, of.c]
    };
    let keys_of = |number: &u32| {
        let of = &triangles[*number as usize];
        match mesh.vertices.get(*number as usize) {
            Some(named) => named.map(|vertex| Key(of.geometry, vertex, 0)),
            None => positions(*number).map(|at| Key(at.x.to_bits(), at.y.to_bits(), at.z.to_bits())),
        }
    };
    let keys: Vec<[Key; 3]> = order.par_iter().map(keys_of).collect();
    let first = first_of_each_key(keys.as_flattened());
    drop(keys);
    let is_first = |corner: &usize| first[*corner] as usize == *corner;
    let corners = 0..first.len();
    let at = |corner: usize| positions(order[corner / 3])[corner % 3];
    let vertices = corners.clone().into_par_iter().filter(is_first).map(at).collect();
    // Vertices have the order of their first corners. Only the numbers at first corners are used.
    let mut vertex_of = Vec::with_capacity(first.len());
    let mut next = 0;
    for corner in corners {
        vertex_of.push(next);
        next += u32::from(is_first(&corner));
    }
    let leaf = |(place, number): (usize, &u32)| {
        let of = &triangles[*number as usize];
        let geometry = if several { of.geometry << 24 } else { 0 };
        let vertices = [0, 1, 2].map(|corner| vertex_of[first[3 * place + corner] as usize]);
        LeafIndexed { vertices, primitive: of.primitive | geometry }
    };
    let triangles = order.par_iter().enumerate().map(leaf).collect();
    Some(IndexedMesh { triangles, vertices })
}

/// Corners with the same key share a vertex: the position's bits, or the geometry and the number of the vertex.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
struct Key(u32, u32, u32);

/// Hashes the three numbers of a [`Key`] by a multiplication each.
#[derive(Default)]
struct KeyHasher(u64);

impl Hasher for KeyHasher {
    fn write(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|byte| self.write_u32(u32::from(*byte)));
    }

    fn write_u32(&mut self, number: u32) {
        self.0 = (self.0.rotate_left(5) ^ u64::from(number)).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    }

    /// The high bits of a product depend on all bits of its factors, and a map looks at the low ones too.
    fn finish(&self) -> u64 {
        self.0.rotate_left(26)
    }
}

/// Returns for each corner the first one with the same key. Corners with equal keys are in one share, and a share is searched in order, so the
/// result does not depend on the number of threads.
fn first_of_each_key(keys: &[Key]) -> Vec<u32> {
    let hasher = BuildHasherDefault::<KeyHasher>::default();
    let shares = rayon::current_num_threads().min(keys.len().div_ceil(TASK_LENGTH)).max(1);
    // Rayon has fewer threads than a `u16` counts.
    let share = |key: &Key| ((hasher.hash_one(key) >> 40) % shares as u64) as u16;
    let share_of: Vec<u16> = keys.par_iter().map(share).collect();
    let first: Vec<AtomicU32> = bytemuck::zeroed_vec(keys.len());
    (0..shares).into_par_iter().for_each(|share| {
        let mut seen: HashMap<Key, u32, BuildHasherDefault<KeyHasher>> = HashMap::default();
        for (corner, key) in
            keys.iter().enumerate().filter(|(corner, _)| usize::from(share_of[*corner]) == share)
        {
            let earliest = *seen.entry(*key).or_insert(corner as u32);
            first[corner].store(earliest, Ordering::Relaxed);
        }
    });
    first.into_iter().map(AtomicU32::into_inner).collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::accel::geometry::GeometryFlags;
    use crate::software_ray_query::bvh::build_threads::on_new_threads;
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
            // Vertices have the order in which the leaves name them.
            let mut highest = 0;
            for vertex in leaves.iter().flat_map(|leaf| leaf.vertices) {
                prop_assert!(vertex <= highest);
                highest = highest.max(vertex + 1);
            }
            prop_assert_eq!(vertices.len(), if moves { given } else { places });
            for (leaf, of) in leaves.iter().zip(triangles.iter().rev()) {
                prop_assert_eq!(leaf.vertices.map(|vertex| vertices[vertex as usize]), corners(of));
                prop_assert_eq!(leaf.primitive, of.geometry << 24 | of.primitive);
            }
        }
    }

    #[test]
    fn vertices_are_the_same_on_any_number_of_threads() {
        let vertex = |number: u32| (number.wrapping_mul(0x9e37_79b9) >> 24) as u8;
        let named = |number: u32| [0, 1, 2].map(|corner| vertex(3 * number + corner));
        let mesh = mesh(&(0..8 * TASK_LENGTH as u32 / 3).map(named).collect::<Vec<_>>());
        let MeshPrimitives::Triangles(triangles) = &mesh.primitives else { unreachable!("triangles") };
        let order: Vec<u32> = (0..triangles.len() as u32).rev().collect();
        let on = |threads| on_new_threads(threads, || index_mesh(&mesh, triangles, &order)).unwrap();
        let alone = on(1);
        assert_eq!(alone.vertices.len(), 2 * 256, "each of two geometries has all vertices");
        for threads in [2, 5, 8] {
            let shared = on(threads);
            assert!(shared.triangles == alone.triangles && shared.vertices == alone.vertices, "{threads}");
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
