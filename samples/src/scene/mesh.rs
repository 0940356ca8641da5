//! Triangles while a scene is being put together.

use glam::{DVec3, Vec3};

use super::Material;

/// Triangles while a scene is being put together; the arrays are those of [`super::Scene`].
#[derive(Debug, Clone, Default)]
pub(super) struct Mesh {
    pub positions: Vec<[f32; 3]>,
    pub normals: Vec<[f32; 3]>,
    pub texcoords: Vec<[f32; 2]>,
    pub colors: Vec<[f32; 3]>,
    pub triangles: Vec<[u32; 3]>,
    pub triangle_materials: Vec<u32>,
    pub source_triangles: Vec<u32>,
}

impl Mesh {
    /// Appends a vertex and returns its number.
    pub fn add_vertex(&mut self, position: [f32; 3], normal: [f32; 3], texcoord: [f32; 2]) -> u32 {
        append(&mut self.positions, position);
        append(&mut self.normals, normal);
        append(&mut self.texcoords, texcoord);
        (self.positions.len() - 1) as u32
    }

    /// Appends a vertex like `vertex` but for its normal, and returns its number.
    pub fn double_vertex(&mut self, vertex: u32, normal: [f32; 3]) -> u32 {
        let vertex = vertex as usize;
        if let Some(&color) = self.colors.get(vertex) {
            self.colors.push(color);
        }
        self.add_vertex(self.positions[vertex], normal, self.texcoords[vertex])
    }

    /// Appends a triangle, numbered in the order of calls.
    pub fn add_triangle(&mut self, vertices: [u32; 3], material: u32) {
        append(&mut self.source_triangles, self.triangles.len() as u32);
        append(&mut self.triangles, vertices);
        append(&mut self.triangle_materials, material);
    }

    /// The unit normal of a triangle by its winding, and its angle at a corner in radians.
    pub fn face_normal_and_angle(&self, triangle: usize, corner: usize) -> (Vec3, f32) {
        let vertices = self.triangles[triangle];
        let [a, b, c] =
            [0, 1, 2].map(|i| Vec3::from(self.positions[vertices[(corner + i) % 3] as usize]).as_dvec3());
        let (to_b, to_c) = (b - a, c - a);
        let normal = to_b.cross(to_c).normalize_or_zero();
        (normal.as_vec3(), to_b.angle_between(to_c) as f32)
    }

    /// Takes out triangles without area; returns how many.
    pub fn drop_degenerate(&mut self) -> usize {
        let before = self.triangles.len();
        let mut kept = 0;
        for triangle in 0..before {
            if self.has_area(triangle) {
                self.triangles[kept] = self.triangles[triangle];
                self.triangle_materials[kept] = self.triangle_materials[triangle];
                self.source_triangles[kept] = self.source_triangles[triangle];
                kept += 1;
            }
        }
        self.triangles.truncate(kept);
        self.triangle_materials.truncate(kept);
        self.source_triangles.truncate(kept);
        before - kept
    }

    /// True if the triangle has an area. A face on one line does not count for the size of its mesh, so that its corners may
    /// be infinite in single precision: it has none either.
    fn has_area(&self, triangle: usize) -> bool {
        let [a, b, c] =
            self.triangles[triangle].map(|v| DVec3::from(self.positions[v as usize].map(f64::from)));
        let squared = (b - a).cross(c - a).length_squared();
        squared > 0.0 && squared.is_finite()
    }

    /// Puts opaque triangles first, each group in the order of the source, then numbers the vertices by first use and
    /// drops unused ones. Returns the number of opaque triangles.
    pub fn arrange(&mut self, materials: &[Material]) -> u32 {
        let is_opaque = |material: &u32| !materials[*material as usize].is_refractive();
        let opaque_count = self.triangle_materials.iter().filter(|material| is_opaque(material)).count();
        let front = &self.triangle_materials[..opaque_count];
        if !front.iter().all(is_opaque) {
            let (mut sequence, refractive): (Vec<u32>, Vec<u32>) = (0..self.triangles.len() as u32)
                .partition(|&triangle| is_opaque(&self.triangle_materials[triangle as usize]));
            sequence.extend(refractive);
            self.triangles = picked(&self.triangles, &sequence);
            self.triangle_materials = picked(&self.triangle_materials, &sequence);
            self.source_triangles = picked(&self.source_triangles, &sequence);
        }
        self.number_vertices_by_use();
        opaque_count as u32
    }

    fn number_vertices_by_use(&mut self) {
        const UNUSED: u32 = u32::MAX;
        let mut number = vec![UNUSED; self.positions.len()];
        let mut used: Vec<u32> = Vec::with_capacity(self.positions.len());
        for vertex in self.triangles.iter_mut().flatten() {
            let old = *vertex as usize;
            if number[old] == UNUSED {
                number[old] = used.len() as u32;
                used.push(old as u32);
            }
            *vertex = number[old];
        }
        drop(number);
        self.positions = picked(&self.positions, &used);
        self.normals = picked(&self.normals, &used);
        self.texcoords = picked(&self.texcoords, &used);
        if !self.colors.is_empty() {
            self.colors = picked(&self.colors, &used);
        }
    }
}

/// Appends an element. Full memory grows by an eighth: large meshes have no memory for twice of what they hold.
fn append<T>(elements: &mut Vec<T>, element: T) {
    const LEAST: usize = 256;
    if elements.len() == elements.capacity() {
        elements.reserve_exact(LEAST.max(elements.len() / 8));
    }
    elements.push(element);
}

/// The elements of these numbers.
fn picked<T: Copy>(elements: &[T], numbers: &[u32]) -> Vec<T> {
    numbers.iter().map(|&i| elements[i as usize]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn only_triangles_without_area_are_dropped() {
        let mut mesh = Mesh::default();
        for position in [[0.0; 3], [1e-20, 0.0, 0.0], [0.0, 1e-20, 0.0], [2e-20, 0.0, 0.0]] {
            mesh.add_vertex(position, [0.0; 3], [0.0; 2]);
        }
        mesh.add_triangle([0, 1, 3], 0);
        mesh.add_triangle([0, 1, 2], 0);
        mesh.add_triangle([0, 2, 2], 0);
        assert_eq!(mesh.drop_degenerate(), 2);
        assert_eq!(
            (mesh.triangles.as_slice(), mesh.source_triangles.as_slice()),
            (&[[0, 1, 2]][..], &[1][..])
        );
    }

    proptest! {
        #[test]
        fn arranging_moves_triangles_and_changes_none(
            corners in proptest::collection::vec(prop::array::uniform3(-5i8..5), 3..40),
            picks in proptest::collection::vec((any::<[u8; 3]>(), 0..3u32), 1..80),
        ) {
            let mut mesh = Mesh::default();
            for corner in &corners {
                mesh.add_vertex(corner.map(f32::from), [0.0, 1.0, 0.0], [f32::from(corner[0]), 0.0]);
                mesh.colors.push(corner.map(|x| f32::from(x) + 9.0));
            }
            for (vertices, material) in &picks {
                mesh.add_triangle(vertices.map(|v| u32::from(v) % corners.len() as u32), *material);
            }
            let materials = [
                Material::matte("a", [0.5; 3]), Material::glass("b", [1.0; 3], 1.5), Material::matte("c", [0.5; 3]),
            ];
            let before = mesh.clone();
            let opaque_count = mesh.arrange(&materials) as usize;

            prop_assert_eq!(mesh.triangles.len(), before.triangles.len());
            let mut seen = vec![false; picks.len()];
            for (i, &source) in mesh.source_triangles.iter().enumerate() {
                let source = source as usize;
                prop_assert!(!std::mem::replace(&mut seen[source], true));
                let material = before.triangle_materials[source];
                prop_assert_eq!(mesh.triangle_materials[i], material);
                prop_assert_eq!(i < opaque_count, material != 1);
                for corner in 0..3 {
                    let (new, old) = (mesh.triangles[i][corner] as usize, before.triangles[source][corner] as usize);
                    prop_assert_eq!(mesh.positions[new], before.positions[old]);
                    prop_assert_eq!(mesh.texcoords[new], before.texcoords[old]);
                    prop_assert_eq!(mesh.colors[new], before.colors[old]);
                }
            }
            let used = mesh.triangles.iter().flatten().max().map_or(0, |&m| m as usize + 1);
            prop_assert_eq!(used, mesh.positions.len());
        }
    }
}
