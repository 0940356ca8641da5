//! A camera that flies where it is steered.

use glam::{Quat, Vec3};

use crate::scene::Camera;

/// Smallest angle between the view and the vertical, in radians.
const POLE: f32 = 0.02;
/// Speed per second, as a share of the first camera's distance to its target.
const SPEED_SHARE: f32 = 0.5;
/// Factor of the speed while Shift is held.
const HURRY: f32 = 4.0;
/// Factor of one step of speed, and the limits of the factor.
const SPEED_STEP: f32 = 1.2;
const SPEED_RANGE: [f32; 2] = [1e-3, 1e3];
/// Longest time of a step in seconds, so that a pause is no leap.
const LONGEST_STEP: f32 = 0.1;

/// The current input of the user for the camera.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Steering {
    /// Movement to the right, up and forward, -1 to 1 each.
    pub direction: [f32; 3],
    /// Rotation to the right and down, in radians.
    pub turn: [f32; 2],
    /// Steps of speed, faster above 0.
    pub faster: f32,
    /// True for fast movement.
    pub hurry: bool,
}

/// A camera that flies where it is steered.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlyCamera {
    eye: Vec3,
    forward: Vec3,
    up: Vec3,
    vertical_fov_degrees: f32,
    /// Scene units a second.
    speed: f32,
    first_speed: f32,
}

impl FlyCamera {
    /// Starts where `camera` is, which must look somewhere.
    #[must_use]
    pub fn new(camera: &Camera) -> Self {
        let [_, _, forward] = camera.frame().map(Vec3::from);
        let distance = Vec3::from(camera.eye).distance(Vec3::from(camera.target));
        let speed = SPEED_SHARE * if distance.is_normal() { distance } else { 1.0 };
        Self {
            eye: camera.eye.into(),
            forward,
            up: Vec3::from(camera.up).try_normalize().unwrap_or(Vec3::Y),
            vertical_fov_degrees: camera.vertical_fov_degrees,
            speed,
            first_speed: speed,
        }
    }

    /// The same camera at a multiple of the usual speed.
    #[must_use]
    pub fn at_pace(mut self, pace: f32) -> Self {
        self.set_speed(pace * self.first_speed);
        self
    }

    /// Speed as a multiple of the usual speed.
    #[must_use]
    pub fn pace(&self) -> f32 {
        self.speed / self.first_speed
    }

    /// Goes on for `seconds`. Answers whether it has moved or turned.
    pub fn advance(&mut self, steering: &Steering, seconds: f32) -> bool {
        let before = *self;
        self.set_speed(self.speed * SPEED_STEP.powf(steering.faster));
        self.turn(steering.turn);
        let [right, up, forward] = self.camera().frame().map(Vec3::from);
        let [x, y, z] = steering.direction;
        let way = (x * right + y * up + z * forward).clamp_length_max(1.0);
        let hurry = if steering.hurry { HURRY } else { 1.0 };
        self.eye += way * (self.speed * hurry * seconds.clamp(0.0, LONGEST_STEP));
        (self.eye, self.forward) != (before.eye, before.forward)
    }

    /// The camera as it is now.
    #[must_use]
    pub fn camera(&self) -> Camera {
        let target = (self.eye + self.forward).to_array();
        let vertical_fov_degrees = self.vertical_fov_degrees;
        Camera { eye: self.eye.to_array(), target, up: self.up.to_array(), vertical_fov_degrees }
    }

    /// Scene units a second.
    #[must_use]
    pub fn speed(&self) -> f32 {
        self.speed
    }

    fn set_speed(&mut self, speed: f32) {
        let [slowest, fastest] = SPEED_RANGE.map(|factor| factor * self.first_speed);
        self.speed = speed.clamp(slowest, fastest);
    }

    fn turn(&mut self, [right, down]: [f32; 2]) {
        if right == 0.0 && down == 0.0 {
            return;
        }
        let turned = Quat::from_axis_angle(self.up, -right) * self.forward;
        let [side, ..] = Camera { target: (self.eye + turned).to_array(), ..self.camera() }.frame();
        let from_up = turned.angle_between(self.up);
        let down = (from_up + down).clamp(POLE, std::f32::consts::PI - POLE) - from_up;
        self.forward = (Quat::from_axis_angle(side.into(), -down) * turned).normalize_or(self.forward);
    }
}

#[cfg(test)]
mod tests {
    use std::f32::consts::{FRAC_PI_2, PI};

    use proptest::prelude::*;

    use super::*;

    fn camera() -> FlyCamera {
        FlyCamera::new(&Camera::looking_at([1.0, 2.0, 3.0], [1.0, 2.0, -1.0], 50.0))
    }

    fn near(found: [f32; 3], expected: [f32; 3]) -> bool {
        Vec3::from(found).distance(expected.into()) < 1e-4
    }

    #[test]
    fn it_starts_as_the_camera_that_it_takes_over() {
        let found = camera().camera();
        assert_eq!(
            (found.eye, found.up, found.vertical_fov_degrees),
            ([1.0, 2.0, 3.0], [0.0, 1.0, 0.0], 50.0)
        );
        assert!(near(found.frame()[2], [0.0, 0.0, -1.0]));
        assert!(!camera().advance(&Steering::default(), 0.1));
    }

    #[test]
    fn it_flies_along_its_own_axes() {
        for (direction, expected) in [
            ([0.0, 0.0, 1.0], [1.0, 2.0, 2.8]),
            ([1.0, 0.0, 0.0], [1.2, 2.0, 3.0]),
            ([0.0, -1.0, 0.0], [1.0, 1.8, 3.0]),
        ] {
            let mut fly = camera();
            assert!(fly.advance(&Steering { direction, ..Steering::default() }, 0.1));
            assert!(near(fly.camera().eye, expected), "{:?}", fly.camera());
        }
        let mut hurried = camera();
        hurried.advance(&Steering { direction: [0.0, 0.0, 1.0], hurry: true, ..Steering::default() }, 9.0);
        assert!(near(hurried.camera().eye, [1.0, 2.0, 2.2]), "a pause is no leap");
    }

    #[test]
    fn it_turns_right_and_down_and_not_over_the_top() {
        let mut fly = camera();
        fly.advance(&Steering { turn: [FRAC_PI_2, 0.0], ..Steering::default() }, 0.0);
        assert!(near(fly.camera().frame()[2], [1.0, 0.0, 0.0]));
        fly.advance(&Steering { turn: [0.0, PI], ..Steering::default() }, 0.0);
        let [_, up, forward] = fly.camera().frame();
        assert!(forward[1] < -0.999 && up[0] > 0.99, "{:?}", fly.camera());
    }

    #[test]
    fn speed_has_bounds() {
        let mut fly = camera();
        for (faster, bound) in [(1.0, 2e3), (-1.0, 2e-3)] {
            for _ in 0..200 {
                fly.advance(&Steering { faster, ..Steering::default() }, 0.0);
            }
            assert!((fly.speed() / bound - 1.0).abs() < 1e-3, "{}", fly.speed());
        }
    }

    proptest! {
        #[test]
        fn any_steering_leaves_a_camera_with_a_frame(
            steps in prop::collection::vec(([-1_f32..1.0, -1_f32..1.0, -1_f32..1.0], [-9_f32..9.0, -9_f32..9.0]), 1..30),
        ) {
            let mut fly = camera();
            for (direction, turn) in steps {
                fly.advance(&Steering { direction, turn, ..Steering::default() }, 0.05);
                let [right, up, forward] = fly.camera().frame().map(Vec3::from);
                prop_assert!((forward.length() - 1.0).abs() < 1e-4 && up.y > 0.0, "{:?}", fly);
                prop_assert!(right.dot(up).abs() < 1e-4 && right.y.abs() < 1e-3);
            }
        }
    }
}
