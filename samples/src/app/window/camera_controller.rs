//! The camera controller: the camera belongs to the animation until the user steers it.

use crate::app::fly_camera::{FlyCamera, Steering};
use crate::scene::Camera;

/// A person at mouse and keys. The first way flown or turned takes the camera over; how fast it flies can be chosen before.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct CameraController {
    /// The camera of the user, if the user has taken it over.
    fly: Option<FlyCamera>,
    /// Speed as a multiple of the usual speed. The speed outlasts the released camera.
    pace: f32,
}

impl CameraController {
    /// A controller before any input.
    pub(super) fn new() -> Self {
        Self { fly: None, pace: 1.0 }
    }

    /// Steers for `seconds`. `seen_from` is the sample's camera, if it has one. Answers whether the view is another one now.
    pub(super) fn steer(&mut self, seen_from: Option<&Camera>, steering: &Steering, seconds: f32) -> bool {
        let taken = self.fly;
        let started = || seen_from.map(|camera| FlyCamera::new(camera).at_pace(self.pace));
        let Some(mut fly) = taken.or_else(started) else { return false };
        let moves = fly.advance(steering, seconds);
        self.pace = fly.pace();
        self.fly = (moves || taken.is_some()).then_some(fly);
        moves
    }

    /// The camera, while it is a person's.
    pub(super) fn camera(&self) -> Option<Camera> {
        self.fly.as_ref().map(FlyCamera::camera)
    }

    /// Gives the camera back to the animation.
    pub(super) fn release(&mut self) {
        self.fly = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SEEN_FROM: Camera =
        Camera { eye: [0.0; 3], target: [0.0, 0.0, -4.0], up: [0.0, 1.0, 0.0], vertical_fov_degrees: 50.0 };
    const STANDING: Steering = Steering { direction: [0.0; 3], turn: [0.0; 2], faster: 0.0, hurry: false };
    const FORWARD: Steering = Steering { direction: [0.0, 0.0, 1.0], ..STANDING };
    const TEN_NOTCHES: Steering = Steering { faster: 10.0, ..STANDING };

    /// Distance that a tenth of a second moves the camera forward.
    fn step(camera_controller: &mut CameraController) -> f32 {
        let before = camera_controller.camera().unwrap_or(SEEN_FROM).eye[2];
        assert!(camera_controller.steer(Some(&SEEN_FROM), &FORWARD, 0.1));
        before - camera_controller.camera().unwrap().eye[2]
    }

    #[test]
    fn the_wheel_counts_before_the_first_step_and_between_two() {
        let usual = step(&mut CameraController::new());
        let mut camera_controller = CameraController::new();
        assert!(!camera_controller.steer(Some(&SEEN_FROM), &TEN_NOTCHES, 0.1));
        assert!(!camera_controller.steer(Some(&SEEN_FROM), &STANDING, 0.1));
        let fast = step(&mut camera_controller);
        assert!((fast / usual - 1.2_f32.powi(10)).abs() < 0.01, "{usual} {fast}");
        assert!(!camera_controller.steer(Some(&SEEN_FROM), &TEN_NOTCHES, 0.1), "it stands");
        let faster = step(&mut camera_controller);
        assert!((faster / fast - 1.2_f32.powi(10)).abs() < 0.01, "{fast} {faster}");
    }

    #[test]
    fn the_wheel_alone_leaves_the_camera_to_the_animation() {
        let mut camera_controller = CameraController::new();
        for steering in [TEN_NOTCHES, Steering { hurry: true, ..STANDING }] {
            assert!(!camera_controller.steer(Some(&SEEN_FROM), &steering, 0.1));
            assert_eq!(camera_controller.camera(), None);
        }
    }

    #[test]
    fn a_camera_is_kept_until_it_is_given_back_and_its_speed_beyond() {
        let mut camera_controller = CameraController::new();
        camera_controller.steer(Some(&SEEN_FROM), &TEN_NOTCHES, 0.1);
        let fast = step(&mut camera_controller);
        let there = camera_controller.camera();
        let elsewhere = Camera { eye: [9.0; 3], ..SEEN_FROM };
        assert!(!camera_controller.steer(Some(&elsewhere), &STANDING, 0.1));
        assert_eq!(camera_controller.camera(), there, "the animation goes on without it");
        camera_controller.release();
        assert_eq!(camera_controller.camera(), None);
        assert!((step(&mut camera_controller) / fast - 1.0).abs() < 0.01);
    }

    #[test]
    fn a_sample_without_a_camera_ignores_input() {
        let mut camera_controller = CameraController::new();
        assert!(!camera_controller.steer(None, &FORWARD, 0.1));
        assert_eq!(camera_controller.camera(), None);
    }
}
