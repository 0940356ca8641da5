//! A mesh with any number of triangles: waves on a square.

use lvk_samples::scene::Camera;

use crate::mesh::Mesh;

/// Generates a mesh of exactly `triangle_count` triangles, at least 1, on the square from (-1, 0, -1) to (1, 0, 1). A camera above
/// sees all of it, whatever their number.
pub(super) fn terrain(triangle_count: u64) -> Mesh {
    let camera = Camera::looking_at([0.2, 2.2, 1.6], [0.0; 3], 50.0);
    let side = side(triangle_count);
    let vertices = (0..=side).flat_map(|row| (0..=side).map(move |column| position(row, column, side)));
    Mesh {
        name: "generated terrain".to_owned(),
        positions: vertices.collect(),
        triangles: triangles(triangle_count).collect(),
        camera,
        cameras: [camera; 5],
        light: [2.0, 6.0, 3.0],
    }
}

/// Returns the number of cells along an edge of the square.
pub(super) fn side(triangle_count: u64) -> u32 {
    (triangle_count as f64 / 2.0).sqrt().ceil().max(1.0) as u32
}

/// Returns a vertex of the grid.
pub(super) fn position(row: u32, column: u32, side: u32) -> [f32; 3] {
    let [x, z] = [column, row].map(|step| 2.0 * step as f32 / side as f32 - 1.0);
    [x, 0.1 * (9.0 * x).sin() * (7.0 * z).cos(), z]
}

/// Returns the triangles of the grid by rows, two a cell, up to `count`.
pub(super) fn triangles(count: u64) -> impl Iterator<Item = [u32; 3]> {
    let side = side(count);
    let cells = (0..side).flat_map(move |row| (0..side).map(move |column| row * (side + 1) + column));
    let halves = cells.flat_map(move |first| {
        let below = first + side + 1;
        [[first, below, first + 1], [first + 1, below, below + 1]]
    });
    halves.take(count as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_triangle_count_is_exact_and_all_triangles_face_up() {
        for count in [1, 2, 3, 10, 999, 20_000] {
            let mesh = terrain(count);
            assert_eq!(mesh.triangles.len() as u64, count);
            for triangle in &mesh.triangles {
                let [a, b, c] = triangle.map(|vertex| glam::Vec3::from(mesh.positions[vertex as usize]));
                assert!((b - a).cross(c - a).y > 0.0, "{triangle:?} of {count}");
            }
        }
    }
}
