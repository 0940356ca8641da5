//! The scene as the sun sees it.

use glam::Vec3;

/// Rows of the matrix from the world to clip coordinates: x and y from -1 to 1, z from 0 near the sun to 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SunView {
    pub(super) rows: [[f32; 4]; 3],
    /// Width and height of what it shows, in scene units.
    pub(super) size: [f32; 2],
}

impl SunView {
    /// All of a box, from far away in the direction `to_sun`, which has unit length.
    pub(super) fn new(to_sun: Vec3, (low, high): ([f32; 3], [f32; 3])) -> Self {
        let forward = -to_sun;
        let right = forward.any_orthonormal_vector();
        let axes = [right, right.cross(forward), forward];
        let (low, high) = (Vec3::from(low), Vec3::from(high));
        let middle = 0.5 * (low + high);
        let half = 0.5 * (high - low);
        // A little more than the box, so that filters find texels around it.
        let reach = axes.map(|axis| (half.dot(axis.abs()) * 1.01).max(f32::MIN_POSITIVE));
        let row = |axis: Vec3, scale: f32, offset: f32| {
            (axis * scale).extend(offset - scale * axis.dot(middle)).to_array()
        };
        let [x, y, z] = [0, 1, 2].map(|i| 1.0 / reach[i]);
        let rows = [row(axes[0], x, 0.0), row(axes[1], y, 0.0), row(axes[2], 0.5 * z, 0.5)];
        Self { rows, size: [2.0 * reach[0], 2.0 * reach[1]] }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn everything_is_in_view_and_nearer_the_sun_is_nearer(
            sun in prop::array::uniform3(-1f32..1.0), place in prop::array::uniform3(0f32..1.0),
        ) {
            let to_sun = Vec3::from(sun).normalize_or(Vec3::Y);
            let (low, high) = ([-3.0, 0.0, -9.0], [5.0, 7.0, 2.0]);
            let view = SunView::new(to_sun, (low, high));
            let point = Vec3::from(low) + Vec3::from(place) * (Vec3::from(high) - Vec3::from(low));
            let clip = |point: Vec3| view.rows.map(|row| point.extend(1.0).dot(row.into()));
            let [x, y, z] = clip(point);
            prop_assert!(x.abs() <= 1.0 && y.abs() <= 1.0 && (0.0..=1.0).contains(&z), "{x} {y} {z}");
            prop_assert!(clip(point + 0.1 * to_sun)[2] < z);
        }
    }
}
