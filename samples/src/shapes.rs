//! Meshes made by formulas.

use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3};

/// A corner of triangles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Vertex {
    /// Position of the corner.
    pub position: Vec3,
    /// Unit length, outwards.
    pub normal: Vec3,
    /// Texture coordinates.
    pub texcoord: Vec2,
}

/// A corner without texture coordinates, as shaders read it (`Vertex` in `shaders/common/vertices.glsl`).
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct GpuVertex {
    /// Position of the corner.
    pub position: [f32; 3],
    /// Normal outwards, of length 1.
    pub normal: [f32; 3],
}

impl From<&Vertex> for GpuVertex {
    fn from(vertex: &Vertex) -> Self {
        Self { position: vertex.position.into(), normal: vertex.normal.into() }
    }
}

/// Triangles of fewer than 65,536 vertices.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    /// Corners.
    pub vertices: Vec<Vertex>,
    /// Three places in `vertices` for each triangle.
    pub triangles: Vec<[u16; 3]>,
}

impl Mesh {
    /// Adds a parallelogram from `corner` along `u` and `v`, seen from `u x v`. Texture coordinates are those of the
    /// plane that it lies in, one unit of them being `texture_extent` units of length.
    #[must_use]
    pub fn quad(mut self, corner: Vec3, u: Vec3, v: Vec3, texture_extent: f32) -> Self {
        let normal = u.cross(v).normalize();
        let base = self.vertices.len() as u16;
        for position in [corner, corner + u, corner + v, corner + u + v] {
            let place = match normal.abs().max_position() {
                0 => Vec2::new(position.z, position.y),
                1 => Vec2::new(position.x, position.z),
                _ => Vec2::new(position.x, position.y),
            };
            self.vertices.push(Vertex { position, normal, texcoord: place / texture_extent });
        }
        self.triangles.extend([[base, base + 1, base + 2], [base + 2, base + 1, base + 3]]);
        self
    }

    /// Adds a box.
    #[must_use]
    pub fn cuboid(self, low: [f32; 3], high: [f32; 3], texture_extent: f32) -> Self {
        let (low, high) = (Vec3::from(low), Vec3::from(high));
        let size = high - low;
        self.parallelepiped(low, [Vec3::X * size.x, Vec3::Y * size.y, Vec3::Z * size.z], texture_extent)
    }

    /// Adds a parallelepiped with edges `[u, v, w]` from its corner `low`, where `w` is on the side of `u x v`.
    #[must_use]
    pub fn parallelepiped(mut self, low: Vec3, [u, v, w]: [Vec3; 3], texture_extent: f32) -> Self {
        let high = low + u + v + w;
        for (corner, u, v) in
            [(low, v, u), (low, w, v), (low, u, w), (high, -u, -v), (high, -v, -w), (high, -w, -u)]
        {
            self = self.quad(corner, u, v, texture_extent);
        }
        self
    }

    /// Adds a surface of `columns` times `rows` cells through `point`, which takes coordinates from 0 to 1. Normals
    /// follow from neighbouring points, on the side of the derivative along the second times that along the first.
    #[must_use]
    pub fn grid(mut self, columns: u16, rows: u16, point: impl Fn(f32, f32) -> Vec3) -> Self {
        const STEP: f32 = 1e-3;
        let base = self.vertices.len() as u16;
        for row in 0..=rows {
            for column in 0..=columns {
                let (u, v) = (f32::from(column) / f32::from(columns), f32::from(row) / f32::from(rows));
                // At the pole of a sphere one derivative is 0; a little beside it none is.
                let (inner_u, inner_v) = (u.clamp(STEP, 1.0 - STEP), v.clamp(STEP, 1.0 - STEP));
                let du = point(inner_u + STEP, inner_v) - point(inner_u - STEP, inner_v);
                let dv = point(inner_u, inner_v + STEP) - point(inner_u, inner_v - STEP);
                let normal = dv.cross(du).try_normalize().unwrap_or(Vec3::Y);
                self.vertices.push(Vertex { position: point(u, v), normal, texcoord: Vec2::new(u, v) });
            }
        }
        let width = columns + 1;
        for row in 0..rows {
            for column in 0..columns {
                let corner = base + row * width + column;
                let (right, below) = (corner + 1, corner + width);
                self.triangles.extend([[corner, below, right], [right, below, below + 1]]);
            }
        }
        self
    }

    /// Adds a body of revolution about the y axis. `profile` lists radii and heights upwards; corners stay sharp.
    #[must_use]
    pub fn lathe(mut self, profile: &[[f32; 2]], segments: u16) -> Self {
        for pair in profile.windows(2) {
            let ([r0, y0], [r1, y1]) = (pair[0], pair[1]);
            self = self.grid(segments, 1, |u, v| {
                let (sine, cosine) = (u * std::f32::consts::TAU).sin_cos();
                let radius = r0 + (r1 - r0) * v;
                Vec3::new(radius * cosine, y0 + (y1 - y0) * v, radius * sine)
            });
        }
        self
    }

    /// Adds a sphere, or an ellipsoid of the radii `size`.
    #[must_use]
    pub fn ball(self, centre: Vec3, size: Vec3, segments: u16) -> Self {
        self.grid(segments, segments / 2, |u, v| {
            let (sine, cosine) = (u * std::f32::consts::TAU).sin_cos();
            let (ring, height) = (v * std::f32::consts::PI).sin_cos();
            centre + size * Vec3::new(ring * cosine, -height, ring * sine)
        })
    }

    /// The smallest and the largest coordinates.
    #[must_use]
    pub fn bounds(&self) -> (Vec3, Vec3) {
        let start = (Vec3::splat(f32::INFINITY), Vec3::splat(f32::NEG_INFINITY));
        self.vertices.iter().fold(start, |(low, high), v| (low.min(v.position), high.max(v.position)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Triangles turn counter-clockwise as seen from where their normals point.
    fn assert_outwards(mesh: &Mesh) {
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.map(|corner| mesh.vertices[corner as usize]);
            let normal = (b.position - a.position).cross(c.position - a.position);
            assert!(
                normal.length() < 1e-7 || normal.dot(a.normal) > 0.0,
                "{triangle:?} {normal} {}",
                a.normal
            );
        }
    }

    #[test]
    fn boxes_balls_and_lathes_face_outwards() {
        let cuboid = Mesh::default().cuboid([-1.0, -2.0, -3.0], [1.0, 2.0, 3.0], 1.0);
        let ball = Mesh::default().ball(Vec3::ZERO, Vec3::new(1.0, 2.0, 0.5), 16);
        let lathe = Mesh::default().lathe(&[[1.0, 0.0], [0.5, 1.0], [0.5, 2.0]], 12);
        for (mesh, triangles) in [(cuboid, 12), (ball, 256), (lathe, 48)] {
            assert_eq!(mesh.triangles.len(), triangles);
            assert_outwards(&mesh);
            let outwards = |v: &Vertex| (v.position * Vec3::new(1.0, 0.0, 1.0)).dot(v.normal) > -1e-4;
            assert!(mesh.vertices.iter().all(outwards));
        }
    }

    #[test]
    fn normals_have_unit_length_and_boxes_their_bounds() {
        let ball = Mesh::default().ball(Vec3::ONE, Vec3::new(0.5, 0.2, 0.9), 8);
        assert!(ball.vertices.iter().all(|v| (v.normal.length() - 1.0).abs() < 1e-5));
        let cuboid = Mesh::default().cuboid([0.0; 3], [1.0, 2.0, 3.0], 2.0);
        assert_eq!(cuboid.bounds(), (Vec3::ZERO, Vec3::new(1.0, 2.0, 3.0)));
    }
}
