//! A camera that goes around what it looks at.

use glam::{Quat, Vec3};

use super::fly_camera::Steering;
use crate::scene::Camera;

/// Smallest angle between the view and the vertical, in radians.
const POLE: f32 = 0.02;
/// Factor of the distance for a notch of the wheel.
const ZOOM: f32 = 0.9;
/// Distances that a second of a held key moves what is looked at, and factor of it while Shift is held.
const PAN: f32 = 0.5;
const HURRY: f32 = 4.0;
/// Limits of the distance, as multiples of the first one.
const DISTANCE_RANGE: [f32; 2] = [1e-3, 1e3];
/// Longest time of a step in seconds, so that a pause is no leap.
const LONGEST_STEP: f32 = 0.1;

/// A camera that goes around what it looks at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OrbitCamera {
    target: Vec3,
    /// Unit vector from the target to the eye.
    back: Vec3,
    distance: f32,
    first_distance: f32,
    up: Vec3,
    vertical_fov_degrees: f32,
}

impl OrbitCamera {
    /// Starts where `camera` is and goes around its target.
    #[must_use]
    pub fn new(camera: &Camera) -> Self {
        let [_, _, forward] = camera.frame().map(Vec3::from);
        let distance = Vec3::from(camera.eye).distance(Vec3::from(camera.target));
        let distance = if distance.is_normal() { distance } else { 1.0 };
        Self {
            target: Vec3::from(camera.eye) + distance * forward,
            back: -forward,
            distance,
            first_distance: distance,
            up: Vec3::from(camera.up).try_normalize().unwrap_or(Vec3::Y),
            vertical_fov_degrees: camera.vertical_fov_degrees,
        }
    }

    /// Goes on for `seconds`: turns around the target, comes nearer by the wheel, and takes the target along to the sides, up and
    /// down, and forward. Answers whether it has moved.
    pub fn advance(&mut self, steering: &Steering, seconds: f32) -> bool {
        let before = *self;
        let [nearest, farthest] = DISTANCE_RANGE.map(|factor| factor * self.first_distance);
        self.distance = (self.distance * ZOOM.powf(steering.faster)).clamp(nearest, farthest);
        self.turn(steering.turn);
        let [right, up, forward] = self.camera().frame().map(Vec3::from);
        let [x, y, z] = steering.direction;
        let way = (x * right + y * up + z * forward).clamp_length_max(1.0);
        let hurry = if steering.hurry { HURRY } else { 1.0 };
        self.target += way * (PAN * self.distance * hurry * seconds.clamp(0.0, LONGEST_STEP));
        *self != before
    }

    /// The camera as it is now.
    #[must_use]
    pub fn camera(&self) -> Camera {
        Camera {
            eye: (self.target + self.distance * self.back).to_array(),
            target: self.target.to_array(),
            up: self.up.to_array(),
            vertical_fov_degrees: self.vertical_fov_degrees,
        }
    }

    /// What is dragged to the right turns to the right, so that the eye goes to the left.
    fn turn(&mut self, [right, down]: [f32; 2]) {
        if right == 0.0 && down == 0.0 {
            return;
        }
        let turned = Quat::from_axis_angle(self.up, -right) * self.back;
        let side = self.up.cross(turned).normalize_or(Vec3::X);
        let from_up = turned.angle_between(self.up);
        let rise = (from_up - down).clamp(POLE, std::f32::consts::PI - POLE) - from_up;
        self.back = (Quat::from_axis_angle(side, rise) * turned).normalize_or(self.back);
    }
}

#[cfg(test)]
mod tests {
    use std::f32::consts::{FRAC_PI_2, PI};

    use proptest::prelude::*;

    use super::*;

    fn camera() -> OrbitCamera {
        OrbitCamera::new(&Camera::looking_at([1.0, 2.0, 7.0], [1.0, 2.0, 3.0], 50.0))
    }

    fn near(found: [f32; 3], expected: [f32; 3]) -> bool {
        Vec3::from(found).distance(expected.into()) < 1e-4
    }

    #[test]
    fn it_starts_as_the_camera_that_it_takes_over() {
        let found = camera().camera();
        assert_eq!(found, Camera::looking_at([1.0, 2.0, 7.0], [1.0, 2.0, 3.0], 50.0));
        assert!(!camera().advance(&Steering::default(), 0.1));
    }

    #[test]
    fn it_goes_around_its_target_and_not_over_the_top() {
        let mut orbit = camera();
        assert!(orbit.advance(&Steering { turn: [FRAC_PI_2, 0.0], ..Steering::default() }, 0.0));
        assert!(near(orbit.camera().eye, [-3.0, 2.0, 3.0]), "{:?}", orbit.camera());
        assert!(near(orbit.camera().target, [1.0, 2.0, 3.0]));
        orbit.advance(&Steering { turn: [0.0, PI], ..Steering::default() }, 0.0);
        let [x, y, z] = orbit.camera().eye;
        assert!(
            y > 5.99 && x < 1.0 && (z - 3.0).abs() < 1e-3,
            "dragged down it looks from above: {x} {y} {z}"
        );
    }

    #[test]
    fn the_wheel_comes_nearer_within_bounds() {
        let mut orbit = camera();
        assert!(orbit.advance(&Steering { faster: 1.0, ..Steering::default() }, 0.0));
        assert!(near(orbit.camera().eye, [1.0, 2.0, 6.6]));
        for (faster, bound) in [(1.0, 4e-3), (-1.0, 4e3)] {
            for _ in 0..300 {
                orbit.advance(&Steering { faster, ..Steering::default() }, 0.0);
            }
            let Camera { eye, target, .. } = orbit.camera();
            let distance = Vec3::from(eye).distance(target.into());
            assert!((distance / bound - 1.0).abs() < 1e-2, "{distance}");
        }
    }

    #[test]
    fn keys_take_the_target_along() {
        let mut orbit = camera();
        assert!(orbit.advance(&Steering { direction: [1.0, 0.0, 0.0], ..Steering::default() }, 9.0));
        assert!(near(orbit.camera().eye, [1.2, 2.0, 7.0]) && near(orbit.camera().target, [1.2, 2.0, 3.0]));
    }

    proptest! {
        #[test]
        fn any_steering_keeps_the_distance_and_a_frame(
            steps in prop::collection::vec(([-1_f32..1.0, -1_f32..1.0, -1_f32..1.0], [-9_f32..9.0, -9_f32..9.0]), 1..30),
        ) {
            let mut orbit = camera();
            for (direction, turn) in steps {
                orbit.advance(&Steering { direction, turn, ..Steering::default() }, 0.05);
                let Camera { eye, target, .. } = orbit.camera();
                let distance = Vec3::from(eye).distance(target.into());
                prop_assert!((distance - 4.0).abs() < 1e-2, "{:?}", orbit);
                let [right, up, _] = orbit.camera().frame().map(Vec3::from);
                prop_assert!(up.y > 0.0 && right.dot(up).abs() < 1e-3);
            }
        }
    }
}
