//! Cuts triangles into meshlets: as many neighbours as a mesh shader's workgroup puts out.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Most corners and triangles of a meshlet (`shaders/mesh_shaders/meshlet.mesh.glsl`); every mesh shader can put out 256.
pub(super) const MAX_VERTICES: usize = 64;
pub(super) const MAX_TRIANGLES: usize = 96;
/// Says of a vertex that the meshlet does not have it.
const NONE: u8 = u8::MAX;
/// Cosine beyond which normals go too far apart for a cone to say something.
const WIDEST_CONE: f32 = 0.1;

/// Some triangles that lie side by side (`Meshlet` in `shaders/mesh_shaders/frame.glsl`).
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Meshlet {
    /// Middle of a sphere around all corners.
    pub middle: [f32; 3],
    /// Radius of that sphere.
    pub radius: f32,
    /// Axis of a cone around the normals of all triangles.
    pub axis: [f32; 3],
    /// Sine of its half angle; 1 where the normals go too far apart.
    pub cutoff: f32,
    /// First of its places in [`Meshlets::vertices`].
    pub first_vertex: u32,
    /// Their number.
    pub vertex_count: u32,
    /// First of its triangles in [`Meshlets::triangles`].
    pub first_triangle: u32,
    /// Their number.
    pub triangle_count: u32,
}

/// A mesh in pieces.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Meshlets {
    /// The pieces.
    pub meshlets: Vec<Meshlet>,
    /// Places in the mesh's own list of vertices.
    pub vertices: Vec<u32>,
    /// Three bytes each, from the lowest on: corners as places in the meshlet's part of [`vertices`](Self::vertices).
    pub triangles: Vec<u32>,
}

impl Meshlets {
    /// Cuts a mesh. A meshlet grows from the first triangle that is left by neighbours, those first that bring the fewest
    /// vertices and lie nearest, until it is full or has no neighbours.
    pub fn build(positions: &[Vec3], triangles: &[[u32; 3]]) -> Self {
        let mut cutter = Cutter::new(positions, triangles);
        for seed in 0..triangles.len() {
            if cutter.is_left[seed] {
                cutter.grow(seed);
            }
        }
        cutter.cut
    }

    /// Corners of the triangles of a meshlet, as places in the mesh's own list of vertices.
    pub fn corners(&self, meshlet: &Meshlet) -> impl Iterator<Item = [u32; 3]> {
        let first = meshlet.first_triangle as usize;
        let place = |byte: u32| self.vertices[(meshlet.first_vertex + (byte & 255)) as usize];
        let triangles = &self.triangles[first..first + meshlet.triangle_count as usize];
        triangles.iter().map(move |packed| [0, 8, 16].map(|shift| place(packed >> shift)))
    }
}

/// A mesh that is being cut.
struct Cutter<'a> {
    positions: &'a [Vec3],
    triangles: &'a [[u32; 3]],
    /// Triangles at each vertex.
    around: Vec<Vec<u32>>,
    is_left: Vec<bool>,
    /// Place of each vertex in the meshlet that grows.
    places: Vec<u8>,
    cut: Meshlets,
}

impl<'a> Cutter<'a> {
    fn new(positions: &'a [Vec3], triangles: &'a [[u32; 3]]) -> Self {
        let mut around = vec![Vec::new(); positions.len()];
        for (number, corners) in (0..).zip(triangles) {
            corners.iter().for_each(|corner| around[*corner as usize].push(number));
        }
        let (is_left, places) = (vec![true; triangles.len()], vec![NONE; positions.len()]);
        Self { positions, triangles, around, is_left, places, cut: Meshlets::default() }
    }

    fn grow(&mut self, seed: usize) {
        let (first_vertex, first_triangle) = (self.cut.vertices.len(), self.cut.triangles.len());
        let mut taken = Vec::new();
        let mut next = Some(seed);
        while let Some(triangle) = next {
            self.add_triangle(triangle, first_vertex);
            taken.push(triangle);
            next = (taken.len() < MAX_TRIANGLES).then(|| self.best_neighbour(first_vertex, &taken)).flatten();
        }
        let corners = taken.iter().map(|triangle| self.triangles[*triangle]);
        let meshlet = Meshlet {
            first_vertex: first_vertex as u32,
            vertex_count: (self.cut.vertices.len() - first_vertex) as u32,
            first_triangle: first_triangle as u32,
            triangle_count: taken.len() as u32,
            ..bounds(self.positions, &self.cut.vertices[first_vertex..], corners)
        };
        self.cut.meshlets.push(meshlet);
        self.cut.vertices[first_vertex..].iter().for_each(|vertex| self.places[*vertex as usize] = NONE);
    }

    fn add_triangle(&mut self, triangle: usize, first_vertex: usize) {
        let mut packed = 0;
        for (shift, corner) in [0, 8, 16].into_iter().zip(self.triangles[triangle]) {
            let place = &mut self.places[corner as usize];
            if *place == NONE {
                *place = (self.cut.vertices.len() - first_vertex) as u8;
                self.cut.vertices.push(corner);
            }
            packed |= u32::from(*place) << shift;
        }
        self.cut.triangles.push(packed);
        self.is_left[triangle] = false;
    }

    /// The triangle that fits best, of those that are left and share a vertex with the meshlet.
    fn best_neighbour(&self, first_vertex: usize, taken: &[usize]) -> Option<usize> {
        let vertices = &self.cut.vertices[first_vertex..];
        let middle = self.middle(taken[0]);
        let neighbours = vertices.iter().flat_map(|vertex| &self.around[*vertex as usize]);
        let left = neighbours.map(|triangle| *triangle as usize).filter(|triangle| self.is_left[*triangle]);
        let cost =
            |triangle: usize| (self.new_vertices(triangle), self.middle(triangle).distance_squared(middle));
        let fitting = left
            .map(|triangle| (triangle, cost(triangle)))
            .filter(|(_, (new, _))| vertices.len() + new <= MAX_VERTICES);
        let best = fitting.min_by(|(_, (a, near)), (_, (b, far))| a.cmp(b).then(near.total_cmp(far)));
        best.map(|(triangle, _)| triangle)
    }

    fn new_vertices(&self, triangle: usize) -> usize {
        self.triangles[triangle].iter().filter(|corner| self.places[**corner as usize] == NONE).count()
    }

    fn middle(&self, triangle: usize) -> Vec3 {
        self.triangles[triangle].iter().map(|corner| self.positions[*corner as usize]).sum::<Vec3>() / 3.0
    }
}

/// A meshlet with its sphere and its cone, and nothing else.
fn bounds(positions: &[Vec3], vertices: &[u32], triangles: impl Iterator<Item = [u32; 3]>) -> Meshlet {
    let points = || vertices.iter().map(|vertex| positions[*vertex as usize]);
    let low = points().fold(Vec3::INFINITY, Vec3::min);
    let high = points().fold(Vec3::NEG_INFINITY, Vec3::max);
    let middle = 0.5 * (low + high);
    let radius = points().map(|point| point.distance(middle)).fold(0.0, f32::max);
    let normals: Vec<Vec3> = triangles
        .filter_map(|triangle| {
            let [a, b, c] = triangle.map(|corner| positions[corner as usize]);
            (b - a).cross(c - a).try_normalize()
        })
        .collect();
    let axis = normals.iter().sum::<Vec3>().normalize_or(Vec3::Y);
    let widest = normals.iter().map(|normal| normal.dot(axis)).fold(1.0, f32::min);
    let cutoff = if widest > WIDEST_CONE { (1.0 - widest * widest).sqrt() } else { 1.0 };
    Meshlet { middle: middle.into(), radius, axis: axis.into(), cutoff, ..Meshlet::zeroed() }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Any points, and triangles between them, also some with equal corners.
    fn soup() -> impl Strategy<Value = (Vec<Vec3>, Vec<[u32; 3]>)> {
        let point = prop::array::uniform3(-1.0_f32..1.0).prop_map(Vec3::from);
        prop::collection::vec(point, 3..200).prop_flat_map(|points| {
            let corner = 0..points.len() as u32;
            let triangles = prop::collection::vec(prop::array::uniform3(corner), 0..400);
            (Just(points), triangles)
        })
    }

    fn sorted(mut triangles: Vec<[u32; 3]>) -> Vec<[u32; 3]> {
        triangles.sort_unstable();
        triangles
    }

    fn all_corners(cut: &Meshlets) -> Vec<[u32; 3]> {
        cut.meshlets.iter().flat_map(|meshlet| cut.corners(meshlet)).collect()
    }

    proptest! {
        #[test]
        fn every_triangle_is_in_one_meshlet((points, triangles) in soup()) {
            let cut = Meshlets::build(&points, &triangles);
            prop_assert_eq!(sorted(all_corners(&cut)), sorted(triangles));
            for meshlet in &cut.meshlets {
                prop_assert!((1..=MAX_VERTICES as u32).contains(&meshlet.vertex_count));
                prop_assert!((1..=MAX_TRIANGLES as u32).contains(&meshlet.triangle_count));
            }
        }

        #[test]
        fn a_cone_hides_only_back_faces((points, triangles) in soup(), eye in prop::array::uniform3(-3.0_f32..3.0)) {
            let (cut, eye) = (Meshlets::build(&points, &triangles), Vec3::from(eye));
            for meshlet in &cut.meshlets {
                let seen = Vec3::from(meshlet.middle) - eye;
                let is_hidden = seen.dot(meshlet.axis.into()) >= meshlet.cutoff * seen.length() + meshlet.radius;
                for corners in cut.corners(meshlet) {
                    let [a, b, c] = corners.map(|corner| points[corner as usize]);
                    prop_assert!((a - Vec3::from(meshlet.middle)).length() <= meshlet.radius * 1.0001);
                    prop_assert!(!is_hidden || (b - a).cross(c - a).dot(a - eye) > -1e-5);
                }
            }
        }
    }

    #[test]
    fn meshlets_of_a_knot_are_nearly_full_and_small() {
        let knot = super::super::knot::knot();
        let positions: Vec<Vec3> = knot.vertices.iter().map(|vertex| vertex.position).collect();
        let triangles: Vec<_> = knot.triangles.iter().map(|corners| corners.map(u32::from)).collect();
        let cut = Meshlets::build(&positions, &triangles);
        assert!(cut.meshlets.len() * 80 < triangles.len(), "{} meshlets", cut.meshlets.len());
        assert!(cut.meshlets.iter().all(|meshlet| meshlet.radius < 0.5));
        let has_cone = cut.meshlets.iter().filter(|meshlet| meshlet.cutoff < 1.0).count();
        assert!(4 * has_cone > 3 * cut.meshlets.len(), "{has_cone}");
    }
}
