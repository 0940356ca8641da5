//! The path of a camera.

use glam::Vec3;

use super::{Camera, Scene};

/// Radius of the movement around a camera, as a share of the diagonal of the scene's bounding box.
const SWAY_SHARE: f32 = 0.015;
/// The same as a share of the distance from the camera to what it looks at, where that is less.
const SWAY_SHARE_OF_VIEW: f32 = 0.25;

/// A closed path of a camera. `phase` runs from 0 to 1, where it begins anew.
#[derive(Debug, Clone, PartialEq)]
pub struct CameraPath {
    kind: Kind,
}

#[derive(Debug, Clone, PartialEq)]
enum Kind {
    Tour { stops: Vec<Camera> },
    Sway { around: Camera, radius: f32 },
}

impl CameraPath {
    /// A closed Catmull-Rom spline through the scene's five cameras - eyes, targets and fields of view -, which starts at
    /// the camera with the index `first` and is at the k-th after it at phase k / 5.
    #[must_use]
    pub fn tour(scene: &Scene, first: usize) -> Self {
        let mut stops = scene.cameras.to_vec();
        let count = stops.len();
        stops.rotate_left(first % count);
        Self { kind: Kind::Tour { stops } }
    }

    /// A small figure of eight around a camera, across the direction of view, while it moves a little towards what it
    /// looks at and back. At phase 0 the camera is where it was.
    #[must_use]
    pub fn sway(scene: &Scene, camera: usize) -> Self {
        let around = scene.cameras[camera % scene.cameras.len()];
        let (low, high) = scene.bounds();
        let diagonal = Vec3::from(low).distance(Vec3::from(high));
        let view = Vec3::from(around.eye).distance(Vec3::from(around.target));
        let radius = (SWAY_SHARE * diagonal).min(SWAY_SHARE_OF_VIEW * view);
        Self { kind: Kind::Sway { around, radius } }
    }

    /// The camera at `phase`, of which whole numbers do not count.
    #[must_use]
    pub fn at(&self, phase: f32) -> Camera {
        let phase = if phase.is_finite() { phase.rem_euclid(1.0) } else { 0.0 };
        match &self.kind {
            Kind::Tour { stops } => tour_at(stops, phase),
            Kind::Sway { around, radius } => sway_at(around, *radius, phase),
        }
    }
}

/// A camera on the tour of a scene, which windows may move until the next frame.
pub(crate) struct CameraTour {
    path: CameraPath,
    pub(crate) camera: Camera,
}

impl CameraTour {
    /// A tour that begins at the camera with the index `first`; see [`CameraPath::tour`].
    pub(crate) fn new(scene: &Scene, first: usize) -> Self {
        let path = CameraPath::tour(scene, first);
        Self { camera: path.at(0.0), path }
    }

    /// Moves the camera to where it is at `phase` of the round.
    pub(crate) fn go_to(&mut self, phase: f32) {
        self.camera = self.path.at(phase);
    }
}

fn tour_at(stops: &[Camera], phase: f32) -> Camera {
    let count = stops.len();
    let along = phase * count as f32;
    let nearest = along.round();
    // Phases are fractions of a round of frames: those that mean a camera have its very numbers.
    if (along - nearest).abs() < 1e-5 {
        return stops[nearest as usize % count];
    }
    let (at, t) = (along.floor() as usize, along.fract());
    let around: [&Camera; 4] = std::array::from_fn(|i| &stops[(at + count + i - 1) % count]);
    let vector =
        |part: fn(&Camera) -> [f32; 3]| spline(around.map(|camera| Vec3::from(part(camera))), t).to_array();
    let fov = spline(around.map(|camera| Vec3::splat(camera.vertical_fov_degrees)), t).x;
    Camera {
        eye: vector(|camera| camera.eye),
        target: vector(|camera| camera.target),
        up: vector(|camera| camera.up),
        vertical_fov_degrees: fov.clamp(10.0, 150.0),
    }
}

/// The uniform Catmull-Rom spline between the second and the third point.
fn spline([a, b, c, d]: [Vec3; 4], t: f32) -> Vec3 {
    let (square, cube) = (t * t, t * t * t);
    0.5 * (2.0 * b
        + (c - a) * t
        + (2.0 * a - 5.0 * b + 4.0 * c - d) * square
        + (3.0 * (b - c) + d - a) * cube)
}

fn sway_at(around: &Camera, radius: f32, phase: f32) -> Camera {
    if phase == 0.0 {
        return *around;
    }
    let [right, up, forward] = around.frame().map(Vec3::from);
    let angle = phase * std::f32::consts::TAU;
    let across = right * angle.sin() + up * (0.4 * (2.0 * angle).sin());
    let offset = radius * (across + forward * (0.5 - 0.5 * angle.cos()));
    Camera { eye: (Vec3::from(around.eye) + offset).to_array(), ..*around }
}

#[cfg(test)]
mod tests {
    use std::sync::LazyLock;

    use super::*;
    use proptest::prelude::*;

    static SCENE: LazyLock<Scene> = LazyLock::new(Scene::procedural);

    #[test]
    fn a_tour_passes_through_all_cameras_and_starts_where_it_is_told() {
        for first in 0..5 {
            let path = CameraPath::tour(&SCENE, first);
            for stop in 0..5 {
                let camera = path.at(stop as f32 / 5.0);
                assert_eq!(camera, SCENE.cameras[(first + stop) % 5], "{first} {stop}");
            }
            assert_eq!(path.at(1.0), path.at(0.0));
        }
    }

    #[test]
    fn a_sway_starts_at_its_camera_and_stays_near() {
        for number in 0..5 {
            let path = CameraPath::sway(&SCENE, number);
            let camera = SCENE.cameras[number];
            assert_eq!(path.at(0.0), camera);
            let distance = |phase| Vec3::from(path.at(phase).eye).distance(camera.eye.into());
            let farthest = (0..100).map(|i| distance(i as f32 / 100.0)).fold(0.0, f32::max);
            let view = Vec3::from(camera.eye).distance(camera.target.into());
            assert!(farthest > 0.01 && farthest < 0.4 * view, "{farthest} of {view}");
        }
    }

    proptest! {
        #[test]
        fn paths_have_no_jumps(phase in 0.0f32..1.0, which in 0usize..5) {
            for path in [CameraPath::tour(&SCENE, which), CameraPath::sway(&SCENE, which)] {
                let (here, there) = (path.at(phase), path.at(phase + 1e-4));
                let far = Vec3::from(here.eye).distance(there.eye.into());
                prop_assert!(far < 0.02, "{far}");
                prop_assert!((here.vertical_fov_degrees - there.vertical_fov_degrees).abs() < 0.1);
                prop_assert!(here.frame().iter().flatten().all(|x| x.is_finite()));
            }
        }
    }
}
