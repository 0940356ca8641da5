//! Solids out of triangles: patches, bodies of revolution, blocks and mouldings.
//!
//! Windings are counter-clockwise seen from outside. Normals are left to [`crate::scene::normals`], so points
//! that belong together are computed by the same expression.

use std::f32::consts::TAU;

use glam::{Affine3A, Vec2, Vec3};

use crate::scene::mesh::Mesh;

/// Adds solids to a mesh, each placed by `place` and made of `material`.
pub(super) struct Solids {
    pub mesh: Mesh,
    /// Placement of the next solids.
    pub place: Affine3A,
    /// Number of the material of the next solids.
    pub material: u32,
}

impl Solids {
    pub fn new() -> Self {
        Self { mesh: Mesh::default(), place: Affine3A::IDENTITY, material: 0 }
    }

    /// Places the next solids at `position`, turned by `turn` degrees around the vertical.
    pub fn at(&mut self, position: [f32; 3], turn: f32) -> &mut Self {
        self.place =
            Affine3A::from_translation(position.into()) * Affine3A::from_rotation_y(turn.to_radians());
        self
    }

    /// Makes the next solids of `material`.
    pub fn material(&mut self, material: u32) -> &mut Self {
        self.material = material;
        self
    }

    /// A surface of `columns` x `rows` cells. `point` gives the position of a lattice point (0..=columns,
    /// 0..=rows) and its texture coordinates; its outside is where columns run right when rows run up.
    pub fn patch(&mut self, columns: u32, rows: u32, point: impl Fn(u32, u32) -> (Vec3, Vec2)) {
        let first = self.mesh.positions.len() as u32;
        for (row, column) in (0..=rows).flat_map(|row| (0..=columns).map(move |column| (row, column))) {
            let (position, texcoord) = point(column, row);
            let position = self.place.transform_point3(position);
            self.mesh.add_vertex(position.to_array(), [0.0; 3], texcoord.to_array());
        }
        for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column))) {
            let low = first + row * (columns + 1) + column;
            let high = low + columns + 1;
            self.mesh.add_triangle([low, low + 1, high + 1], self.material);
            self.mesh.add_triangle([low, high + 1, high], self.material);
        }
    }

    /// A flat quadrilateral, corners counter-clockwise from outside; texture coordinates in metres along its
    /// first side and upwards.
    pub fn quad(&mut self, corners: [Vec3; 4]) {
        let [a, b, _, d] = corners;
        let along = (b - a).normalize_or_zero();
        let up = (d - a - along * (d - a).dot(along)).normalize_or_zero();
        let start = Vec2::new(a.dot(along), -a.dot(up));
        self.patch(1, 1, |i, j| {
            let corner = corners[[[0, 1], [3, 2]][j as usize][i as usize]];
            (corner, start + Vec2::new((corner - a).dot(along), -(corner - a).dot(up)))
        });
    }

    /// A box between two corners.
    pub fn block(&mut self, low: [f32; 3], high: [f32; 3]) {
        let corner = |i: u32| {
            let pick = |axis: usize| if i >> axis & 1 == 1 { high[axis] } else { low[axis] };
            Vec3::new(pick(0), pick(1), pick(2))
        };
        for side in [[4, 5, 7, 6], [1, 0, 2, 3], [5, 1, 3, 7], [0, 4, 6, 2], [6, 7, 3, 2], [0, 1, 5, 4]] {
            self.quad(side.map(corner));
        }
    }

    /// A box around the origin with rounded edges of the given radius.
    pub fn rounded_block(&mut self, half_size: Vec3, radius: f32) {
        const CELLS: u32 = 16;
        let inner = half_size - radius;
        for side in 0..6 {
            let (axis, sign) = (side / 2, if side % 2 == 0 { 1.0 } else { -1.0 });
            self.patch(CELLS, CELLS, |i, j| {
                let mut q = Vec3::ZERO;
                q[axis] = half_size[axis] * sign;
                q[(axis + 1) % 3] = sign * rounded_step(i, CELLS, half_size[(axis + 1) % 3], radius);
                q[(axis + 2) % 3] = rounded_step(j, CELLS, half_size[(axis + 2) % 3], radius);
                let core = q.clamp(-inner, inner);
                (core + radius * (q - core).normalize_or_zero(), Vec2::new(q.x + q.z, -q.y))
            });
        }
    }

    /// A body of revolution around the vertical. `profile` is a line of (radius, height) points with the outside on its
    /// right; `swell` scales the radius by angle (radians) and height.
    pub fn lathe(&mut self, profile: &[(f32, f32)], segments: u32, swell: impl Fn(f32, f32) -> f32) {
        let rows = profile.len() as u32 - 1;
        self.patch(segments, rows, |i, j| {
            let (radius, height) = profile[j as usize];
            let angle = (i % segments) as f32 / segments as f32 * TAU;
            let r = radius * swell(angle, height);
            let around = i as f32 / segments as f32 * 2.0;
            (Vec3::new(r * angle.sin(), height, r * angle.cos()), Vec2::new(around, -height))
        });
    }

    /// A sphere around the origin.
    pub fn sphere(&mut self, radius: f32, segments: u32) {
        self.lathe(&arc(radius, segments / 2), segments, |_, _| 1.0);
    }

    /// A straight moulding from `x = 0` to `length`: `profile` is a line of (outwards z, height y) points with the
    /// outside on its right.
    pub fn moulding(&mut self, length: f32, profile: &[(f32, f32)]) {
        for pair in profile.windows(2) {
            let [(z0, y0), (z1, y1)] = [pair[0], pair[1]];
            self.quad([
                Vec3::new(0.0, y0, z0),
                Vec3::new(length, y0, z0),
                Vec3::new(length, y1, z1),
                Vec3::new(0.0, y1, z1),
            ]);
        }
    }
}

/// Half a circle from the lowest to the highest point, as a profile of `steps` pieces.
pub(super) fn arc(radius: f32, steps: u32) -> Vec<(f32, f32)> {
    (0..=steps)
        .map(|j| match j {
            0 => (0.0, -radius),
            j if j == steps => (0.0, radius),
            j => {
                let angle = j as f32 / steps as f32 * 0.5 * TAU;
                (radius * angle.sin(), -radius * angle.cos())
            }
        })
        .collect()
}

/// A smooth profile of `steps` pieces through `points`, a Catmull-Rom spline.
pub(super) fn smooth_profile(points: &[(f32, f32)], steps: u32) -> Vec<(f32, f32)> {
    let last = points.len() - 1;
    let at = |i: usize| Vec2::from(points[i.min(last)]);
    (0..=steps)
        .map(|k| {
            let t = k as f32 / steps as f32 * last as f32;
            let i = (t as usize).min(last - 1);
            let (a, b, c, d) = (at(i.saturating_sub(1)), at(i), at(i + 1), at(i + 2));
            let p = hermite(b, 0.5 * (c - a), c, 0.5 * (d - b), t - i as f32);
            (p.x.max(0.0), p.y)
        })
        .collect()
}

/// The cubic from `a` to `b` with slopes `out` and `into`.
fn hermite(a: Vec2, out: Vec2, b: Vec2, into: Vec2, t: f32) -> Vec2 {
    let (t2, t3) = (t * t, t * t * t);
    a * (2.0 * t3 - 3.0 * t2 + 1.0) + out * (t3 - 2.0 * t2 + t) + b * (3.0 * t2 - 2.0 * t3) + into * (t3 - t2)
}

/// Lattice positions from `-half` to `half` that are dense where the edge is rounded; mirrored exactly.
fn rounded_step(i: u32, cells: u32, half: f32, radius: f32) -> f32 {
    let from_middle = (2 * i).abs_diff(cells) as f32 / cells as f32;
    let sign = if 2 * i < cells { -1.0 } else { 1.0 };
    let distance = match from_middle {
        f if f <= 0.5 => 2.0 * f * (half - radius),
        f if f >= 1.0 => half,
        f => half - radius + radius * (2.0 * f - 1.0),
    };
    sign * distance
}
