//! The model: a tube along a torus knot.

use std::f32::consts::TAU;

use glam::Vec3;

use crate::shapes::Mesh;

/// Quads around the tube and along it.
const QUADS: [u16; 2] = [44, 700];
/// Radius of the tube.
const TUBE: f32 = 0.27;

/// A knot that fits into a sphere of radius 2 around the origin.
pub(super) fn knot() -> Mesh {
    Mesh::default().grid(QUADS[0], QUADS[1], |across, along| {
        let here = curve(along);
        let ahead = (curve(along + 1e-3) - curve(along - 1e-3)).normalize();
        let beside = ahead.cross(here).normalize();
        let (sine, cosine) = (TAU * across).sin_cos();
        here + TUBE * (cosine * beside - sine * ahead.cross(beside))
    })
}

/// Twice around the upright axis, and three times through the ring.
fn curve(along: f32) -> Vec3 {
    let (around, through) = (2.0 * TAU * along, 3.0 * TAU * along);
    let ring = 1.2 + 0.5 * through.cos();
    Vec3::new(ring * around.cos(), 0.62 * through.sin(), ring * around.sin())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_point_out_of_the_tube() {
        let knot = knot();
        let (columns, rows) = (usize::from(QUADS[0]) + 1, usize::from(QUADS[1]) + 1);
        assert_eq!(knot.vertices.len(), columns * rows);
        for (number, vertex) in knot.vertices.iter().enumerate() {
            let middle = curve((number / columns) as f32 / f32::from(QUADS[1]));
            let outwards = (vertex.position - middle) / TUBE;
            assert!((outwards.length() - 1.0).abs() < 1e-3 && outwards.dot(vertex.normal) > 0.9, "{number}");
            assert!(vertex.position.length() < 2.0);
        }
    }
}
