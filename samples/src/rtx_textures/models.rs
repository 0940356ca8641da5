//! The three models: ground, crate and ring, in one list of vertices and one of triangles.

use std::f32::consts::TAU;
use std::ops::Range;

use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3};

/// Half a side of the ground.
const GROUND: f32 = 300.0;
/// Distance from the middle of a ring to the middle of the tube, and the radius of the tube.
const RING: [f32; 2] = [0.36, 0.15];

/// `Vertex` in `shaders/rtx_textures/frame.glsl`.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Vertex {
    position: [f32; 3],
    normal: [f32; 3],
    texcoord: [f32; 2],
}

/// All models.
#[derive(Default)]
pub(super) struct Models {
    pub(super) vertices: Vec<Vertex>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// Triangles of each model, in the order of `kGround`, `kCrate` and `kRing`.
    pub(super) ranges: Vec<Range<u32>>,
}

impl Models {
    pub(super) fn new() -> Self {
        let mut models = Self::default();
        models.finish(Self::add_ground);
        models.finish(Self::add_crate);
        models.finish(Self::add_ring);
        models
    }

    fn finish(&mut self, add: fn(&mut Self)) {
        let first = self.triangles.len() as u32;
        add(self);
        self.ranges.push(first..self.triangles.len() as u32);
    }

    fn add_ground(&mut self) {
        self.patch([1, 1], |at| {
            let place = (at - 0.5) * 2.0 * GROUND;
            (Vec3::new(place.x, 0.0, -place.y), Vec3::Y, 0.5 * place)
        });
    }

    /// Adds a crate, whose corners are 1 from the middle along each axis.
    fn add_crate(&mut self) {
        for side in 0..6 {
            let normal = if side < 3 { Vec3::AXES[side] } else { -Vec3::AXES[side - 3] };
            let right = if normal.y == 0.0 { Vec3::Y.cross(normal) } else { Vec3::X };
            let up = normal.cross(right);
            self.patch([1, 1], |at| {
                let place = 2.0 * at - 1.0;
                (0.62 * (normal + place.x * right + place.y * up), normal, Vec2::new(at.x, 1.0 - at.y))
            });
        }
    }

    /// Upright.
    fn add_ring(&mut self) {
        self.patch([48, 24], |at| {
            let [around, across] = [TAU * at.x, TAU * at.y];
            let outwards = Vec3::new(around.cos(), around.sin(), 0.0);
            let normal = outwards * across.cos() + Vec3::Z * across.sin();
            (RING[0] * outwards + RING[1] * normal, normal, Vec2::new(4.0 * at.x, 1.6 * at.y))
        });
    }

    /// A surface of some columns and rows of quads; `point` says position, normal and texture coordinates, from
    /// coordinates of 0 to 1.
    fn patch(&mut self, [columns, rows]: [u32; 2], point: impl Fn(Vec2) -> (Vec3, Vec3, Vec2)) {
        let first = self.vertices.len() as u32;
        for (row, column) in (0..=rows).flat_map(|row| (0..=columns).map(move |column| (row, column))) {
            let at = Vec2::new(column as f32 / columns as f32, row as f32 / rows as f32);
            let (position, normal, texcoord) = point(at);
            self.vertices.push(Vertex {
                position: position.into(),
                normal: normal.into(),
                texcoord: texcoord.into(),
            });
        }
        for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column))) {
            let low = first + row * (columns + 1) + column;
            let high = low + columns + 1;
            self.triangles.extend([[low, low + 1, high + 1], [low, high + 1, high]]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_face_where_their_normals_point() {
        let Models { vertices, triangles, ranges } = Models::new();
        assert_eq!(ranges.len(), 3);
        for corners in triangles {
            let [a, b, c] = corners.map(|corner| Vec3::from(vertices[corner as usize].position));
            let normal = Vec3::from(vertices[corners[0] as usize].normal);
            assert!((b - a).cross(c - a).dot(normal) > 0.0, "{a} {b} {c}");
        }
    }
}
