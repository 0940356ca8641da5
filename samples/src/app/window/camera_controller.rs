//! The camera controller: the camera belongs to the animation until the user steers it.

use glam::Vec3;

use crate::app::fly_camera::{FlyCamera, Steering};
use crate::app::orbit_camera::OrbitCamera;
use crate::scene::Camera;

/// A person at mouse and keys. The first way flown or turned takes the camera over; how fast it flies can be chosen before.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct CameraController {
    /// The camera of the user, if the user has taken it over.
    taken: Option<Taken>,
    /// True if the camera goes around what it looks at.
    orbits: bool,
    /// Speed as a multiple of the usual speed. The speed outlasts the released camera.
    pace: f32,
    /// How far away what the camera looks at was when it was last known.
    distance: f32,
}

/// A camera of the user.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Taken {
    Fly(FlyCamera),
    Orbit(OrbitCamera),
}

impl Taken {
    fn camera(&self) -> Camera {
        match self {
            Self::Fly(fly) => fly.camera(),
            Self::Orbit(orbit) => orbit.camera(),
        }
    }
}

impl CameraController {
    /// A controller before any input, which orbits or flies.
    pub(super) fn new(orbits: bool) -> Self {
        Self { taken: None, orbits, pace: 1.0, distance: 1.0 }
    }

    /// Steers for `seconds`. `seen_from` is the sample's camera, if it has one. Answers whether the view is another one now.
    pub(super) fn steer(&mut self, seen_from: Option<&Camera>, steering: &Steering, seconds: f32) -> bool {
        let was_taken = self.taken.is_some();
        let Some(mut taken) = self.taken.or_else(|| seen_from.map(|camera| self.take(camera))) else {
            return false;
        };
        let moves = match &mut taken {
            Taken::Fly(fly) => {
                let moves = fly.advance(steering, seconds);
                self.pace = fly.pace();
                moves
            }
            Taken::Orbit(orbit) => orbit.advance(steering, seconds),
        };
        self.taken = (moves || was_taken).then_some(taken);
        moves
    }

    /// Goes around what the camera looks at, or flies again. The view stays.
    pub(super) fn set_orbits(&mut self, orbits: bool) {
        if self.orbits != orbits {
            self.orbits = orbits;
            self.taken = self.camera().map(|camera| self.take(&camera));
        }
    }

    /// True if the camera goes around what it looks at.
    pub(super) fn orbits(&self) -> bool {
        self.orbits
    }

    /// The camera, while it is a person's.
    pub(super) fn camera(&self) -> Option<Camera> {
        self.taken.as_ref().map(Taken::camera)
    }

    /// Gives the camera back to the animation.
    pub(super) fn release(&mut self) {
        self.taken = None;
    }

    /// Takes over a camera, which knows its target unless it flew.
    fn take(&mut self, camera: &Camera) -> Taken {
        let (eye, target) = (Vec3::from(camera.eye), Vec3::from(camera.target));
        let flew = matches!(self.taken, Some(Taken::Fly(_)));
        if !flew {
            self.distance = eye.distance(target);
        }
        if !self.orbits {
            return Taken::Fly(FlyCamera::new(camera).at_pace(self.pace));
        }
        let [_, _, forward] = camera.frame().map(Vec3::from);
        let target = if flew { eye + self.distance * forward } else { target };
        Taken::Orbit(OrbitCamera::new(&Camera { target: target.to_array(), ..*camera }))
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
        let usual = step(&mut CameraController::new(false));
        let mut camera_controller = CameraController::new(false);
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
        let mut camera_controller = CameraController::new(false);
        for steering in [TEN_NOTCHES, Steering { hurry: true, ..STANDING }] {
            assert!(!camera_controller.steer(Some(&SEEN_FROM), &steering, 0.1));
            assert_eq!(camera_controller.camera(), None);
        }
    }

    #[test]
    fn a_camera_is_kept_until_it_is_given_back_and_its_speed_beyond() {
        let mut camera_controller = CameraController::new(false);
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
        let mut camera_controller = CameraController::new(false);
        assert!(!camera_controller.steer(None, &FORWARD, 0.1));
        assert_eq!(camera_controller.camera(), None);
    }

    #[test]
    fn the_view_stays_when_an_orbit_becomes_a_flight_and_back() {
        let mut controller = CameraController::new(true);
        let turn = Steering { turn: [0.5, 0.2], ..STANDING };
        assert!(controller.steer(Some(&SEEN_FROM), &turn, 0.1));
        let orbit = controller.camera().unwrap();
        assert!(Vec3::from(orbit.target).distance(Vec3::from(SEEN_FROM.target)) < 1e-5);
        controller.set_orbits(false);
        let fly = controller.camera().unwrap();
        let is_near = |a: [f32; 3], b: [f32; 3]| Vec3::from(a).distance(b.into()) < 1e-4;
        assert!(is_near(fly.eye, orbit.eye) && is_near(fly.frame()[2], orbit.frame()[2]));
        assert!(controller.steer(Some(&SEEN_FROM), &FORWARD, 0.1));
        let flown = controller.camera().unwrap();
        controller.set_orbits(true);
        let again = controller.camera().unwrap();
        assert!(is_near(again.eye, flown.eye) && is_near(again.frame()[2], flown.frame()[2]));
        let distance = Vec3::from(again.eye).distance(again.target.into());
        assert!((distance - 4.0).abs() < 1e-3, "it goes around what is as far away as before: {distance}");
    }
}
