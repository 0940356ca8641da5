//! Boxes around points.

use glam::{Mat4, Vec3};

/// A box along the axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// Smallest coordinates.
    pub min: Vec3,
    /// Largest coordinates.
    pub max: Vec3,
}

impl Bounds {
    /// Returns the smallest box around points, or `None` if there are none.
    #[must_use]
    pub fn around(points: impl IntoIterator<Item = Vec3>) -> Option<Self> {
        let mut points = points.into_iter();
        let first = points.next()?;
        Some(points.fold(Self { min: first, max: first }, |bounds, point| Self {
            min: bounds.min.min(point),
            max: bounds.max.max(point),
        }))
    }

    /// Returns the smallest box around both.
    #[must_use]
    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Returns the smallest box around the transformed corners.
    #[must_use]
    pub fn transformed(self, matrix: &Mat4) -> Self {
        let corner = |bits: u32| {
            let pick = |axis: usize| if bits >> axis & 1 == 0 { self.min[axis] } else { self.max[axis] };
            matrix.transform_point3(Vec3::new(pick(0), pick(1), pick(2)))
        };
        (1..8).map(corner).fold(Self { min: corner(0), max: corner(0) }, |bounds, point| Self {
            min: bounds.min.min(point),
            max: bounds.max.max(point),
        })
    }
}
