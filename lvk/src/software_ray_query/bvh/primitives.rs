//! The primitives of a mesh as leaves store them, without those that no ray can hit.

use std::sync::atomic::{AtomicBool, Ordering};

use glam::Vec3;
use rayon::prelude::*;

use super::build_threads::TASK_LENGTH;
use super::settings::BvhSettings;
use crate::accel::geometry::GeometryFlags;
use crate::accel::primitive_bounds::{Bounds, GeometryBytes};
use crate::software_ray_query::layout::{LeafBox, LeafTriangle};

/// Maximum coordinate of bounds. Sums of areas that a build compares stay finite with it. Kernels have it in
/// `kernels/box.glsl`.
pub(crate) const MAX_COORDINATE: f32 = 1e15;

/// The primitives of all geometries.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum MeshPrimitives {
    Triangles(Vec<LeafTriangle>),
    Boxes(Vec<LeafBox>),
}

/// The mesh of a BLAS.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Mesh {
    pub(crate) primitives: MeshPrimitives,
    /// Vertex indices of each triangle in its geometry, if leaves share vertices as given; else empty.
    pub(crate) vertices: Vec<[u32; 3]>,
    /// Flags of each geometry.
    pub(crate) flags: Vec<GeometryFlags>,
}

impl Mesh {
    /// Reads the primitives of the geometries, which are all of one kind, for a tree with these settings.
    pub(crate) fn new(geometries: &[(GeometryBytes<'_>, GeometryFlags)], quality: BvhSettings) -> Self {
        let flags = geometries.iter().map(|(_, flags)| *flags).collect();
        let boxes = matches!(geometries.first(), Some((GeometryBytes::Boxes(_), _)));
        let mut mesh = Self {
            primitives: if boxes {
                MeshPrimitives::Boxes(Vec::new())
            } else {
                MeshPrimitives::Triangles(Vec::new())
            },
            vertices: Vec::new(),
            flags,
        };
        for (number, (bytes, flags)) in (0..).zip(geometries) {
            mesh.add_geometry(number, bytes, flags.contains(GeometryFlags::OPAQUE), quality);
        }
        mesh
    }

    /// Returns the bounds of the primitives.
    pub(crate) fn bounds(&self) -> Vec<Bounds> {
        match &self.primitives {
            MeshPrimitives::Triangles(all) => {
                let corners = |of: &LeafTriangle| [of.a, of.b, of.c].map(clamp_to_max);
                all.par_iter().with_min_len(TASK_LENGTH).map(|of| Bounds::from_points(corners(of))).collect()
            }
            MeshPrimitives::Boxes(all) => {
                let bounds = |of: &LeafBox| Bounds { low: of.low, high: of.high };
                all.par_iter().with_min_len(TASK_LENGTH).map(bounds).collect()
            }
        }
    }

    fn add_geometry(&mut self, geometry: u32, bytes: &GeometryBytes<'_>, opaque: bool, quality: BvhSettings) {
        match (&mut self.primitives, bytes) {
            (MeshPrimitives::Triangles(all), GeometryBytes::Triangles(triangles)) => {
                let leaf = |number| leaf_triangle(triangles.vertices(number)?, number, geometry, opaque);
                let first = all.len();
                extend_in_parallel(all, triangles.count, leaf);
                if quality.keeps_given_vertices() {
                    let vertices = |of: &LeafTriangle| triangles.indices.vertex_indices(of.primitive);
                    self.vertices.par_extend(all[first..].par_iter().filter_map(vertices));
                }
            }
            (MeshPrimitives::Boxes(all), GeometryBytes::Boxes(boxes)) => {
                let leaf = |number| leaf_aabb(boxes.bounds(number)?, number, geometry, opaque);
                extend_in_parallel(all, boxes.count, leaf);
            }
            // The caller has checked that all kinds are equal.
            _ => {}
        }
    }
}

/// Appends what `make` returns for each number below `count`, in order.
fn extend_in_parallel<T: bytemuck::Zeroable + Send>(
    all: &mut Vec<T>,
    count: u32,
    make: impl Fn(u32) -> Option<T> + Sync,
) {
    let numbers = || (0..count).into_par_iter().with_min_len(TASK_LENGTH);
    // Threads write to their places at once. If some make nothing, the rest must close up.
    let (first, is_gap) = (all.len(), AtomicBool::new(false));
    all.par_extend(numbers().map(|number| {
        make(number).unwrap_or_else(|| {
            is_gap.store(true, Ordering::Relaxed);
            T::zeroed()
        })
    }));
    if is_gap.into_inner() {
        all.truncate(first);
        all.par_extend(numbers().filter_map(&make));
    }
}

fn leaf_triangle([a, b, c]: [Vec3; 3], primitive: u32, geometry: u32, opaque: bool) -> Option<LeafTriangle> {
    let finite = [a, b, c].iter().all(|corner| corner.is_finite());
    finite.then(|| LeafTriangle { a, primitive, b, geometry, c, opaque: opaque.into() })
}

fn leaf_aabb(bounds: Bounds, primitive: u32, geometry: u32, opaque: bool) -> Option<LeafBox> {
    let Bounds { low, high } = bounds;
    if low.is_nan() || high.is_nan() {
        return None;
    }
    let (low, high) = (clamp_to_max(low), clamp_to_max(high));
    let geometry = if opaque { geometry | LeafBox::OPAQUE } else { geometry };
    Some(LeafBox { low, primitive, high, geometry })
}

/// Clamps AABBs, which may be infinite: traversal needs finite numbers.
fn clamp_to_max(corner: Vec3) -> Vec3 {
    corner.clamp(Vec3::splat(-MAX_COORDINATE), Vec3::splat(MAX_COORDINATE))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::primitive_bounds::{IndexBytes, TriangleBytes, VertexBytes};
    use crate::format::VertexFormat;

    /// Vertices. The fourth has no valid position.
    const POSITIONS: [[f32; 3]; 5] =
        [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [f32::NAN; 3], [1.0, 1.0, 0.0]];
    /// Triangles. One refers to that vertex, and one to a vertex that does not exist.
    const TRIANGLES: [[u16; 3]; 4] = [[0, 1, 2], [1, 3, 2], [1, 5, 2], [1, 4, 2]];

    fn numbers(mesh: &Mesh) -> Vec<(u32, u32)> {
        match &mesh.primitives {
            MeshPrimitives::Triangles(all) => all.iter().map(|of| (of.geometry, of.primitive)).collect(),
            MeshPrimitives::Boxes(_) => Vec::new(),
        }
    }

    #[test]
    fn every_triangle_has_its_vertices_where_leaves_share_them_as_given() {
        let places: Vec<u8> =
            POSITIONS.as_flattened().iter().flat_map(|number| number.to_le_bytes()).collect();
        let indices: Vec<u8> =
            TRIANGLES.as_flattened().iter().flat_map(|number| number.to_le_bytes()).collect();
        let triangles = |indices, count| {
            let (stride, format) = (0, VertexFormat::F32x3);
            let vertices = VertexBytes { bytes: &places, stride, format, count: POSITIONS.len() as u32 };
            let bytes = TriangleBytes { vertices, indices, count, transform: None };
            (GeometryBytes::Triangles(bytes), GeometryFlags::empty())
        };
        let all = [triangles(IndexBytes::U16(&indices), 4), triangles(IndexBytes::None, 1)];
        for (low_memory, refit) in [(false, false), (false, true), (true, false), (true, true)] {
            let mesh = Mesh::new(&all, BvhSettings { low_memory, refit });
            assert_eq!(numbers(&mesh), [(0, 0), (0, 3), (1, 0)], "without those that no ray can hit");
            let expected: &[_] = if low_memory && refit { &[[0, 1, 2], [1, 4, 2], [0, 1, 2]] } else { &[] };
            assert_eq!(mesh.vertices, expected);
        }
    }
}
