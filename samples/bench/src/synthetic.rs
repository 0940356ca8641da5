//! Generates a mesh of bumpy spheres above a wavy ground, with any number of triangles.

use std::f32::consts::PI;

use crate::mesh::Mesh;
use lvk_samples::scene::Camera;

/// Number of spheres along x and z.
const SPHERES: [u32; 2] = [4, 3];
/// Positions of five cameras that look at the centre.
const EYES: [[f32; 3]; 5] =
    [[0.0, 3.5, 7.5], [6.5, 1.5, 2.5], [-5.5, 5.5, -4.0], [0.6, 8.5, 0.5], [-1.8, 0.7, 3.9]];
/// Share of triangles in the spheres.
const SPHERE_SHARE: f64 = 0.9;

/// Generates a mesh of exactly `triangle_count` triangles, at least 500. Triangles of the spheres are interleaved, as in files
/// that list a scene by material: neighbours in the list are far apart.
pub(super) fn spheres(triangle_count: u32) -> Mesh {
    let count = SPHERES[0] * SPHERES[1];
    let of_one = f64::from(triangle_count) * SPHERE_SHARE / f64::from(count);
    let rows = (of_one / 4.0).sqrt().floor().max(1.0) as u32;
    let cameras = EYES.map(|eye| Camera::looking_at(eye, [0.0, 0.3, 0.0], 50.0));
    let mut mesh = Mesh {
        name: "generated spheres".to_owned(),
        camera: cameras[0],
        cameras,
        light: [2.0, 6.0, 3.0],
        positions: Vec::new(),
        triangles: Vec::new(),
    };
    let patches: Vec<_> = (0..count).map(|sphere| sphere_patch(&mut mesh, sphere, rows)).collect();
    for index in 0..patches[0].len() {
        mesh.triangles.extend(patches.iter().map(|patch| patch[index]));
    }
    let rest = (triangle_count as usize).saturating_sub(mesh.triangles.len());
    let side = (rest as f64 / 2.0).sqrt().ceil() as u32;
    let ground = patch(&mut mesh, [side, side], |u, v| {
        let [x, z] = [u, v].map(|t| 14.0 * t - 7.0);
        [x, 0.15 * (2.0 * x).sin() * (1.5 * z).cos() - 0.2, z]
    });
    mesh.triangles.extend_from_slice(&ground[..rest]);
    mesh
}

fn sphere_patch(mesh: &mut Mesh, number: u32, rows: u32) -> Vec<[u32; 3]> {
    let cell = [number % SPHERES[0], number / SPHERES[0]].map(|cell| 2.0 * cell as f32);
    let [x, z] = [cell[0] - 3.0, cell[1] - 2.0];
    patch(mesh, [rows, 2 * rows], |u, v| {
        // The poles stay open: their triangles would have no area.
        let (theta, phi) = (PI * (0.01 + 0.98 * u), 2.0 * PI * v);
        let radius = 0.8 + 0.08 * (9.0 * theta).sin() * (7.0 * phi).sin();
        [
            x + radius * theta.sin() * phi.cos(),
            0.9 + radius * theta.cos(),
            z + radius * theta.sin() * phi.sin(),
        ]
    })
}

/// Adds the vertices of a grid of `cells`, mapped by `position`, and returns its triangles, two per cell.
fn patch(mesh: &mut Mesh, cells: [u32; 2], position: impl Fn(f32, f32) -> [f32; 3]) -> Vec<[u32; 3]> {
    let first = mesh.positions.len() as u32;
    let columns = cells[1] + 1;
    for row in 0..=cells[0] {
        for column in 0..columns {
            mesh.positions.push(position(row as f32 / cells[0] as f32, column as f32 / cells[1] as f32));
        }
    }
    let mut triangles = Vec::with_capacity((2 * cells[0] * cells[1]) as usize);
    for row in 0..cells[0] {
        for column in 0..cells[1] {
            let vertex = first + row * columns + column;
            triangles.push([vertex, vertex + 1, vertex + columns]);
            triangles.push([vertex + 1, vertex + columns + 1, vertex + columns]);
        }
    }
    triangles
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_triangle_count_is_exact_and_all_triangles_have_area() {
        for count in [500, 501, 1999, 60_000] {
            let mesh = spheres(count);
            assert_eq!(mesh.triangles.len(), count as usize);
            for triangle in &mesh.triangles {
                let [a, b, c] = triangle.map(|vertex| glam::Vec3::from(mesh.positions[vertex as usize]));
                assert!((b - a).cross(c - a).length() > 0.0, "{triangle:?} of {count}");
            }
        }
    }
}
