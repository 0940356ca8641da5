//! Triangles of several materials, put together from quads, boxes and rings, with texture coordinates in metres.

use std::collections::BTreeMap;
use std::f32::consts::TAU;

use glam::{Vec2, Vec3};

use super::surfaces::Surface;

/// Triangles of several materials.
#[derive(Debug, Clone, Default)]
pub(super) struct Solid {
    parts: BTreeMap<Surface, Part>,
}

/// Triangles of one material.
#[derive(Debug, Clone, Default)]
pub(super) struct Part {
    pub(super) positions: Vec<Vec3>,
    /// Unit normals.
    pub(super) normals: Vec<Vec3>,
    /// Metres to the right and down, seen from where the normal points.
    pub(super) texcoords: Vec<Vec2>,
    pub(super) indices: Vec<u32>,
}

impl Solid {
    /// Returns each material and its triangles.
    pub(super) fn parts(&self) -> impl Iterator<Item = (Surface, &Part)> {
        self.parts.iter().map(|(surface, part)| (*surface, part))
    }

    /// Number of triangles.
    pub(super) fn triangle_count(&self) -> u64 {
        self.parts.values().map(|part| part.indices.len() as u64 / 3).sum()
    }

    /// Lowest and highest corner of the box around it.
    pub(super) fn bounds(&self) -> [Vec3; 2] {
        let positions = self.parts.values().flat_map(|part| &part.positions);
        positions.fold([Vec3::INFINITY, Vec3::NEG_INFINITY], |[low, high], position| {
            [low.min(*position), high.max(*position)]
        })
    }

    /// Adds a parallelogram, seen from `u x v`.
    pub(super) fn quad(&mut self, surface: Surface, corner: Vec3, u: Vec3, v: Vec3) {
        let normal = u.cross(v).normalize_or(Vec3::Y);
        self.quad_with_normal(surface, [corner, corner + u, corner + v, corner + u + v], normal);
    }

    /// Adds a quad: first the ends of one edge, then those of the edge opposite, in the same direction.
    pub(super) fn quad_with_normal(&mut self, surface: Surface, corners: [Vec3; 4], normal: Vec3) {
        let part = self.parts.entry(surface).or_default();
        let base = part.positions.len() as u32;
        part.positions.extend(corners);
        part.normals.extend([normal; 4]);
        part.texcoords.extend(corners.map(|corner| in_plane(corner, normal)));
        part.indices.extend([0, 1, 2, 2, 1, 3].map(|corner| base + corner));
    }

    /// Adds a triangle, seen from where it is counter-clockwise.
    pub(super) fn triangle(&mut self, surface: Surface, corners: [Vec3; 3]) {
        let [a, b, c] = corners;
        let normal = (b - a).cross(c - a).normalize_or(Vec3::Y);
        let part = self.parts.entry(surface).or_default();
        let base = part.positions.len() as u32;
        part.positions.extend(corners);
        part.normals.extend([normal; 3]);
        part.texcoords.extend(corners.map(|corner| in_plane(corner, normal)));
        part.indices.extend([base, base + 1, base + 2]);
    }

    /// Adds a box without its bottom.
    pub(super) fn cuboid(&mut self, surface: Surface, low: [f32; 3], high: [f32; 3]) {
        let (low, high) = (Vec3::from(low), Vec3::from(high));
        let [x, y, z] = (high - low).to_array();
        let (x, y, z) = (Vec3::X * x, Vec3::Y * y, Vec3::Z * z);
        self.quad(surface, low + y, z, x);
        self.quad(surface, low, y, x);
        self.quad(surface, low + z, x, y);
        self.quad(surface, low, z, y);
        self.quad(surface, low + x, y, z);
    }

    /// Adds a frustum of a cone from one point to another, without its ends: a ring of smooth quads.
    pub(super) fn ring(
        &mut self,
        surface: Surface,
        [from, to]: [Vec3; 2],
        [low, high]: [f32; 2],
        segments: u32,
    ) {
        let axis = (to - from).normalize_or(Vec3::Y);
        let across = axis.any_orthonormal_vector();
        let beside = axis.cross(across);
        let part = self.parts.entry(surface).or_default();
        let base = part.positions.len() as u32;
        for segment in 0..=segments {
            let angle = TAU * segment as f32 / segments as f32;
            let out = across * angle.cos() + beside * angle.sin();
            let around = angle * 0.5 * (low + high);
            part.positions.extend([from + low * out, to + high * out]);
            part.normals.extend([out; 2]);
            part.texcoords.extend([Vec2::new(around, 0.0), Vec2::new(around, -from.distance(to))]);
        }
        for segment in 0..segments {
            part.indices.extend([0, 2, 1, 1, 2, 3].map(|corner| base + 2 * segment + corner));
        }
    }

    /// Adds a disc that faces `normal`.
    pub(super) fn disc(&mut self, surface: Surface, middle: Vec3, normal: Vec3, radius: f32, segments: u32) {
        let across = normal.any_orthonormal_vector();
        let beside = normal.cross(across);
        let part = self.parts.entry(surface).or_default();
        let base = part.positions.len() as u32;
        for segment in 0..segments {
            let (sine, cosine) = (TAU * segment as f32 / segments as f32).sin_cos();
            let corner = middle + radius * (across * cosine + beside * sine);
            part.positions.push(corner);
            part.normals.push(normal);
            part.texcoords.push(in_plane(corner, normal));
        }
        for segment in 2..segments {
            part.indices.extend([base, base + segment - 1, base + segment]);
        }
    }

    /// Adds a prism along z whose outline, counter-clockwise seen from +z, is convex. Its ends are at `-half` and `half`; the
    /// outline of the ends may be narrower.
    pub(super) fn prism(&mut self, surface: Surface, outline: &[Vec2], half: impl Fn(Vec2) -> f32) {
        let at = |point: Vec2, side: f32| point.extend(side * half(point));
        for (place, point) in outline.iter().enumerate() {
            let next = outline[(place + 1) % outline.len()];
            let corners = [at(*point, -1.0), at(next, -1.0), at(*point, 1.0), at(next, 1.0)];
            let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or(Vec3::Y);
            self.quad_with_normal(surface, corners, normal);
        }
        for place in 1..outline.len().saturating_sub(1) {
            let [a, b, c] = [outline[0], outline[place], outline[place + 1]];
            self.triangle(surface, [at(a, 1.0), at(b, 1.0), at(c, 1.0)]);
            self.triangle(surface, [at(a, -1.0), at(c, -1.0), at(b, -1.0)]);
        }
    }
}

/// Texture coordinates of a point of a flat surface, in metres. Surfaces in one plane agree, so that patterns go on across them.
fn in_plane(position: Vec3, normal: Vec3) -> Vec2 {
    let across = Vec3::Y.cross(normal).try_normalize().unwrap_or(Vec3::X);
    Vec2::new(position.dot(across), -position.dot(normal.cross(across)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Asserts that all triangles are counter-clockwise seen from where their normals point, and outside of the middle.
    fn assert_faces_outwards(solid: &Solid) {
        let [low, high] = solid.bounds();
        let middle = 0.5 * (low + high);
        for (_, part) in solid.parts() {
            for corners in part.indices.chunks_exact(3) {
                let [a, b, c] = [0, 1, 2].map(|corner| part.positions[corners[corner] as usize]);
                let face = (b - a).cross(c - a);
                assert!(face.dot(part.normals[corners[0] as usize]) > 0.0, "{a} {b} {c}");
                assert!(face.dot((a + b + c) / 3.0 - middle) > 0.0, "{a} {b} {c}");
            }
        }
    }

    #[test]
    fn shapes_face_outwards() {
        let make: [fn(&mut Solid); 3] = [
            |solid| solid.cuboid(Surface::Brick, [-1.0, 0.0, -2.0], [1.0, 3.0, 2.0]),
            |solid| {
                solid.ring(Surface::Bark, [Vec3::ZERO, Vec3::new(0.5, 3.0, 0.2)], [0.5, 0.4], 9);
                solid.disc(Surface::Bark, Vec3::new(0.5, 3.0, 0.2), Vec3::Y, 0.4, 9);
            },
            |solid| {
                let outline = [[-2.0, 0.0], [2.0, 0.0], [1.0, 1.0], [-1.0, 1.0]].map(Vec2::from);
                solid.prism(Surface::RedPaint, &outline, |point| 1.0 - 0.2 * point.y);
            },
        ];
        for make in make {
            let mut solid = Solid::default();
            make(&mut solid);
            assert!(solid.triangle_count() >= 10);
            assert_faces_outwards(&solid);
        }
    }

    #[test]
    fn texture_coordinates_are_metres_to_the_right_and_down() {
        let mut solid = Solid::default();
        solid.cuboid(Surface::Brick, [-1.0, 0.5, -2.0], [1.5, 3.0, 2.0]);
        let slope = [Vec3::new(-1.0, 0.0, 2.0), Vec3::new(2.0, 0.0, 2.0), Vec3::new(0.0, 3.0, -1.0)];
        solid.triangle(Surface::Brick, slope);
        let (_, part) = solid.parts().next().unwrap();
        for corners in part.indices.chunks_exact(3) {
            let [a, b, c] = [0, 1, 2].map(|corner| corners[corner] as usize);
            for (from, to) in [(a, b), (b, c), (c, a)] {
                let metres = part.positions[from].distance(part.positions[to]);
                assert!((part.texcoords[from].distance(part.texcoords[to]) - metres).abs() < 1e-5);
            }
            // Not mirrored: rows of images run down.
            let area =
                (part.texcoords[b] - part.texcoords[a]).perp_dot(part.texcoords[c] - part.texcoords[a]);
            assert!(area < 0.0, "{corners:?}");
        }
        let [foot, _, top] = [0, 1, 2].map(|corner| part.texcoords[part.texcoords.len() - 3 + corner]);
        assert!(top.y < foot.y, "rows run down a slope");
    }
}
