//! The primitives of a mesh, as leaves hold them: without those that no ray can hit.

use glam::Vec3;

use crate::accel::bounds::{Bounds, BoxBytes, TriangleBytes};
use crate::accel::geometry::GeometryFlags;
use crate::accel::software::layout::{LeafBox, LeafTriangle};

/// Bounds end here: the sums of areas that a build compares still are numbers. Kernels have it in `build/box.glsl`.
pub(crate) const FARTHEST: f32 = 1e15;

/// The primitives of all geometries.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Primitives {
    Triangles(Vec<LeafTriangle>),
    Boxes(Vec<LeafBox>),
}

/// The mesh of a bottom-level structure.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Mesh {
    pub(crate) primitives: Primitives,
    /// Of each geometry.
    pub(crate) flags: Vec<GeometryFlags>,
}

/// A geometry as it was read.
pub(crate) enum GeometryBytes<'a> {
    Triangles(TriangleBytes<'a>),
    Boxes(BoxBytes<'a>),
}

impl Mesh {
    /// Takes the primitives out of the geometries, which are all of one kind.
    pub(crate) fn new(geometries: &[(GeometryBytes<'_>, GeometryFlags)]) -> Self {
        let flags = geometries.iter().map(|(_, flags)| *flags).collect();
        let boxes = matches!(geometries.first(), Some((GeometryBytes::Boxes(_), _)));
        let mut mesh = Self {
            primitives: if boxes { Primitives::Boxes(Vec::new()) } else { Primitives::Triangles(Vec::new()) },
            flags,
        };
        for (number, (bytes, flags)) in (0..).zip(geometries) {
            mesh.add(number, bytes, flags.contains(GeometryFlags::OPAQUE));
        }
        mesh
    }

    /// The boxes of the primitives.
    pub(crate) fn bounds(&self) -> Vec<Bounds> {
        match &self.primitives {
            Primitives::Triangles(all) => all
                .iter()
                .map(|triangle| Bounds::of([triangle.a, triangle.b, triangle.c].map(clamped)))
                .collect(),
            Primitives::Boxes(all) => {
                all.iter().map(|place| Bounds { low: place.low, high: place.high }).collect()
            }
        }
    }

    fn add(&mut self, geometry: u32, bytes: &GeometryBytes<'_>, opaque: bool) {
        match (&mut self.primitives, bytes) {
            (Primitives::Triangles(all), GeometryBytes::Triangles(triangles)) => {
                let leaf = |number| triangle(triangles.corners(number)?, number, geometry, opaque);
                all.extend((0..triangles.count).filter_map(leaf));
            }
            (Primitives::Boxes(all), GeometryBytes::Boxes(boxes)) => {
                let leaf = |number| place(boxes.bounds(number)?, number, geometry, opaque);
                all.extend((0..boxes.count).filter_map(leaf));
            }
            // The kinds were checked to be the same.
            _ => {}
        }
    }
}

fn triangle([a, b, c]: [Vec3; 3], primitive: u32, geometry: u32, opaque: bool) -> Option<LeafTriangle> {
    let finite = [a, b, c].iter().all(|corner| corner.is_finite());
    finite.then(|| LeafTriangle { a, primitive, b, geometry, c, opaque: opaque.into() })
}

fn place(bounds: Bounds, primitive: u32, geometry: u32, opaque: bool) -> Option<LeafBox> {
    let Bounds { low, high } = bounds;
    if low.is_nan() || high.is_nan() {
        return None;
    }
    let (low, high) = (clamped(low), clamped(high));
    let geometry = if opaque { geometry | LeafBox::OPAQUE } else { geometry };
    Some(LeafBox { low, primitive, high, geometry })
}

/// Boxes may reach to infinity; the walk wants numbers.
fn clamped(corner: Vec3) -> Vec3 {
    corner.clamp(Vec3::splat(-FARTHEST), Vec3::splat(FARTHEST))
}
