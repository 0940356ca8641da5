//! Splits a mesh into chunks of consecutive triangles. Their bounds overlap, as those of a scene's objects do.

use std::collections::HashMap;

use crate::mesh::Mesh;

/// Splits the triangles into `count` meshes, or fewer for a mesh with fewer triangles. No mesh is empty.
pub(super) fn split_into_chunks(mesh: &Mesh, count: u32) -> Vec<Mesh> {
    let all = mesh.triangles.len();
    let count = all.min(count as usize);
    let end = |chunk: usize| chunk * all / count;
    (0..count).map(|number| chunk(mesh, &mesh.triangles[end(number)..end(number + 1)])).collect()
}

/// Returns a mesh of these triangles and their vertices.
fn chunk(mesh: &Mesh, triangles: &[[u32; 3]]) -> Mesh {
    let mut new_indices = HashMap::new();
    let mut positions = Vec::new();
    let mut new_index = |vertex: u32| {
        *new_indices.entry(vertex).or_insert_with(|| {
            positions.push(mesh.positions[vertex as usize]);
            positions.len() as u32 - 1
        })
    };
    let triangles = triangles.iter().map(|triangle| triangle.map(&mut new_index)).collect();
    Mesh { name: mesh.name.clone(), positions, triangles, ..*mesh }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synthetic::spheres;

    #[test]
    fn chunks_have_all_triangles_in_their_order() {
        let mesh = spheres(1000);
        let corners = |mesh: &Mesh| -> Vec<_> {
            mesh.triangles.iter().flatten().map(|vertex| mesh.positions[*vertex as usize]).collect()
        };
        for (count, expected) in [(1, 1), (7, 7), (128, 128), (5000, 1000)] {
            let chunks = split_into_chunks(&mesh, count);
            assert_eq!(chunks.len(), expected);
            assert_eq!(chunks.iter().flat_map(corners).collect::<Vec<_>>(), corners(&mesh));
            assert!(chunks.iter().all(|chunk| chunk.positions.len() <= 3 * chunk.triangles.len()));
        }
    }
}
