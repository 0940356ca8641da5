//! The volume that a view can show, as planes.

use glam::Vec3;

use crate::scene::Camera;

/// The volume that a view can show: points on the inner side of six planes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frustum {
    /// Normal, which looks inside, and offset of each: a point `p` is inside where `normal . p + offset >= 0`.
    pub planes: [[f32; 4]; 6],
}

/// A plane that everything is inside of.
const NO_PLANE: [f32; 4] = [0.0, 0.0, 0.0, 1.0];

impl Frustum {
    /// Everything.
    pub const ALL: Self = Self { planes: [NO_PLANE; 6] };

    /// Returns the frustum of a camera without a far plane, for pictures `aspect` times as wide as high.
    #[must_use]
    pub fn of_camera(camera: &Camera, aspect: f32, near: f32) -> Self {
        let [right, up, forward] = camera.frame().map(Vec3::from);
        let half_height = (0.5 * camera.vertical_fov_degrees.to_radians()).tan();
        let eye = Vec3::from(camera.eye);
        let plane = |normal: Vec3, through: Vec3| {
            let normal = normal.normalize_or_zero();
            normal.extend(-normal.dot(through)).to_array()
        };
        let side = |across: Vec3, extent: f32| plane(forward + across / extent, eye);
        Self {
            planes: [
                side(right, half_height * aspect),
                side(-right, half_height * aspect),
                side(up, half_height),
                side(-up, half_height),
                plane(forward, eye + near * forward),
                NO_PLANE,
            ],
        }
    }

    /// Returns the frustum of a view whose clip coordinates are rows of an affine matrix: x and y from -1 to 1, z from 0 to 1.
    pub(super) fn from_clip_matrix([x, y, z]: [[f32; 4]; 3]) -> Self {
        let planes =
            [(x, 1.0, 1.0), (x, -1.0, 1.0), (y, 1.0, 1.0), (y, -1.0, 1.0), (z, 1.0, 0.0), (z, -1.0, 1.0)];
        let plane = |(row, sign, offset): ([f32; 4], f32, f32)| {
            [sign * row[0], sign * row[1], sign * row[2], sign * row[3] + offset]
        };
        Self { planes: planes.map(plane) }
    }

    /// True if it may show something of a box: false only where the box is beyond one of the planes.
    #[must_use]
    pub fn sees(&self, low: [f32; 3], high: [f32; 3]) -> bool {
        self.margin(low, high) >= 0.0
    }

    /// Smallest distance that the box reaches inside of a plane; below 0 the box is not visible.
    #[must_use]
    pub fn margin(&self, low: [f32; 3], high: [f32; 3]) -> f32 {
        let inside = |plane: &[f32; 4]| {
            let nearest = |axis: usize| if plane[axis] < 0.0 { low[axis] } else { high[axis] };
            (0..3).map(|axis| plane[axis] * nearest(axis)).sum::<f32>() + plane[3]
        };
        self.planes.iter().map(inside).fold(f32::INFINITY, f32::min)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const ASPECT: f32 = 1.6;

    fn camera() -> Camera {
        Camera::looking_at([1.0, 2.0, 3.0], [4.0, 1.0, -2.0], 60.0)
    }

    #[test]
    fn boxes_behind_or_beside_are_outside() {
        let frustum = Frustum::of_camera(&camera(), ASPECT, 0.1);
        let [right, up, forward] = camera().frame().map(Vec3::from);
        let seen = |offset: Vec3| {
            let at = Vec3::from(camera().eye) + offset;
            frustum.sees((at - 0.1).into(), (at + 0.1).into())
        };
        assert!(seen(5.0 * forward) && seen(500.0 * forward));
        for away in [
            -1.0 * forward,
            2.0 * forward + 4.0 * right,
            2.0 * forward - 4.0 * right,
            2.0 * forward + 3.0 * up,
            2.0 * forward - 3.0 * up,
        ] {
            assert!(!seen(away), "{away}");
        }
        assert!(Frustum::ALL.sees([9e9; 3], [9e9; 3]));
    }

    proptest! {
        #[test]
        fn a_box_with_something_visible_is_seen(
            ndc in prop::array::uniform2(-1f32..1.0), depth in 0.11f32..50.0, low in prop::array::uniform3(0f32..3.0),
            high in prop::array::uniform3(0f32..3.0),
        ) {
            let [right, up, forward] = camera().frame().map(Vec3::from);
            let half = 30f32.to_radians().tan() * 0.999;
            let across = right * (ndc[0] * half * ASPECT) + up * (ndc[1] * half);
            let point = Vec3::from(camera().eye) + depth * (forward + across);
            let frustum = Frustum::of_camera(&camera(), ASPECT, 0.1);
            prop_assert!(frustum.sees((point - Vec3::from(low)).into(), (point + Vec3::from(high)).into()));
        }
    }
}
