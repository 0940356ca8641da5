//! The scene: a few models without texture coordinates, on a ground.

use std::f32::consts::{PI, TAU};
use std::ops::Range;

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use crate::scene::{PAINTED, noise};
use crate::shapes::{GpuVertex, Mesh};

/// `Body` in `shaders/triplanar/frame.glsl`.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Body {
    place: [f32; 3],
    size: f32,
    turn: f32,
    radius: f32,
    sides: u32,
    top: u32,
}

/// Triangles of all models in one list, and the bodies.
pub(super) struct Models {
    pub(super) vertices: Vec<GpuVertex>,
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) bodies: Vec<Body>,
    /// Corners of the model of each body, as places in `triangles`.
    pub(super) corners: Vec<Range<u32>>,
}

impl Models {
    pub(super) fn new() -> Self {
        let mut all =
            Self { vertices: Vec::new(), triangles: Vec::new(), bodies: Vec::new(), corners: Vec::new() };
        let ground = all.add(
            &Mesh::default()
                .grid(1, 1, |u, v| Vec3::new(40.0 * (2.0 * u - 1.0), 0.0, 40.0 * (2.0 * v - 1.0))),
        );
        let rock = all.add(&Mesh::default().grid(96, 48, |u, v| rock(on_ball(u, v))));
        let block = all.add(&Mesh::default().grid(96, 64, |u, v| block(on_ball(u, v))));
        let ring = all.add(&Mesh::default().grid(96, 48, ring));
        let ball = all.add(&Mesh::default().grid(64, 32, on_ball));
        all.add_instance(&ground, [0.0, 0.0, 0.0], 1.0, 0.0, 0.0, ["paving", "paving"]);
        all.add_instance(&rock, [0.0, 1.02, -0.6], 1.25, 1.0, 1.0, ["sandstone", "leaves"]);
        all.add_instance(&block, [-2.35, 0.8, 0.35], 0.8, -1.0, 0.9, ["brick", "paving"]);
        all.add_instance(&ring, [2.5, 0.98, 0.3], 1.0, 1.0, 0.75, ["marble", "marble"]);
        all.add_instance(&ball, [0.95, 0.45, 1.45], 0.45, -2.0, 0.45, ["mosaic", "mosaic"]);
        all.add_instance(&block, [-0.85, 0.36, 1.55], 0.36, 1.0, 0.4, ["wood", "wood"]);
        all
    }

    /// Adds a model, and answers its corners.
    fn add(&mut self, model: &Mesh) -> Range<u32> {
        let first = 3 * self.triangles.len() as u32;
        let base = self.vertices.len() as u32;
        self.vertices.extend(model.vertices.iter().map(GpuVertex::from));
        let triangles = model.triangles.iter();
        self.triangles.extend(triangles.map(|corners| corners.map(|corner| base + u32::from(corner))));
        first..3 * self.triangles.len() as u32
    }

    fn add_instance(
        &mut self,
        model: &Range<u32>,
        place: [f32; 3],
        size: f32,
        turn: f32,
        radius: f32,
        textures: [&str; 2],
    ) {
        let number =
            |name| PAINTED.iter().position(|painted| painted.name == name).unwrap_or_default() as u32;
        let [sides, top] = textures.map(number);
        self.bodies.push(Body { place, size, turn, radius, sides, top });
        self.corners.push(model.clone());
    }
}

/// Returns a point of the unit sphere; `v` runs from pole to pole.
fn on_ball(u: f32, v: f32) -> Vec3 {
    let ((sine, cosine), (ring, height)) = ((TAU * u).sin_cos(), (PI * v).sin_cos());
    Vec3::new(ring * cosine, -height, ring * sine)
}

/// A ball with hollows and humps. Noise in two planes each, so that there is no seam.
fn rock(direction: Vec3) -> Vec3 {
    let Vec3 { x, y, z } = 1.4 * direction + 20.0;
    let rough = noise::fractal(x, y, 4) + noise::fractal(y, z, 4) + noise::fractal(z, x, 4);
    direction * (0.62 + 0.33 * rough) * Vec3::new(1.05, 0.92, 1.05)
}

/// A cube with round edges that reaches from -1 to 1.
fn block(direction: Vec3) -> Vec3 {
    const ROUND: f32 = 9.0;
    let Vec3 { x, y, z } = direction.abs();
    direction / (x.powf(ROUND) + y.powf(ROUND) + z.powf(ROUND)).powf(1.0 / ROUND)
}

/// Upright, with the radius 0.66 of its middle line.
fn ring(u: f32, v: f32) -> Vec3 {
    let ((sine, cosine), (out, along)) = ((TAU * u).sin_cos(), (TAU * v).sin_cos());
    let across = 0.66 + 0.32 * along;
    Vec3::new(across * cosine, across * sine, 0.32 * out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_turn_with_their_normals_and_bodies_stand_in_or_on_the_ground() {
        let Models { vertices, triangles, bodies, corners } = Models::new();
        let position = |number: u32| Vec3::from(vertices[number as usize].position);
        for [a, b, c] in &triangles {
            let turned = (position(*b) - position(*a)).cross(position(*c) - position(*a));
            let normals: Vec3 =
                [a, b, c].into_iter().map(|corner| Vec3::from(vertices[*corner as usize].normal)).sum();
            assert!(turned.length() < 1e-6 || turned.dot(normals) > 0.0, "{turned} {normals}");
        }
        for (body, corners) in bodies.iter().zip(corners).skip(1) {
            let heights = triangles[corners.start as usize / 3..corners.end as usize / 3]
                .iter()
                .flatten()
                .map(|corner| body.place[1] + body.size * vertices[*corner as usize].position[1]);
            let lowest = heights.fold(f32::INFINITY, f32::min);
            assert!((-0.4..0.01).contains(&lowest), "{body:?}: {lowest}");
        }
    }
}
