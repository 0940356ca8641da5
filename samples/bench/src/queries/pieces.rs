//! A mesh cut into meshes of neighbours in its list of triangles, whose bounds overlap as those of a scene's objects do.

use std::collections::HashMap;

use super::super::mesh::Mesh;

/// So many meshes that have all the triangles, none of them empty: fewer where there are fewer triangles.
pub(super) fn pieces(mesh: &Mesh, count: u32) -> Vec<Mesh> {
    let all = mesh.triangles.len();
    let count = all.min(count as usize);
    let end = |piece: usize| piece * all / count;
    (0..count).map(|number| piece(mesh, &mesh.triangles[end(number)..end(number + 1)])).collect()
}

/// These triangles with the vertices they use.
fn piece(mesh: &Mesh, triangles: &[[u32; 3]]) -> Mesh {
    let mut places = HashMap::new();
    let mut positions = Vec::new();
    let mut place = |vertex: u32| {
        *places.entry(vertex).or_insert_with(|| {
            positions.push(mesh.positions[vertex as usize]);
            positions.len() as u32 - 1
        })
    };
    let triangles = triangles.iter().map(|triangle| triangle.map(&mut place)).collect();
    Mesh { name: mesh.name.clone(), positions, triangles, ..*mesh }
}

#[cfg(test)]
mod tests {
    use super::super::super::synthetic::spheres;
    use super::*;

    #[test]
    fn pieces_have_all_triangles_in_their_order() {
        let mesh = spheres(1000);
        let corners = |mesh: &Mesh| -> Vec<_> {
            mesh.triangles.iter().flatten().map(|vertex| mesh.positions[*vertex as usize]).collect()
        };
        for (count, expected) in [(1, 1), (7, 7), (128, 128), (5000, 1000)] {
            let pieces = pieces(&mesh, count);
            assert_eq!(pieces.len(), expected);
            assert_eq!(pieces.iter().flat_map(corners).collect::<Vec<_>>(), corners(&mesh));
            assert!(pieces.iter().all(|piece| piece.positions.len() <= 3 * piece.triangles.len()));
        }
    }
}
