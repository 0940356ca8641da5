//! Texture coordinates that a material scales and moves.

use std::collections::HashMap;

use super::mesh::Mesh;

/// Change of the texture coordinates of the faces of a material, with `v` up: `uv * scale + offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Mapping {
    /// Factors of `u` and `v`.
    pub scale: [f32; 2],
    /// Added after scaling.
    pub offset: [f32; 2],
}

impl Mapping {
    /// Maps texture coordinates whose `v` runs down, as those of a mesh.
    fn apply(&self, [u, v]: [f32; 2]) -> [f32; 2] {
        let up = [u, 1.0 - v];
        let [u, v] = [0, 1].map(|i| up[i] * self.scale[i] + self.offset[i]);
        let mapped = [u, 1.0 - v];
        if mapped.iter().all(|x| x.is_finite()) { mapped } else { [0.0; 2] }
    }
}

/// Maps the texture coordinates of the triangles of each material that has a mapping. Doubles the vertices of these
/// triangles, which other materials may share; the unused ones stay.
pub(super) fn apply(mesh: &mut Mesh, mappings: &[Option<Mapping>]) {
    let mut mapped: HashMap<(u32, u32), u32> = HashMap::new();
    for triangle in 0..mesh.triangles.len() {
        let material = mesh.triangle_materials[triangle];
        let Some(mapping) = mappings[material as usize] else { continue };
        mesh.triangles[triangle] = mesh.triangles[triangle].map(|vertex| {
            *mapped.entry((vertex, material)).or_insert_with(|| {
                let new = mesh.double_vertex(vertex, mesh.normals[vertex as usize]);
                mesh.texcoords[new as usize] = mapping.apply(mesh.texcoords[vertex as usize]);
                new
            })
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_faces_of_the_material_are_mapped() {
        let mut mesh = Mesh::default();
        for texcoord in [[0.0, 1.0], [1.0, 1.0], [0.0, 0.0], [1.0, 0.0]] {
            mesh.add_vertex([texcoord[0], texcoord[1], 0.0], [0.0, 0.0, 1.0], texcoord);
        }
        mesh.add_triangle([0, 1, 2], 0);
        mesh.add_triangle([1, 3, 2], 1);
        let before = mesh.clone();
        apply(&mut mesh, &[None, Some(Mapping { scale: [2.0, 3.0], offset: [0.5, 0.25] })]);
        assert_eq!((mesh.triangles[0], mesh.positions.len()), (before.triangles[0], 7));
        let found = mesh.triangles[1].map(|vertex| mesh.texcoords[vertex as usize]);
        // With `v` up the coordinates are (1, 0), (1, 1) and (0, 1).
        assert_eq!(found, [[2.5, 0.75], [2.5, -2.25], [0.5, -2.25]]);
        let places = |mesh: &Mesh| mesh.triangles[1].map(|vertex| mesh.positions[vertex as usize]);
        assert_eq!(places(&mesh), places(&before));
    }
}
