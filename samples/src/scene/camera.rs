//! The camera of an image.

use glam::{Mat4, Vec3};

/// A pinhole camera with a finite position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// Position of the pinhole.
    pub eye: [f32; 3],
    /// A point in the middle of the picture, different from `eye`.
    pub target: [f32; 3],
    /// A direction that points up in the picture; need not be orthogonal to the view.
    pub up: [f32; 3],
    /// Angle between the lower and the upper edge of the picture, in degrees, above 0 and below 180.
    pub vertical_fov_degrees: f32,
}

impl Camera {
    /// A camera at `eye` that looks at `target`, with +y up.
    pub fn looking_at(eye: [f32; 3], target: [f32; 3], vertical_fov_degrees: f32) -> Self {
        Self { eye, target, up: [0.0, 1.0, 0.0], vertical_fov_degrees }
    }

    /// A camera at `eye` that looks along `direction` (any length but zero), with +y up.
    pub fn looking_along(eye: [f32; 3], direction: [f32; 3], vertical_fov_degrees: f32) -> Self {
        let target = (Vec3::from(eye) + Vec3::from(direction)).to_array();
        Self::looking_at(eye, target, vertical_fov_degrees)
    }

    /// Unit vectors to the right, up and forward in the picture. A view straight along `up` still gets an
    /// orthonormal frame.
    pub fn frame(&self) -> [[f32; 3]; 3] {
        let forward = (Vec3::from(self.target) - Vec3::from(self.eye)).try_normalize().unwrap_or(Vec3::NEG_Z);
        let side = forward.cross(Vec3::from(self.up));
        let right = side.try_normalize().unwrap_or_else(|| forward.any_orthonormal_vector());
        [right.to_array(), right.cross(forward).to_array(), forward.to_array()]
    }

    /// World to view space: x right, y up, looking along -z.
    pub fn view_from_world(&self) -> Mat4 {
        let [right, up, forward] = self.frame().map(Vec3::from);
        let world_from_view = Mat4::from_cols(
            right.extend(0.0),
            up.extend(0.0),
            (-forward).extend(0.0),
            Vec3::from(self.eye).extend(1.0),
        );
        world_from_view.inverse()
    }

    /// View space to Vulkan clip space (y down, depth 0 at `near` to 1 at `far`), for pictures `aspect` times
    /// as wide as high.
    pub fn clip_from_view(&self, aspect: f32, near: f32, far: f32) -> Mat4 {
        let focal = 1.0 / (0.5 * self.vertical_fov_degrees.to_radians()).tan();
        let depth = far / (near - far);
        Mat4::from_cols_array_2d(&[
            [focal / aspect, 0.0, 0.0, 0.0],
            [0.0, -focal, 0.0, 0.0],
            [0.0, 0.0, depth, -1.0],
            [0.0, 0.0, near * depth, 0.0],
        ])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn project(camera: &Camera, point: [f32; 3]) -> Vec3 {
        let clip_from_world = camera.clip_from_view(2.0, 0.1, 100.0) * camera.view_from_world();
        clip_from_world.project_point3(Vec3::from(point))
    }

    #[test]
    fn the_target_lands_in_the_middle_and_up_is_up() {
        let camera = Camera::looking_at([1.0, 2.0, 3.0], [4.0, 1.0, -2.0], 60.0);
        let middle = project(&camera, camera.target);
        assert!(middle.truncate().length() < 1e-5, "{middle}");
        assert!(project(&camera, [4.0, 1.5, -2.0]).y < -0.01, "Vulkan's y points down");
    }

    #[test]
    fn the_edges_of_the_field_of_view_are_the_edges_of_clip_space() {
        let camera = Camera::looking_along([0.0; 3], [0.0, 0.0, -1.0], 90.0);
        let corner = project(&camera, [20.0, 10.0, -10.0]);
        assert!((corner.truncate() - glam::Vec2::new(1.0, -1.0)).length() < 1e-5, "{corner}");
        assert!(project(&camera, [0.0, 0.0, -0.1]).z.abs() < 1e-5);
        assert!((project(&camera, [0.0, 0.0, -100.0]).z - 1.0).abs() < 1e-5);
    }

    #[test]
    fn looking_straight_up_has_an_orthonormal_frame() {
        let frame = Camera::looking_along([0.0; 3], [0.0, 1.0, 0.0], 60.0).frame().map(Vec3::from);
        for i in 0..3 {
            assert!((frame[i].length() - 1.0).abs() < 1e-6);
            assert!(frame[i].dot(frame[(i + 1) % 3]).abs() < 1e-6);
        }
    }
}
