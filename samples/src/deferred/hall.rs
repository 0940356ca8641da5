//! The hall: a paved floor, rows of columns with beams on them, and things of metal and clay that stand about.

use std::f32::consts::TAU;

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use crate::shapes::Mesh;

/// `Vertex` in `shaders/deferred/frame.glsl`.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Vertex {
    position: [f32; 3],
    normal: [f32; 3],
    material: u32,
}

/// `Material` in `shaders/deferred/frame.glsl`.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Material {
    albedo: [f32; 3],
    roughness: f32,
    metalness: f32,
    tiles: f32,
}

/// Materials of the hall, by their index in [`MATERIALS`].
#[derive(Debug, Clone, Copy)]
enum Made {
    Paving,
    Stone,
    Plinth,
    Gold,
    Steel,
    Clay,
}

/// Materials in the order of [`Made`].
pub(super) const MATERIALS: [Material; 6] = [
    Material { albedo: [0.34, 0.33, 0.32], roughness: 0.34, metalness: 0.0, tiles: 1.5 },
    Material { albedo: [0.62, 0.57, 0.5], roughness: 0.62, metalness: 0.0, tiles: 0.0 },
    Material { albedo: [0.3, 0.27, 0.25], roughness: 0.45, metalness: 0.0, tiles: 0.0 },
    Material { albedo: [1.0, 0.71, 0.29], roughness: 0.3, metalness: 1.0, tiles: 0.0 },
    Material { albedo: [0.72, 0.74, 0.78], roughness: 0.2, metalness: 1.0, tiles: 0.0 },
    Material { albedo: [0.55, 0.2, 0.12], roughness: 0.7, metalness: 0.0, tiles: 0.0 },
];

/// Distance from one column to the next along the hall.
const STRIDE: f32 = 4.0;
/// Columns of a row.
const COLUMNS: u8 = 9;
/// Positions of the rows of columns.
const ROWS: [f32; 4] = [-8.2, -4.1, 4.1, 8.2];

/// Everything solid, in one list of corners and one of triangles.
#[derive(Default)]
pub(super) struct Hall {
    pub(super) vertices: Vec<Vertex>,
    pub(super) triangles: Vec<[u32; 3]>,
}

impl Hall {
    pub(super) fn new() -> Self {
        let mut hall = Self::default();
        let floor =
            Mesh::default().quad(Vec3::new(-30.0, 0.0, 30.0), Vec3::X * 60.0, Vec3::NEG_Z * 80.0, 1.0);
        hall.add(Made::Paving, floor);
        ROWS.into_iter().for_each(|x| hall.add_row(x));
        hall.add_altar();
        hall.add_things();
        hall
    }

    fn add(&mut self, made: Made, mesh: Mesh) {
        let first = self.vertices.len() as u32;
        let vertex = |corner: &crate::shapes::Vertex| Vertex {
            position: corner.position.into(),
            normal: corner.normal.into(),
            material: made as u32,
        };
        self.vertices.extend(mesh.vertices.iter().map(vertex));
        let triangles = mesh.triangles.iter().map(|corners| corners.map(|corner| first + u32::from(corner)));
        self.triangles.extend(triangles);
    }

    /// Columns in a line, and the beam on them.
    fn add_row(&mut self, x: f32) {
        let places: Vec<f32> = (0..COLUMNS).map(|number| 5.0 - STRIDE * f32::from(number)).collect();
        for z in &places {
            let at = Vec3::new(x, 0.0, *z);
            self.add(Made::Plinth, block(at, [0.72, 0.36, 0.72]));
            self.add(Made::Stone, moved(column(), at));
            self.add(Made::Stone, block(at + Vec3::Y * 5.05, [0.62, 0.3, 0.62]));
        }
        let (near, far) = (places[0] + 1.4, places[places.len() - 1] - 1.4);
        let beam = Mesh::default().cuboid([x - 0.5, 5.35, far], [x + 0.5, 6.0, near], 1.0);
        let cornice = Mesh::default().cuboid([x - 0.68, 6.0, far - 0.2], [x + 0.68, 6.22, near + 0.2], 1.0);
        self.add(Made::Stone, beam);
        self.add(Made::Plinth, cornice);
    }

    /// Steps at the end of the hall, with a ball of gold in rings.
    fn add_altar(&mut self) {
        let middle = Vec3::new(0.0, 0.0, -24.0);
        for (step, half) in [(0.0, 4.2), (0.3, 3.4), (0.6, 2.6)] {
            self.add(Made::Plinth, block(middle + Vec3::Y * step, [half, 0.3, half]));
        }
        let centre = middle + Vec3::Y * 3.0;
        self.add(Made::Gold, Mesh::default().ball(centre, Vec3::splat(1.15), 64));
        for (tilt, radius) in [(0.35, 1.75), (-0.5, 2.05)] {
            self.add(Made::Steel, ring(centre, tilt, radius));
        }
    }

    /// Balls and jars between the columns.
    fn add_things(&mut self) {
        for number in 0..14_u8 {
            let share = f32::from(number);
            let x = 11.0 * ((0.754_877_7 * share + 0.18).fract() - 0.5) * 1.5;
            let at = Vec3::new(x, 0.0, 5.0 - 26.0 * (0.569_840_3 * share + 0.37).fract());
            let size = 0.28 + 0.3 * (0.31 * share).fract();
            match number % 3 {
                0 => self.add(Made::Clay, moved(jar(2.0 * size), at)),
                1 => self.add(Made::Steel, ball(at, size)),
                _ => self.add(Made::Gold, ball(at, 0.8 * size)),
            }
        }
    }
}

/// A box that stands on `at`; half its width and depth, and its height.
fn block(at: Vec3, [width, height, depth]: [f32; 3]) -> Mesh {
    let (low, high) = (at - Vec3::new(width, 0.0, depth), at + Vec3::new(width, height, depth));
    Mesh::default().cuboid(low.into(), high.into(), 1.0)
}

/// Lies on `at`.
fn ball(at: Vec3, radius: f32) -> Mesh {
    Mesh::default().ball(at + Vec3::Y * radius, Vec3::splat(radius), 40)
}

/// A round shaft that grows thinner upwards, with rolls at its ends.
fn column() -> Mesh {
    let profile = [
        [0.6, 0.36],
        [0.6, 0.46],
        [0.5, 0.54],
        [0.47, 0.62],
        [0.46, 2.0],
        [0.4, 4.6],
        [0.43, 4.68],
        [0.43, 4.76],
        [0.58, 5.05],
    ];
    Mesh::default().lathe(&profile, 32)
}

/// Returns a jar of this height.
fn jar(height: f32) -> Mesh {
    let outline = [
        [0.16, 0.0],
        [0.27, 0.14],
        [0.33, 0.32],
        [0.33, 0.48],
        [0.26, 0.66],
        [0.14, 0.8],
        [0.12, 0.9],
        [0.17, 0.98],
        [0.15, 1.0],
        [0.1, 0.97],
        [0.08, 0.85],
    ];
    let profile = outline.map(|[radius, y]| [radius * height, y * height]);
    Mesh::default().lathe(&profile, 36)
}

/// About `centre`, leaning by `tilt` radians to one side.
fn ring(centre: Vec3, tilt: f32, radius: f32) -> Mesh {
    const TUBE: f32 = 0.07;
    Mesh::default().grid(96, 16, |u, v| {
        let (around, across) = (u * TAU, v * TAU);
        let outwards = Vec3::new(around.cos(), 0.0, around.sin());
        let point = radius * outwards - TUBE * (across.cos() * outwards + across.sin() * Vec3::Y);
        centre + glam::Quat::from_rotation_z(tilt) * point
    })
}

fn moved(mut mesh: Mesh, by: Vec3) -> Mesh {
    mesh.vertices.iter_mut().for_each(|vertex| vertex.position += by);
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_face_where_their_normals_point() {
        let Hall { vertices, triangles } = Hall::new();
        for corners in &triangles {
            let [a, b, c] = corners.map(|corner| Vec3::from(vertices[corner as usize].position));
            let normal = Vec3::from(vertices[corners[0] as usize].normal);
            let across = (b - a).cross(c - a);
            assert!(across.length() < 1e-6 || across.dot(normal) > 0.0, "{a} {b} {c} {normal}");
        }
        assert!(triangles.len() > 10_000);
    }

    #[test]
    fn everything_is_made_of_something() {
        let Hall { vertices, .. } = Hall::new();
        for made in 0..MATERIALS.len() as u32 {
            assert!(vertices.iter().any(|vertex| vertex.material == made), "{made}");
        }
        assert!(vertices.iter().all(|vertex| (vertex.material as usize) < MATERIALS.len()));
    }
}
